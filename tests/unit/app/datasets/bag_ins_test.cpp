#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/ranges.h>

#include "app/datasets/stereo_sequence.hpp"
#include "core/comparison/geodesy.hpp"
#include "core/math/so3.hpp"
#include "tests/support/bag_in_memory.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/ros_messages.hpp"

namespace vergence::app {
namespace {

using test::BagKind;
using test::mentions;

/// Times in ns.
constexpr std::int64_t kStart = 1'700'000'000'000'000'000, kMs = 1'000'000;
/// Channels of the two images.
constexpr std::array<std::uint16_t, 2> kSides{1, 2};
const Geodetic kOrigin{-27.5, 153.0, 40};

std::array<double, 4> coefficients(const Mat3& R) {
  const Eigen::Quaterniond q(R);
  return {q.x(), q.y(), q.z(), q.w()};
}
Mat3 rotation_of(const InsSample& s) {
  return Eigen::Quaterniond(s.q_enu_ins.data()).toRotationMatrix();
}
Mat3 yaw(double angle) { return exp_so3(Vec3(0, 0, angle)); }

/// A circle of 100 m in the axes at the origin, once in 40 s, heading along it.
Vec3 place(double t) {
  const double a = 2 * std::numbers::pi * t / 40;
  return {100 * std::sin(a), 100 - 100 * std::cos(a), 0.1 * t};
}
Mat3 attitude(double t) {
  return yaw(2 * std::numbers::pi * t / 40) * exp_so3(Vec3(0, 0.03, 0)) *
         exp_so3(Vec3(-0.02, 0, 0));
}

class BagIns : public ::testing::TestWithParam<BagKind> {
 protected:
  BagIns() : writer_(GetParam().writer()) {
    writer_->channel(1, "/left/image", "sensor_msgs/Image");
    writer_->channel(2, "/right/image", "sensor_msgs/Image");
    for (const std::uint16_t k : kSides)
      writer_->message(k, kStart,
                       image_message(wire(), kStart, {8, 8, 8, "mono8", std::string(64, 'x')}));
    writer_->channel(3, "/fix", "sensor_msgs/NavSatFix");
    writer_->channel(4, "/imu/data", "sensor_msgs/Imu");
  }
  [[nodiscard]] static test::Wire wire() { return GetParam().wire(); }
  void fix(double t, std::int8_t status = 0, std::uint16_t channel = 3) {
    const Geodetic g = plane_.to_geodetic(place(t));
    write(channel, t, [&](std::int64_t ns) {
      return fix_message(wire(), ns, {status, g.latitude_deg, g.longitude_deg, g.height_m, 0.25});
    });
  }
  void imu(double t, std::uint16_t channel = 4) {
    write(channel, t, [&](std::int64_t ns) {
      return imu_message(wire(), ns, coefficients(attitude(t)), 1e-4);
    });
  }
  template <typename Make>
  void write(std::uint16_t channel, double t, const Make& make) {
    const std::int64_t ns = kStart + static_cast<std::int64_t>(std::llround(t * 1e9));
    writer_->message(channel, ns, make(ns));
  }
  [[nodiscard]] RecordedIns open(const BagTopics& topics = {}) {
    writer_->finish();
    return *test::bag_in_memory(GetParam().is_mcap(), writer_->bytes(), true, topics).ins;
  }
  [[nodiscard]] static std::string all(const RecordedIns& ins) {
    return fmt::format("{}", fmt::join(ins.remarks, "\n"));
  }
  [[nodiscard]] Vec3 error(const InsSample& s) const {
    return plane_.to_enu(s.position) - place((s.stamp - Stamp(kStart)).to_seconds());
  }

