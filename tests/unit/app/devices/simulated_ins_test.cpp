// The mock drive with its INS as bytes on a line, from the devices to the stream of stamped items.
#include <gtest/gtest.h>

#include <GeographicLib/LocalCartesian.hpp>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "app/devices/drive_devices.hpp"
#include "app/runtime/errors.hpp"
#include "drivers/acquisition/acquisition.hpp"
#include "drivers/mock/ins_model.hpp"
#include "tests/support/acquired.hpp"

namespace vergence::app {
namespace {

constexpr Stamp kEpoch{1'577'836'800'000'000'000};

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

struct Driven {
  std::vector<Acquired> items;
  std::vector<std::string> remarks;
  Stamp start{};  // of the drive
};

Driven drive(const Configuration& c, const std::vector<std::string>& faults, double seconds,
             std::unique_ptr<DriveDevices>* keep = nullptr) {
  auto devices = std::make_unique<DriveDevices>(c, faults, true, seconds);
  Acquisition::Options o = devices->acquisition_options();
  o.wait_when_full = true;
  o.tie_stamp = kEpoch;
  o.tie_host = devices->start();
  Acquisition source(devices->cameras(), devices->ins(), devices->trigger(), o);
  start_acquisition(&source);
  Driven driven;
  driven.start = kEpoch;
  driven.remarks = devices->remarks();
  for (Acquired item; source.next(&item);) {
    driven.items.push_back(item);
    if (const AcquiredFrame* frame = test::frame_of(item)) source.release(*frame);
  }
  source.join();
  if (keep != nullptr) *keep = std::move(devices);
  return driven;
}

class SimulatedIns : public ::testing::TestWithParam<const char*> {};

TEST_P(SimulatedIns, readingsStandWhereTheVehicleWasAtTheirStamps) {
  std::unique_ptr<DriveDevices> devices;
  const Driven driven = drive(brief_drive(GetParam()), {}, 24, &devices);
  const GeographicLib::LocalCartesian plane(mock::kWorldOrigin.latitude_deg,
                                            mock::kWorldOrigin.longitude_deg,
                                            mock::kWorldOrigin.height_m);
  std::size_t readings = 0;
  for (const Acquired& item : driven.items) {
    const AcquiredReading* reading = test::reading_of(item);
    if (reading == nullptr) continue;
    ++readings;
    const Duration time = stamp_of(item) - driven.start;
    // 15 s after the line was opened; the fast part of this drive comes after that.
    if (time < Duration::seconds(10) || time > Duration::seconds(24)) continue;
    const auto truth = devices->mock()->truth().ins_in_enu(time);
    const auto body = devices->mock()->truth().drive().at(time);
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

TEST_P(SimulatedIns, aLineThatIsUnpluggedComesBack) {
  const Driven driven = drive(brief_drive(GetParam()), {"ins_gone@3 duration_s=3"}, 12);
  int away = 0, after = 0, images = 0;
  for (const Acquired& item : driven.items) {
    const double time = (stamp_of(item) - driven.start).to_seconds();
    images += test::frame_of(item) != nullptr ? 1 : 0;
    const AcquiredReading* reading = test::reading_of(item);
    if (reading == nullptr) continue;
    away += time > 3.05 && time < 5.9 ? 1 : 0;
    after += time > 8 ? 1 : 0;
  }
  EXPECT_EQ(away, 0);
  EXPECT_GT(after, 350);
  EXPECT_EQ(images, 121) << "the cameras do not wait for it";
}

INSTANTIATE_TEST_SUITE_P(Lines, SimulatedIns, ::testing::Values("mti-g", "mti-g-710"),
                         [](const auto& one) {
                           return std::string(one.param) == "mti-g" ? "legacy" : "mark4";
                         });

TEST(SimulatedInsConfiguration, isRefusedWhereItCannotBe) {
  const auto refusal = [](const Configuration& c, bool fast) -> std::string {
    try {
      const DriveDevices devices(c, {}, fast, 1.0);
    } catch (const InputError& e) {
      return e.what();
    }
    return "nothing was refused";
  };
  EXPECT_NE(refusal(brief_drive("mti-g"), false).find("--fast"), std::string::npos);
  EXPECT_THROW((void)brief_drive("mti-h"), InputError) << "it is not read at all";
  EXPECT_NE(refusal(brief_drive("mti-g", {"ins.rate=110"}), true).find("ins.rate"),
            std::string::npos);
  EXPECT_NE(refusal(brief_drive("mti-g-710", {"ins.rate=400"}), true).find("ins.baud"),
            std::string::npos);
  EXPECT_EQ(refusal(brief_drive("mti-g-710", {"ins.rate=400", "ins.baud=460800"}), true),
            "nothing was refused");
}

}  // namespace
}  // namespace vergence::app
