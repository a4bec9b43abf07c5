// The mock drive with its board, and its INS, as bytes on lines: from the devices to the stream of
// paired, stamped items.
#include <gtest/gtest.h>

#include <GeographicLib/LocalCartesian.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "app/devices/drive_devices.hpp"
#include "app/runtime/errors.hpp"
#include "drivers/acquisition/acquisition.hpp"
#include "drivers/mock/ins_model.hpp"
#include "tests/support/acquired.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/watched_camera.hpp"

namespace vergence::app {
namespace {

using test::WatchedCamera;

constexpr Stamp kEpoch{1'577'836'800'000'000'000};
constexpr double kSeconds = 10;

Configuration chain(const std::vector<std::string>& more = {}) {
  return parse_configuration(R"(
cameras: [{name: left, driver: mock, size: [64, 48]}, {name: right, driver: mock, size: [64, 48]}]
trigger: {driver: mock, rate: 20, vary_us: 2000}
sync: {mode: board}
ins: {driver: mock, rate: 100}
mock: {drive: brief, texture_detail: 0, ins: ideal, board_line: ftdi, ins_line: mti-g-710}
)",
                             "test", more);
}

struct Set {
  SyncedSet set{};
  Stamp stamp{};
  std::array<HostStamp, 2> edges{};  // of the images, late by the jitter
};

struct Driven {
  std::vector<Set> sets;
  std::vector<Acquired> others;
  std::vector<Duration> pulses;
  AcquisitionCounters counters;
  HostStamp start{};
  std::unique_ptr<DriveDevices> owner;
};

Driven drive(const Configuration& c, const std::vector<std::string>& faults = {},
             double seconds = kSeconds) {
  Driven d;
  d.owner = std::make_unique<DriveDevices>(c, faults, true, seconds);
  DriveDevices& devices = *d.owner;
  Acquisition::Options o = devices.acquisition_options();
  o.wait_when_full = true;
  o.tie_stamp = kEpoch;
  o.tie_host = devices.start();
  WatchedCamera left(devices.cameras()[0]), right(devices.cameras()[1]);
  Acquisition source({&left, &right}, devices.ins(), devices.trigger(), o);
  start_acquisition(&source);
  d.start = devices.start();
  for (Acquired item; source.next(&item);) {
    const AcquiredFrame* frame = test::frame_of(item);
    if (frame == nullptr) {
      d.others.push_back(item);
      continue;
    }
    Set s{frame->set, frame->rig.stamp, {}};
    if (s.set.present[0]) s.edges[0] = left.edge_of_slot[s.set.slots[0]];
    if (s.set.present[1]) s.edges[1] = right.edge_of_slot[s.set.slots[1]];
    d.sets.push_back(s);
    source.release(*frame);
  }
  source.join();
  d.counters = source.counters();
  d.pulses = devices.mock()->pulse_times();
  return d;
}

/// Every image of a set is of its pulse, and the stamp is that pulse's middle within its bound; the
/// errors in µs.
std::vector<double> stamp_errors(const Driven& d) {
  std::vector<double> errors;
  for (const Set& s : d.sets) {
    const auto pulse_of = [&](std::size_t k) {
      const Duration edge = s.edges[k] - d.start;
      const auto after = std::upper_bound(d.pulses.begin(), d.pulses.end(), edge);
      EXPECT_LT(edge - *std::prev(after), Duration::milliseconds(2));
      return std::prev(after);
    };
    if (s.set.present[0] && s.set.present[1]) {
      EXPECT_EQ(pulse_of(0), pulse_of(1)) << "a wrong pair, set " << s.set.number;
    }
    const Duration truth = *pulse_of(s.set.present[0] ? 0 : 1) + Duration::milliseconds(4);
    const Duration error = s.stamp - (kEpoch + truth);
    EXPECT_LE(std::abs(error.ns()), s.set.error.ns()) << s.set.number;
    EXPECT_TRUE(s.set.proof == SyncProof::numbered) << s.set.number;
    errors.push_back(std::abs(error.to_seconds()) * 1e6);
  }
  return errors;
}

double p99(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 1e9 : values[values.size() * 99 / 100];
}

class SimulatedBoard : public ::testing::TestWithParam<const char*> {};

TEST_P(SimulatedBoard, pairsAreProvenWithinASecondRightAndStampedWithinTheirBounds) {
  const Driven d = drive(chain({std::string("mock.board_line=") + GetParam()}));
  const std::vector<double> errors = stamp_errors(d);
  ASSERT_GT(errors.size(), 170U) << "of 200 pulses";
  EXPECT_LE(test::worst_acquisition(d.others), 1);
  EXPECT_EQ(test::count(d.others, DeviceEvent::Kind::proven), 2);
  EXPECT_EQ(d.counters.sync.incomplete, 0U);
  EXPECT_EQ(d.counters.sync.unproven, 0U);
  // What mapping the edge leaves, with pings 100 times a second over lines that are late now and
  // then.
  EXPECT_LT(p99(errors), 1000) << "µs";
  ASSERT_NE(d.owner->board(), nullptr);
  EXPECT_GT(d.owner->board()->board_statistics().time.answered, 500U);
}

INSTANTIATE_TEST_SUITE_P(Lines, SimulatedBoard, ::testing::Values("usb", "ftdi"));

TEST(SimulatedBoardLine, feedbackMeasuresTheMiddle) {
  const Driven d = drive(chain({"trigger.feedback=3", "mock.board_line=usb"}));
  EXPECT_GT(stamp_errors(d).size(), 170U);
  EXPECT_LE(test::worst_acquisition(d.others), 1);
}

struct FaultCase {
  const char* name;
  std::vector<std::string> faults;
  DeviceEvent::Kind kind;
  int items, proven;
};
class SimulatedBoardFault : public ::testing::TestWithParam<FaultCase> {};

TEST_P(SimulatedBoardFault, isSaidAndNoPairIsWrongAfterItAndTheSameOnEveryRun) {
  const Driven d = drive(chain(), GetParam().faults), again = drive(chain(), GetParam().faults);
  EXPECT_GT(stamp_errors(d).size(), 100U);
  EXPECT_EQ(test::count(d.others, GetParam().kind), GetParam().items);
  EXPECT_EQ(test::count(d.others, DeviceEvent::Kind::proven), GetParam().proven);
  EXPECT_LE(test::worst_acquisition(d.others), 1);
  ASSERT_EQ(d.sets.size(), again.sets.size());
  for (std::size_t i = 0; i < d.sets.size(); ++i)
    ASSERT_EQ(d.sets[i].stamp, again.sets[i].stamp) << i;
}

using Kind = DeviceEvent::Kind;
INSTANTIATE_TEST_SUITE_P(
    Ways, SimulatedBoardFault,
    ::testing::Values(
        FaultCase{"reboot", {"board_reboot@4"}, Kind::board_rebooted, 1, 4},
        FaultCase{"camera", {"camera_gone@4 camera=1 duration_s=1"}, Kind::camera_back, 1, 3},
        FaultCase{"off", {"board_gone@4 duration_s=1"}, Kind::board_gone, 1, 4},
        FaultCase{"ins", {"ins_gone@4 duration_s=2"}, Kind::acquiring, 2, 2}),
    [](const auto& i) { return std::string(i.param.name); });

Configuration brief_drive(const std::string& line, const std::vector<std::string>& more = {}) {
  std::vector<std::string> set{"mock.ins_line=" + line, "mock.ins=ideal"};
  set.insert(set.end(), more.begin(), more.end());
  return parse_configuration(R"(
cameras: [{name: left, driver: mock, size: [64, 48]}, {name: right, driver: mock, size: [64, 48]}]
trigger: {driver: mock, rate: 10}
ins: {driver: mock, rate: 100}
mock: {drive: brief, texture_detail: 0}
)",
                             "test", set);
}