  const LocalTangentPlane plane_{kOrigin};
  std::unique_ptr<test::BagWriter> writer_;
};

TEST_P(BagIns, interpolatesOrientationAtFix) {
  for (int i = 0; i <= 200; ++i) imu(0.01 * i + 0.004);
  for (int i = 0; i < 4; ++i) fix(0.5 * i + 0.05, static_cast<std::int8_t>(i == 2 ? -1 : 0));
  const RecordedIns ins = open();
  ASSERT_EQ(ins.readings.size(), 4U);
  EXPECT_FALSE(ins.T_ins_left);
  for (std::size_t i = 0; i < 4; ++i) {
    const InsSample& s = ins.readings[i].sample;
    const double t = 0.5 * static_cast<double>(i) + 0.05;
    EXPECT_EQ(s.stamp.ns(), kStart + static_cast<std::int64_t>(i) * 500 * kMs + 50 * kMs);
    EXPECT_LT(error(s).norm(), 1e-6) << "degrees of 64 bits are 1e-9 m";
    ASSERT_TRUE(s.attitude_valid);
    // Between orientations 10 ms apart slerp is exact to their change of the axis: far below this.
    EXPECT_LT((rotation_of(s) - attitude(t)).norm(), 1e-6) << t;
    EXPECT_EQ(s.fix, i == 2 ? FixStatus::none : FixStatus::fix_3d);
    EXPECT_DOUBLE_EQ(s.position_sigma, 0.5);
    EXPECT_DOUBLE_EQ(s.height_sigma, 1.0);
    EXPECT_DOUBLE_EQ(s.heading_sigma, 0.01);
  }
  EXPECT_TRUE(mentions(all(ins), "the INS is /fix with the orientation of /imu/data"));
  EXPECT_TRUE(mentions(all(ins), "/fix: 1 of 4 samples have no fix"));
}

TEST_P(BagIns, fixWithoutOrientationHasNoAttitude) {
  for (const double t : {0.0, 0.01, 1.0, 1.01}) imu(t);
  for (const double t : {0.005, 0.5, 1.005, 2.0}) fix(t);
  const RecordedIns ins = open();
  ASSERT_EQ(ins.readings.size(), 4U);
  EXPECT_TRUE(ins.readings[0].sample.attitude_valid);
  EXPECT_FALSE(ins.readings[1].sample.attitude_valid);
  EXPECT_TRUE(ins.readings[2].sample.attitude_valid);
  EXPECT_FALSE(ins.readings[3].sample.attitude_valid);
  EXPECT_TRUE(mentions(all(ins), "2 fixes have no orientation of /imu/data within 100 ms"));
}

TEST_P(BagIns, listsTopicsAndUsesNamedOne) {
  writer_->channel(6, "/gps/fix", "sensor_msgs/NavSatFix");
  for (const double t : {0.0, 0.01}) imu(t);
  fix(0.004);
  fix(0.006, 0, 6);
  RecordedIns ins = open();
  EXPECT_TRUE(ins.readings.empty());
  EXPECT_TRUE(mentions(all(ins),
                       "choose with --ins-topic and --imu-topic; NavSatFix topics: /fix, /gps/fix; "
                       "Imu topics with an orientation: /imu/data"));
  ins = open({"", "", "/gps/fix", ""});
  ASSERT_EQ(ins.readings.size(), 1U);
  EXPECT_EQ(ins.readings[0].sample.stamp.ns(), kStart + 6 * kMs);
}

TEST_P(BagIns, refusesUnknownTopic) {
  fix(0);
  imu(0);
  for (const BagTopics& topics :
       {BagTopics{"", "", "/odom", ""}, BagTopics{"", "", "/imu/data", ""},
        BagTopics{"", "", "", "/fix"}}) {
    EXPECT_TRUE(
        mentions(test::refusal_of([&] { (void)open(topics); }), "-topic; NavSatFix topics: /fix"));
  }
}

TEST_P(BagIns, skipsInvalidNumbersAndBackwardStamps) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const double t : {0.0, 0.01, 0.02}) imu(t);
  write(4, 0.03, [&](std::int64_t ns) { return imu_message(wire(), ns, {0, 0, 0, 0}, 1e-4); });
  for (const double t : {0.001, 0.012, 0.002, 0.015}) fix(t);
  write(3, 0.016, [&](std::int64_t ns) { return fix_message(wire(), ns, {0, 200, 10, 0, 0}); });
  write(3, 0.017, [&](std::int64_t ns) { return fix_message(wire(), ns, {0, 10, 20, kNan, 0}); });
  writer_->message(3, 0, fix_message(wire(), kStart, {}).substr(0, 40));
  const RecordedIns ins = open();
  ASSERT_EQ(ins.readings.size(), 4U);
  EXPECT_EQ(ins.readings[3].sample.fix, FixStatus::fix_2d) << "no height";
  EXPECT_EQ(ins.readings[3].sample.position.height_m, 0);
  EXPECT_TRUE(mentions(
      all(ins), "/imu/data: skipped are 1 messages without usable numbers and 0 whose stamps"));
  EXPECT_TRUE(
      mentions(all(ins), "/fix: skipped are 2 messages without usable numbers and 1 whose stamps"));
}

INSTANTIATE_TEST_SUITE_P(Containers, BagIns,
                         ::testing::Values(BagKind{"mcap", "zstd"}, BagKind{"rosbag", "lz4"}));

}  // namespace
}  // namespace vergence::app
