#include "app/publish/line_publisher.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/math/so3.hpp"
#include "core/memory/allocation_guard.hpp"

namespace vergence::app {
namespace {

PoseSample sample() {
  PoseSample s;
  s.frame = 12;
  s.stamp = Stamp(1'577'836'800'500'000'001);
  s.state = State::stereo_odometry;
  s.status = PoseStatus::degraded;
  s.reason = Reason::few_inliers;
  s.T_world_left = {exp_so3({0.1, -0.2, 0.3}), {1.25, -2.5, 3.125}};
  s.covariance[0] = 0.25F;
  s.covariance[20] = 1e-6F;
  s.motion_covariance[6] = 0.0004F;
  s.length_sigma = 0.0125F;
  s.inliers = 44;
  s.stereo_inliers = 33;
  s.reprojection_px = 0.25;
  s.estimate_ms = 7.5F;
  return s;
}

nlohmann::json line_of(const PoseSample& pose, const std::optional<EarthPose>& earth,
                       std::optional<double> age) {
  std::string line = "what was there before";
  write_pose_line(pose, earth, age, 7, &line);
  EXPECT_EQ(line.back(), '\n');
  EXPECT_EQ(line.find('\n'), line.size() - 1) << "one line";
  return nlohmann::json::parse(line);
}

TEST(PoseLine, hasWhatTheSchemaSays) {
  EarthPose earth;
  earth.T_enu_left.t = {1, 2, 3};
  earth.position = {-27.4975, 153.0137, 60};
  earth.yaw = (90 - 358.25) * std::numbers::pi / 180;
  const auto j = line_of(sample(), earth, 21.5);
  EXPECT_EQ(j["version"], 1);
  EXPECT_EQ(j["frame"], 12);
  EXPECT_EQ(j["stamp_ns"], 1'577'836'800'500'000'001);
  EXPECT_EQ(j["state"], "stereo_odometry");
  EXPECT_EQ(j["status"], "degraded");
  EXPECT_EQ(j["reason"], "few_inliers");
  EXPECT_EQ(j["pose"]["position_m"], (std::vector<double>{1.25, -2.5, 3.125}));
  const Eigen::Quaterniond q = quaternion(sample().T_world_left.R);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(j["pose"]["orientation_xyzw"][i].get<double>(),
                q.coeffs()[static_cast<Eigen::Index>(i)], 1e-9);
  ASSERT_EQ(j["covariance"].size(), 21U);
  EXPECT_DOUBLE_EQ(j["covariance"][0], 0.25);
  EXPECT_DOUBLE_EQ(j["covariance"][20], 1e-6);  // four digits are written
  ASSERT_EQ(j["motion_covariance"].size(), 21U);
  EXPECT_DOUBLE_EQ(j["motion_covariance"][6], 0.0004);
  EXPECT_DOUBLE_EQ(j["length_sigma"], 0.0125);
  EXPECT_EQ(j["earth"]["enu_m"], (std::vector<double>{1, 2, 3}));
  EXPECT_EQ(j["earth"]["latitude_deg"], -27.4975);
  EXPECT_EQ(j["earth"]["heading_deg"], 358.25);
  EXPECT_EQ(j["inliers"], 44);
  EXPECT_EQ(j["stereo_inliers"], 33);
  EXPECT_EQ(j["reprojection_px"], 0.25);
  EXPECT_EQ(j["estimate_ms"], 7.5);
  EXPECT_EQ(j["age_ms"], 21.5);
  EXPECT_EQ(j["dropped"], 7);
  EXPECT_EQ(j.size(), 17U) << "a key that docs/publish.md does not have";
}

TEST(PoseLine, ofALostFrameHasNoPlace) {
  PoseSample lost = sample();
  lost.status = PoseStatus::lost;
  const auto j = line_of(lost, EarthPose{}, std::nullopt);
  EXPECT_TRUE(j["pose"].is_null());
  EXPECT_TRUE(j["covariance"].is_null());
  EXPECT_TRUE(j["earth"].is_null());
  EXPECT_TRUE(j["age_ms"].is_null());
}

TEST(PoseLine, staysJsonWithNumbersThatAreNone) {
  PoseSample pose = sample();
  pose.T_world_left.t[1] = std::numeric_limits<double>::infinity();
  pose.motion_covariance[3] = std::numeric_limits<float>::infinity();
  pose.reprojection_px = std::numeric_limits<double>::quiet_NaN();
  const auto j = line_of(pose, std::nullopt, 1e300);
  EXPECT_TRUE(j["pose"].is_null());
  EXPECT_TRUE(j["motion_covariance"].is_null());
  EXPECT_TRUE(j["reprojection_px"].is_null());
}

/// Keeps what it is sent; holds the publisher's thread while it is shut.
class Kept final : public LineSocket {
 public:
  explicit Kept(std::vector<std::string>* lines, std::atomic<bool>* open)
      : lines_(lines), open_(open) {}
  void send(std::string_view line) noexcept override {
    open_->wait(false);
    lines_->emplace_back(line);
  }
  [[nodiscard]] LineSocketCounters counters() const noexcept override { return {}; }