class SimulatedIns : public ::testing::TestWithParam<const char*> {};

TEST_P(SimulatedIns, readingsStandWhereTheVehicleWasAtTheirStamps) {
  const Driven driven = drive(brief_drive(GetParam()), {}, 24);
  const GeographicLib::LocalCartesian plane(mock::kWorldOrigin.latitude_deg,
                                            mock::kWorldOrigin.longitude_deg,
                                            mock::kWorldOrigin.height_m);
  std::size_t readings = 0;
  for (const Acquired& item : driven.others) {
    const AcquiredReading* reading = test::reading_of(item);
    if (reading == nullptr) continue;
    ++readings;
    const Duration time = stamp_of(item) - kEpoch;
    // 15 s after the line was opened; the fast part of this drive comes after that.
    if (time < Duration::seconds(10) || time > Duration::seconds(24)) continue;
    const auto truth = driven.owner->mock()->truth().ins_in_enu(time);
    const auto body = driven.owner->mock()->truth().drive().at(time);
    Vec3 at;
    plane.Forward(reading->sample.position.latitude_deg, reading->sample.position.longitude_deg,
                  reading->sample.position.height_m, at.x(), at.y(), at.z());
    // The ideal INS's place is off by what the vehicle drove in the stamp's error: 0.5 ms, and
    // 16.32's steps.
    constexpr double kStamp = 0.5e-3, kStep = 1e-4;
    EXPECT_LT((at - truth.t).norm(), kStamp * (body.velocity.norm() + 1) + kStep)
        << time.to_seconds();
    EXPECT_LT(std::abs(reading->sample.stamp_error.to_seconds()), 10e-3);
  }
  EXPECT_GT(readings, 2200U);
}

INSTANTIATE_TEST_SUITE_P(Lines, SimulatedIns, ::testing::Values("mti-g", "mti-g-710"),
                         [](const auto& one) {
                           return std::string(one.param) == "mti-g" ? "legacy" : "mark4";
                         });

}  // namespace
}  // namespace vergence::app
