#include "app/ros2/bridge.hpp"

#include <gtest/gtest.h>

#include <map>

#include <fmt/ranges.h>

#include "app/datasets/detail/ros_reader.hpp"
#include "app/runtime/errors.hpp"
#include "core/comparison/comparison.hpp"
#include "core/math/so3.hpp"
#include "tests/support/mutated.hpp"

namespace vergence::app::ros2 {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Keeps the messages of every topic.
class Kept final : public TopicWriter {
 public:
  void advertise(const std::string& topic, RosType /*type*/, bool keeps) override {
    messages[topic];
    if (keeps) latched.push_back(topic);
  }
  void publish(const std::string& topic, std::span<const std::uint8_t> cdr) override {
    messages.at(topic).emplace_back(cdr.begin(), cdr.end());
  }

  std::map<std::string, std::vector<std::vector<std::uint8_t>>> messages;
  std::vector<std::string> latched;
};

/// Reads a message after its encapsulation and stamp.
class Reader : public detail::RosReader {
 public:
  explicit Reader(const std::vector<std::uint8_t>& message)
      : RosReader(message, detail::MessageEncoding::cdr) {
    (void)get<std::int64_t>();
  }
  Vec3 vector() { return Vec3(doubles<3>().data()); }
  Transform pose() {
    const Vec3 t = vector();
    return {Eigen::Quaterniond(doubles<4>().data()).toRotationMatrix(), t};
  }
  Matrix6 covariance() { return Matrix6(doubles<36>().data()).transpose(); }
};

struct Odometry {
  std::string frame, child;
  Transform pose;
  Matrix6 pose_covariance;
  Vec3 linear, angular;
  Matrix6 twist_covariance;
};

Odometry odometry(const std::vector<std::uint8_t>& message) {
  Reader in(message);
  return {in.text(),   in.text(),   in.pose(),      in.covariance(),
          in.vector(), in.vector(), in.covariance()};
}

/// Upper triangle, row by row.
std::string upper(const Matrix6& m) {
  std::vector<double> numbers;
  for (int i = 0; i < 6; ++i)
    for (int k = i; k < 6; ++k) numbers.push_back(m(i, k));
  return fmt::format("[{:.17g}]", fmt::join(numbers, ","));
}

struct Pose {
  std::int64_t stamp_ns = 0;
  Transform T_world_left{};
  std::string status = "ok", reason{};
  Matrix6 covariance = Matrix6::Identity(), motion = Matrix6::Identity();
  double length_sigma = 0;
};

std::string line_of(const Pose& p) {
  const Eigen::Quaterniond q = quaternion(p.T_world_left.R);
  const Vec3& t = p.T_world_left.t;
  const std::string pose =
      p.status == "lost"
          ? "null"
          : fmt::format(
                R"({{"position_m":[{:.17g},{:.17g},{:.17g}],"orientation_xyzw":[{:.17g},{:.17g},{:.17g},{:.17g}]}})",
                t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  return fmt::format(
      R"({{"version":2,"type":"pose","stamp_ns":{},"status":"{}","reason":"{}","pose":{},"covariance":{},)"
      R"("motion_covariance":{},"length_sigma":{},"dropped":0}})",
      p.stamp_ns, p.status, p.reason, pose, upper(p.covariance), upper(p.motion), p.length_sigma);
}

std::string calibration_line(const std::string& left, const std::string& right) {
  const auto camera = [](const std::string& name, double x) {
    return fmt::format(
        R"({{"name":"{}","size":[640,480],"model":"pinhole-radtan","intrinsics":[450,451,322,239],)"
        R"("distortion":[0,0,0,0,0],"T_camera_left":[1,0,0,{},0,1,0,0,0,0,1,0]}})",
        name, x);
  };
  return fmt::format(
      R"({{"version":2,"type":"calibration","stamp_ns":7,"rating":"good","cameras":[{},{}]}})",
      camera(left, 0), camera(right, -0.75));
}

constexpr const char* kAlignment =
    R"({"version":2,"type":"alignment","stamp_ns":7,"origin":{"latitude_deg":-27.5,"longitude_deg":153,"height_m":60},)"
    R"("T_enu_world":[1,0,0,10,0,0,1,20,0,-1,0,30],"position_sigma_m":[1,2,3],"rotation_sigma_rad":[0.01,0.01,0.02]})";
constexpr const char* kStatus =
    R"({"version":2,"type":"status","session":"monday","stamp_ns":8,"state":"stereo_odometry","status":"ok",)"
    R"("reason":"","silent_s":0.01,"frames":{"read":3},"pairing":"assumed","cameras":[true,true],)"
    R"("calibrated":true,"verified":true,"ins":{"fix":"3d","silent_s":0.1,"aligned":true}})";

BridgeOptions on_vehicle() {
  BridgeOptions o{.T_base_left = mount_of({1.5, -0.2, 0.8}, {0.02, 0.1, -0.3})};
  return o;
}

/// A bridge whose messages are kept.
struct Bridged {
  explicit Bridged(const BridgeOptions& options = {}) : bridge(options, &kept) {}
  /// Adds a pose, and returns the odometry that the bridge then published last.
  Odometry add(const Pose& pose) {
    bridge.add(line_of(pose));
    return odometry(kept.messages["/vergence/odometry"].back());
  }
  Kept kept{};
  Bridge bridge;
};

/// Frame interval in ns.
constexpr std::int64_t kStep = 50'000'000;

/// A vehicle that drives an arc at a constant speed, whose camera sits off its origin: the speed
/// and the pose of the vehicle come out, not those of the camera.
TEST(Bridge, odometryIsOfTheBaseFrame) {
  const BridgeOptions options = on_vehicle();
  Bridged b(options);
  const Vec3 v(2, 0, 0), w(0, 0, 0.2);
  Transform T_odom_base;
  const Transform step{exp_so3(w * 0.05),
                       Vec3(std::sin(0.01), 1 - std::cos(0.01), 0) * (v.x() / w.z())};
  for (int i = 0; i < 40; ++i, T_odom_base = T_odom_base * step)
    b.bridge.add(line_of({1'000'000'000 + i * kStep,
                          options.T_base_left.inverse() * T_odom_base * options.T_base_left}));
  const auto& messages = b.kept.messages["/vergence/odometry"];
  ASSERT_EQ(messages.size(), 40U);
  T_odom_base = {};
  for (std::size_t i = 0; i < messages.size(); ++i, T_odom_base = T_odom_base * step) {
    const Odometry o = odometry(messages[i]);
    EXPECT_EQ(o.frame, "odom");
    EXPECT_EQ(o.child, "base_link");
    EXPECT_LT((o.pose.t - T_odom_base.t).norm(), 1e-9);
    EXPECT_LT((o.pose.R - T_odom_base.R).norm(), 1e-9);
    if (i == 0) {
      EXPECT_EQ(o.twist_covariance(0, 0), 1e6) << "of one pose there is no speed";
      continue;
    }
    // The chord of 0.01 rad is shorter than its arc by the square of that over 24.
    EXPECT_LT((o.linear - v).norm(), 2 * 5e-6);
    EXPECT_LT((o.angular - w).norm(), 1e-9);
  }
  EXPECT_EQ(b.kept.messages["/tf"].size(), 40U);
}

/// Against differences of the pose itself.
TEST(Bridge, poseCovarianceIsOfTheBaseFrame) {
  const BridgeOptions options = on_vehicle();
  Pose pose{0, {exp_so3({0.3, -0.8, 0.1}), {5, -1, 20}}};
  Matrix6 root = Matrix6::Zero();
  Random random(5);
  for (int i = 0; i < 36; ++i) root(i / 6, i % 6) = random.uniform() - 0.5;
  pose.covariance = root * root.transpose();
  Bridged b(options);
  const Odometry o = b.add(pose);
  const auto child_of = [&](const Transform& T) {
    return options.T_base_left * T * options.T_base_left.inverse();
  };
  const Transform child = child_of(pose.T_world_left);
  Matrix6 J;
  constexpr double kDelta = 1e-6;
  for (int i = 0; i < 6; ++i) {
    Vec3 tau = Vec3::Zero(), phi = Vec3::Zero();
    (i < 3 ? tau : phi)(i % 3) = kDelta;
    const Transform moved = child_of(perturbed(pose.T_world_left, phi, tau));
    J.block<3, 1>(0, i) = (moved.t - child.t) / kDelta;
    J.block<3, 1>(3, i) = log_so3(moved.R * child.R.transpose()) / kDelta;
  }
  const Matrix6 wanted = J * pose.covariance * J.transpose();
  EXPECT_LT((o.pose_covariance - wanted).norm(), 1e-4 * wanted.norm());
}

TEST(Bridge, twistCovarianceAddsScaleUncertainty) {
  // The camera is at the vehicle's origin.
  Bridged b({.T_base_left = mount_of(Vec3::Zero(), Vec3::Zero())});
  Pose pose;
  // The axes are right, down and forward.
  pose.motion = Vec3(1, 2, 3).replicate<2, 1>().asDiagonal();
  pose.length_sigma = 0.1;
  (void)b.add(pose);
  pose.stamp_ns = kStep;
  // The speed is 10 m/s forward.
  pose.T_world_left.t.z() = 0.5;
  const Odometry o = b.add(pose);
  const double per_s2 = 1 / (0.05 * 0.05);
  const Matrix6 wanted = (Eigen::Vector<double, 6>() << 3 * per_s2 + 1, per_s2, 2 * per_s2,
                          3 * per_s2, per_s2, 2 * per_s2)
                             .finished()
                             .asDiagonal();
  EXPECT_LT((o.twist_covariance - wanted).norm(), 1e-9 * wanted.norm());
}

TEST(Bridge, degradedIsWidenedLostIsNotPublished) {
  struct Case {
    const char *status, *reason;
    /// 0 if no message is expected.
    double variance;
  };
  for (const Case& c : {Case{"ok", "", 1}, Case{"degraded", "weak_geometry", 4},
                        Case{"degraded", "uncalibrated", 9}, Case{"degraded", "time_gap", 100},
                        Case{"lost", "no_pose", 0}}) {
    SCOPED_TRACE(c.reason);
    Bridged b;
    Pose pose{.status = c.status, .reason = c.reason};
    b.bridge.add(line_of(pose));
    const auto& messages = b.kept.messages["/vergence/odometry"];
    EXPECT_EQ(b.kept.messages["/tf"].size(), messages.size());
    ASSERT_EQ(messages.size(), c.variance > 0 ? 1U : 0U);
    if (!messages.empty()) {
      EXPECT_DOUBLE_EQ(odometry(messages[0]).pose_covariance(5, 5), c.variance);
    }
  }
}

/// The bridge's list names reasons as the stream has them: a renamed one would be widened less.
TEST(Bridge, listedReasonsExist) {
  // Number of reasons by the variance that they make of 1.
  std::map<double, int> reasons;
  for (int i = 1; i <= static_cast<int>(Reason::pairing_ambiguous); ++i) {
    Bridged b;
    Pose pose{.status = "degraded", .reason = std::string(to_string(static_cast<Reason>(i)))};
    ++reasons[b.add(pose).pose_covariance(5, 5)];
  }
  EXPECT_EQ(reasons[100], 3);
  EXPECT_EQ(reasons[9], 7);
}

TEST(Bridge, speedIsUnknownAfterAGap) {
  Bridged b;
  Pose pose;
  const auto measured = [&](std::int64_t after_ns) {
    pose.stamp_ns += after_ns;
    return b.add(pose).twist_covariance(0, 0) < 1e6;
  };
  EXPECT_FALSE(measured(0));
  EXPECT_TRUE(measured(kStep));
  EXPECT_FALSE(measured(0)) << "the same stamp again";
  EXPECT_FALSE(measured(2'000'000'000));
  EXPECT_TRUE(measured(kStep));
  Pose lost;
  lost.status = "lost";
  b.bridge.add(line_of(lost));
  EXPECT_FALSE(measured(kStep));
  b.bridge.disconnected();
  EXPECT_FALSE(measured(kStep));
}

TEST(Bridge, childCameraIsOpticalFrame) {
  Bridged b({.camera_child = true});
  b.bridge.add(calibration_line("front left", "right"));
  Pose pose;
  // The axes are right, down and forward.
  pose.T_world_left.t = {1, 2, 3};
  const Odometry o = b.add(pose);
  EXPECT_EQ(o.child, "front_left_optical_frame");
  EXPECT_LT((o.pose.t - Vec3(3, -1, -2)).norm(), 1e-12) << "forward, left, up of odom";
  EXPECT_LT((o.pose.R.col(2) - Vec3::UnitX()).norm(), 1e-12) << "z is the camera's view";
}

TEST(Bridge, latchesCalibrationUnderRosNames) {
  BridgeOptions options = on_vehicle();
  Bridged b(options);
  b.bridge.add(calibration_line("1-st", "1 st"));
  // The greeting repeats the calibration.
  b.bridge.add(calibration_line("1-st", "1 st"));
  for (const char* topic :
       {"/tf_static", "/vergence/_1_st/camera_info", "/vergence/_1_st_1/camera_info"}) {
    EXPECT_EQ(b.kept.messages[topic].size(), 1U) << topic;
    EXPECT_EQ(std::count(b.kept.latched.begin(), b.kept.latched.end(), topic), 1) << topic;
  }
  Reader in(b.kept.messages["/vergence/_1_st_1/camera_info"].at(0));
  EXPECT_EQ(in.text(), "_1_st_1_optical_frame");
  b.bridge.add(calibration_line("left", "right"));
  EXPECT_EQ(b.kept.messages["/tf_static"].size(), 2U) << "another one";
}

TEST(Bridge, imageComesWithCameraInfoOfItsStamp) {
  constexpr const char* kImage =
      R"({"version":2,"type":"image","frame":4,"stamp_ns":5000000009,"camera":1,"name":"right","width":3,"height":2,"bytes":6})";
  Bridged b({.images = true});
  EXPECT_EQ(b.bridge.begin_image(kImage), 6U);
  // No calibration was received yet.
  b.bridge.end_image("abcdef");
  b.bridge.add(calibration_line("left", "right"));
  auto& images = b.kept.messages["/vergence/right/image_raw"];
  const auto& info = b.kept.messages["/vergence/right/camera_info"];
  EXPECT_TRUE(images.empty());
  EXPECT_EQ(b.bridge.begin_image(kImage), 6U);
  b.bridge.end_image("abcdef");
  ASSERT_EQ(images.size(), 1U);
  ASSERT_EQ(info.size(), 2U);
  // Encapsulation and stamp.
  EXPECT_TRUE(std::equal(images[0].begin(), images[0].begin() + 12, info[1].begin()));
  EXPECT_EQ(std::string(images[0].end() - 6, images[0].end()), "abcdef");
  EXPECT_EQ(b.bridge.malformed(), 0U);
  (void)b.bridge.begin_image(kImage);
  b.bridge.end_image("abcdefg");
  EXPECT_EQ(images.size(), 1U);
  EXPECT_EQ(b.bridge.malformed(), 1U) << "another size than the line's";
  EXPECT_EQ(b.bridge.begin_image(kStatus), 0U);
}

TEST(Bridge, publishesEnuPoseOnceAligned) {
  Bridged b({.T_base_left = mount_of(Vec3::Zero(), Vec3::Zero())});
  Pose pose;
  // The y axis of ENU is the world's z axis.
  pose.T_world_left.t = {0, 0, 100};
  pose.covariance.setZero();
  b.bridge.add(line_of(pose));
  EXPECT_TRUE(b.kept.messages["/vergence/fix"].empty());
  b.bridge.add(kAlignment);
  b.bridge.add(line_of(pose));
  Reader in(b.kept.messages["/vergence/pose_enu"].at(0));
  EXPECT_EQ(in.text(), "enu");
  EXPECT_LT((in.pose().t - Vec3(10, 120, 30)).norm(), 1e-9);
  const Matrix6 P = in.covariance();
  // Variances of the position, and of the heading and the tilt 100 m away.
  EXPECT_NEAR(P(0, 0), 1 + 4, 1e-9);
  EXPECT_NEAR(P(1, 1), 4, 1e-9);
  EXPECT_NEAR(P(2, 2), 9 + 1, 1e-9);
  EXPECT_NEAR(P(5, 5), 4e-4, 1e-12);
  Reader place(b.kept.messages["/vergence/fix"].at(0));
  (void)place.text();
  (void)place.get<std::int8_t>();
  (void)place.get<std::uint16_t>();
  // 120 m north by a degree of 110.8 km there.
  EXPECT_NEAR(place.get<double>(), -27.5 + 120 / 110'800.0, 1e-6);
}

TEST(Bridge, malformedLinesAreOnlyCounted) {
  Bridged b;
  Random random(1);
  std::uint64_t refused = 0;
  const std::vector<std::string> lines{line_of({}), calibration_line("left", "right"), kAlignment,
                                       kStatus};
  for (int i = 0; i < 4000; ++i) {
    const std::string& line = lines[static_cast<std::size_t>(i) % lines.size()];
    const auto bytes = test::mutated({line.begin(), line.end()}, &random);
    try {
      b.bridge.add({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    } catch (const InputError&) {
      // The mutated line has another version.
      ++refused;
    }
  }
  EXPECT_GT(b.bridge.malformed(), 2000U);
  EXPECT_LT(refused, 500U);
  const std::size_t before = b.kept.messages["/vergence/odometry"].size();
  b.bridge.add(line_of({}));
  EXPECT_EQ(b.kept.messages["/vergence/odometry"].size(), before + 1);
}

TEST(Bridge, diagnosticLevelsFollowStatus) {
  struct Case {
    const char *find, *replace;
    /// Levels of odometry, calibration, cameras and INS.
    std::string levels;
  };
  for (const Case& c :
       {Case{"ok", "ok", "0000"}, Case{R"("status":"ok")", R"("status":"degraded")", "1000"},
        Case{R"("status":"ok")", R"("status":"lost")", "2000"},
        Case{R"("silent_s":0.01)", R"("silent_s":1.5)", "3000"},
        Case{R"("verified":true)", R"("verified":false)", "0100"},
        Case{"[true,true]", "[true,false]", "0020"}, Case{"assumed", "contradicted", "0010"},
        Case{R"("fix":"3d")", R"("fix":"none")", "0001"},
        Case{R"("silent_s":0.1)", R"("silent_s":9.5)", "0002"}}) {
    SCOPED_TRACE(c.replace);
    Bridged b;
    b.bridge.add(calibration_line("left", "right"));
    std::string line = kStatus;
    const std::size_t at = line.find(c.find);
    ASSERT_NE(at, std::string::npos);
    b.bridge.add(line.replace(at, std::string(c.find).size(), c.replace));
    EXPECT_EQ(b.bridge.malformed(), 0U);
    Reader in(b.kept.messages["/diagnostics"].at(0));
    (void)in.text();
    ASSERT_EQ(in.get<std::uint32_t>(), 5U);
    std::string levels;
    for (int i = 0; i < 4; ++i) {
      levels += std::to_string(in.get<std::uint8_t>());
      for (int k = 0; k < 3; ++k) (void)in.text();
      for (std::uint32_t n = 2 * in.get<std::uint32_t>(); n > 0; --n) (void)in.text();
    }
    EXPECT_EQ(levels, c.levels);
  }
}

}  // namespace
}  // namespace vergence::app::ros2