 private:
  std::vector<std::string>* lines_;
  std::atomic<bool>* open_;
};

PoseSample sample(std::uint64_t frame) {
  PoseSample s;
  s.frame = frame;
  s.stamp = Stamp(static_cast<std::int64_t>(frame) * 50'000'000);
  s.status = PoseStatus::ok;
  return s;
}

TEST(LinePublisher, aFullRingLosesTheNewestCountsThemAndNeverWaits) {
  std::vector<std::string> lines;
  std::atomic<bool> open{false};
  LinePublisher publisher(std::make_unique<Kept>(&lines, &open));
  publisher.on_start({});
  constexpr std::uint64_t kPoses = 1000;
  for (std::uint64_t i = 0; i < kPoses; ++i) publisher.on_pose(sample(i));  // the socket is shut
  open = true;
  open.notify_all();
  std::map<std::string, std::uint64_t> counters;
  for (const auto& [name, value] : publisher.counters()) counters[name] = value;
  EXPECT_EQ(counters["lines"] + counters["lines_dropped"], kPoses);
  EXPECT_EQ(counters["lines"], lines.size());
  EXPECT_GE(lines.size(), 64U) << "all that the ring held";
  EXPECT_LE(lines.size(), 65U) << "and the one in hand";
  EXPECT_EQ(counters.count("line_age_p99_us"), 0U) << "no clock to measure an age by";
  for (std::size_t i = 0; i < 64; ++i)
    EXPECT_EQ(nlohmann::json::parse(lines[i])["frame"], i) << "in order, the oldest";
  // The one in hand makes room when the publisher's thread comes to it: for whichever is next.
  if (lines.size() > 64) {
    EXPECT_GE(nlohmann::json::parse(lines[64])["frame"], 64U);
  }
}

TEST(LinePublisher, takesNoMemoryOnTheEstimatorsThreadAndBringsPosesToTheEarth) {
  std::vector<std::string> lines;
  std::atomic<bool> open{true};
  LinePublisher publisher(std::make_unique<Kept>(&lines, &open));
  publisher.on_start({});
  Placement placement;
  placement.T_enu_world.t = {1, 2, 3};
  AllocationGuard::seal_thread();
  const auto before = AllocationGuard::allocations_after_seal();
  publisher.on_placement(placement, {-27.4975, 153.0137, 60});
  publisher.on_pose(sample(0));
  const auto taken = AllocationGuard::allocations_after_seal() - before;
  AllocationGuard::unseal_thread();
  EXPECT_EQ(taken, 0U);
  (void)publisher.counters();
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(nlohmann::json::parse(lines[0])["earth"]["enu_m"], (std::vector<double>{1, 2, 3}));
}

}  // namespace
}  // namespace vergence::app
