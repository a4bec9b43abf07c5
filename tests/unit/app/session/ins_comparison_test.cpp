#include "app/session/ins_comparison.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "app/session/recorder.hpp"
#include "core/comparison/geodesy.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

constexpr int kRestarts = 70;
/// Path between two restarts in m.
constexpr double kBetween = 200;
/// Eastward speed in m/s.
constexpr double kSpeed = 10;

Stamp at(double t) { return Stamp(1403636584000000000) + Duration::seconds(t); }

InsRecord reading(const LocalTangentPlane& plane, double t, const Vec3& place) {
  const Geodetic position = plane.to_geodetic(place);
  const Eigen::Quaterniond q = quaternion(plane.rotation_from(position).transpose());
  return {.sample = {.stamp = at(t),
                     .fix = FixStatus::fix_3d,
                     .attitude_valid = true,
                     .position = position,
                     .q_enu_ins = {q.x(), q.y(), q.z(), q.w()},
                     .position_sigma = 0.001,
                     .height_sigma = 0.001,
                     .tilt_sigma = 1e-5}};
}

/// A comparison as a session has it: with a recorder and a log of events.
struct ComparedSession {
  ComparedSession() {
    log->open(&output, at(0));
    comparison.open(&output);
  }
  const test::TemporaryFolder folder;
  Recorder recorder{folder.path(), {.ins = true}};
  const std::array<SessionObserver*, 1> observers{&recorder};
  SessionOutput output{observers};
  const std::unique_ptr<EventLog> log = std::make_unique<EventLog>();
  const ComparisonOptions options{};
  Arena arena;
  InsComparison comparison{options, InsSource::device, arena, *log};
};

std::uint64_t counter(const InsComparison& comparison, const std::string& name) {
  for (const auto& [key, count] : comparison.counters())
    if (key == name) return count;
  ADD_FAILURE() << name;
  return 0;
}

/// A drive whose scene is begun anew after every tunnel: each time it is placed on the earth anew.
TEST(InsComparison, keepsAlignmentsOfManyTunnels) {
  ComparedSession session;
  InsComparison& comparison = session.comparison;
  const LocalTangentPlane plane(Geodetic{48, 11, 500});
  // Poses of one map at 10 Hz.
  constexpr int kPoses = static_cast<int>(kBetween / kSpeed * 10);
  for (int i = 0; i < kPoses * (kRestarts + 1); ++i) {
    const double t = i / 10.0;
    FrameReport report;
    PoseSample& pose = report.pose;
    pose.stamp = at(t + 0.003);
    pose.status = PoseStatus::ok;
    if (i > 0 && i % kPoses == 0) pose.reason = Reason::map_reset;
    pose.T_world_left.t = {kSpeed * (t + 0.003), 0, 0};
    comparison.add(report);
    for (int k = 0; k < 10; ++k) {
      const double now = t + k / 100.0;
      comparison.add(reading(plane, now, {kSpeed * now, 0, 0}));
    }
    comparison.drain();
  }
  comparison.finish();
  const std::size_t alignments = comparison.enu_json("the test").at("alignments").size();
  EXPECT_EQ(alignments, static_cast<std::size_t>(kRestarts + 1));
  EXPECT_EQ(counter(comparison, "alignments"), alignments);
  (void)session.recorder.close();
}

}  // namespace
}  // namespace vergence::app
