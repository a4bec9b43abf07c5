#include "app/publish/line_publisher.hpp"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/eventfd.h>

#include <limits>
#include <map>
#include <numbers>
#include <thread>

#include <nlohmann/json.hpp>

#include "app/publish/pose_stream.hpp"
#include "core/math/so3.hpp"
#include "core/memory/allocation_guard.hpp"

namespace vergence::app {
namespace {

PoseSample sample() {
  PoseSample s{.frame = 12,
               .stamp = Stamp(1'577'836'800'500'000'001),
               .state = State::stereo_odometry,
               .status = PoseStatus::degraded,
               .reason = Reason::few_inliers,
               .T_world_left = {exp_so3({0.1, -0.2, 0.3}), {1.25, -2.5, 3.125}},
               .length_sigma = 0.0125F,
               .inliers = 44,
               .stereo_inliers = 33,
               .reprojection_px = 0.25,
               .estimate_ms = 7.5F};
  s.covariance[0] = 0.25F;
  s.covariance[20] = 1e-6F;
  s.motion_covariance[6] = 0.0004F;
  return s;
}

nlohmann::json line_of(const PoseSample& pose, const std::optional<EnuPose>& earth,
                       std::optional<double> age) {
  std::string line = "what was there before";
  write_pose_line(pose, earth, age, 7, &line);
  EXPECT_EQ(line.back(), '\n');
  EXPECT_EQ(line.find('\n'), line.size() - 1) << "one line";
  return nlohmann::json::parse(line);
}

TEST(PoseLine, hasEveryKeyOfTheSchema) {
  const EnuPose earth{{Mat3::Identity(), {1, 2, 3}},
                      {-27.4975, 153.0137, 60},
                      (90 - 358.25) * std::numbers::pi / 180};
  auto j = line_of(sample(), earth, 21.5);
  const Eigen::Quaterniond q = quaternion(sample().T_world_left.R);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(j["pose"]["orientation_xyzw"][i].get<double>(),
                q.coeffs()[static_cast<Eigen::Index>(i)], 1e-9);
  j["pose"].erase("orientation_xyzw");
  // docs/live_interface.md has these keys. Covariances are written with four digits.
  EXPECT_EQ(j, nlohmann::json::parse(R"({
      "version": 2, "type": "pose", "frame": 12, "stamp_ns": 1577836800500000001,
      "state": "stereo_odometry", "status": "degraded", "reason": "few_inliers",
      "pose": {"position_m": [1.25, -2.5, 3.125]},
      "covariance": [0.25, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1e-6],
      "motion_covariance": [0, 0, 0, 0, 0, 0, 0.0004, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
      "length_sigma": 0.0125,
      "enu": {"enu_m": [1, 2, 3], "latitude_deg": -27.4975, "longitude_deg": 153.0137, "height_m": 60, "heading_deg": 358.25},
      "inliers": 44, "stereo_inliers": 33, "reprojection_px": 0.25, "estimate_ms": 7.5,
      "age_ms": 21.5, "dropped": 7})"));
}

TEST(PoseLine, omitsPositionWhenLost) {
  PoseSample lost = sample();
  lost.status = PoseStatus::lost;
  const auto j = line_of(lost, EnuPose{}, std::nullopt);
  EXPECT_TRUE(j["pose"].is_null());
  EXPECT_TRUE(j["covariance"].is_null());
  EXPECT_TRUE(j["enu"].is_null());
  EXPECT_TRUE(j["age_ms"].is_null());
}

TEST(PoseLine, nonFiniteNumbersAreNull) {
  PoseSample pose = sample();
  pose.T_world_left.t[1] = std::numeric_limits<double>::infinity();
  pose.motion_covariance[3] = std::numeric_limits<float>::infinity();
  pose.reprojection_px = std::numeric_limits<double>::quiet_NaN();
  const auto j = line_of(pose, std::nullopt, 1e300);
  EXPECT_TRUE(j["pose"].is_null());
  EXPECT_TRUE(j["motion_covariance"].is_null());
  EXPECT_TRUE(j["reprojection_px"].is_null());
}

TEST(PoseStream, calibrationLineHoldsRig) {
  CalibrationRecord record;
  record.stamp = Stamp(5);
  record.calibration.cameras = 2;
  Intrinsics& lens = record.calibration.intrinsics[0];
  lens = {.width = 640, .height = 480, .fx = 450, .fy = 451, .cx = 322, .cy = 239};
  lens.kind = CameraModelKind::pinhole_equidistant;
  lens.distortion = {0.1, 0.2, 0.3, 0.4, 0};
  record.calibration.T_camera_left[1] = {exp_so3({0.01, -0.02, 0.03}), {-0.75, 0.01, -0.02}};
  const std::vector<std::string> names{"left", "ri\"ght\xff"};
  const auto j = nlohmann::json::parse(calibration_line(record, names, {}));
  EXPECT_EQ(j["type"], "calibration");
  EXPECT_TRUE(j["rating"].is_null()) << "no sigmas, no rating";
  EXPECT_EQ(j["cameras"][0]["model"], "pinhole-equidistant");
  EXPECT_EQ(j["cameras"][0]["intrinsics"], (std::vector<double>{450, 451, 322, 239}));
  EXPECT_EQ(j["cameras"][0]["distortion"], (std::vector<double>{0.1, 0.2, 0.3, 0.4, 0}));
  EXPECT_EQ(j["cameras"][1]["name"], "ri\"ght\xEF\xBF\xBD") << "JSON is UTF-8";
  const auto T = j["cameras"][1]["T_camera_left"].get<std::vector<double>>();
  ASSERT_EQ(T.size(), 12U);
  EXPECT_EQ(T[3], -0.75);
  EXPECT_EQ(T[1], record.calibration.T_camera_left[1].R(0, 1)) << "row by row";
}

TEST(PoseStream, statusLineBeforeAndAfterFirstFrame) {
  StreamStatus status{.session = "monday"};
  auto j = nlohmann::json::parse(status_line(status));
  EXPECT_EQ(j["type"], "status");
  for (const char* key : {"stamp_ns", "status", "frames", "ins"})
    EXPECT_TRUE(j[key].is_null()) << key;
  const auto keys = j.size();
  status.frame.emplace();
  status.frame->pose = sample();
  status.frame->counts.lost = 3;
  status.frame->cameras = 2;
  status.frame->images_present = 2;
  status.ins = {FixStatus::fix_2d, 0.5};
  status.aligned = true;
  j = nlohmann::json::parse(status_line(status));
  EXPECT_EQ(j.size(), keys);
  EXPECT_EQ(j["status"], "degraded");
  EXPECT_EQ(j["frames"]["lost"], 3);
  EXPECT_EQ(j["cameras"], (std::vector<bool>{false, true}));
  EXPECT_EQ(j["ins"]["fix"], "2d");
  EXPECT_EQ(j["ins"]["aligned"], true);
}

/// Keeps the pose lines and the greeting, and stalls the publisher's thread while `open` is false.
class Kept final : public LineSocket {
 public:
  void send(std::string_view line) noexcept override {
    open.wait(false);
    if (line.find(R"("type":"pose")") != std::string_view::npos) lines.emplace_back(line);
  }
  void greet(std::string text) noexcept override { greeting = std::move(text); }
  void wait(int wake, Duration timeout, const Answer& answer) noexcept override {
    pollfd event{wake, POLLIN, 0};
    (void)::poll(&event, 1, static_cast<int>(timeout.ns() / 1'000'000) + 1);
    eventfd_t ignored = 0;
    if (event.revents != 0) (void)::eventfd_read(wake, &ignored);
    if (request.empty() || event.revents == 0) return;
    const LineResponse given = answer(std::exchange(request, ""));
    response = given.line;
    images_wanted = given.image_interval > Duration{};
    answered = true;
  }
  [[nodiscard]] bool wants_images() const noexcept override { return images_wanted; }
  void send_images(std::string_view bytes) noexcept override {
    images = bytes;
    images_wanted = false;
    images_sent = true;
  }
  [[nodiscard]] LineSocketCounters counters() const noexcept override { return {}; }

  // The publisher's thread uses these members while it runs.
  std::vector<std::string> lines{};
  std::string greeting{}, request{}, response{}, images{};
  bool images_wanted = false;
  std::atomic<bool> open{true}, answered{false}, images_sent{false};
};

/// A publisher on such a socket. The socket has a request from its first wait on.
struct Publishing {
  explicit Publishing(const SessionStart& start = {}, const std::string& request = "",
                      bool open = true) {
    socket->request = request;
    socket->open = open;
    publisher = make_line_publisher(std::move(kept), &requests, calibration::CalibrationOptions{});
    publisher->on_start(start);
  }
  SessionRequests requests{};
  std::unique_ptr<Kept> kept = std::make_unique<Kept>();
  Kept* socket = kept.get();
  std::unique_ptr<SessionObserver> publisher{};
};

FrameReport report(std::uint64_t frame) {
  FrameReport r;
  r.pose.frame = frame;
  r.pose.stamp = Stamp(static_cast<std::int64_t>(frame) * 50'000'000);
  r.pose.status = PoseStatus::ok;
  return r;
}

TEST(LinePublisher, fullRingDropsAndCountsNewestPoses) {
  const Publishing p({}, "", false);
  const auto& lines = p.socket->lines;
  constexpr std::uint64_t kPoses = 1000;
  for (std::uint64_t i = 0; i < kPoses; ++i) p.publisher->on_pose(report(i));
  p.socket->open = true;
  p.socket->open.notify_all();
  std::map<std::string, std::uint64_t> counters;
  for (const auto& [name, value] : p.publisher->counters()) counters[name] = value;
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

TEST(LinePublisher, greetsWithCalibrationAndAlignment) {
  const Publishing p;
  const Kept* socket = p.socket;
  CalibrationRecord record;
  for (const auto& [stamp, accepted] : {std::pair(1, true), {2, true}, {3, false}}) {
    record.stamp = Stamp(stamp);
    record.accepted = accepted;
    p.publisher->on_calibration(record);
  }
  p.publisher->on_enu_alignment({}, {-27.4975, 153.0137, 60});
  (void)p.publisher->counters();
  const std::size_t end = socket->greeting.find('\n') + 1;
  EXPECT_EQ(nlohmann::json::parse(socket->greeting.substr(0, end))["stamp_ns"], 2);
  EXPECT_EQ(nlohmann::json::parse(socket->greeting.substr(end))["origin"]["height_m"], 60);
}

TEST(LinePublisher, imagesFollowARequestForThem) {
  SessionStart start;
  start.camera_names = {"left", "right"};
  start.image_bytes = 6;
  const Publishing p(start, R"({"request": "images", "rate_hz": 5})");
  const Kept* socket = p.socket;
  // Rows have 4 bytes.
  const std::string pixels = "abcdefgh";
  RigFrame frame{.cameras = 2};
  frame.images[0] = {reinterpret_cast<const std::uint8_t*>(pixels.data()), 3, 2, 4};
  frame.images[1] = {reinterpret_cast<const std::uint8_t*>(pixels.data()), 2, 2, 4};
  for (frame.number = 0; !socket->images_sent && frame.number < 20'000; ++frame.number) {
    frame.stamp = Stamp(static_cast<std::int64_t>(frame.number) * 50'000'000);
    AllocationGuard::seal_thread();
    const auto before = AllocationGuard::runtime_allocations();
    p.publisher->on_enu_alignment({}, {-27.4975, 153.0137, 60});
    p.publisher->on_frame(frame);
    p.publisher->on_pose(report(frame.number));
    EXPECT_EQ(AllocationGuard::runtime_allocations(), before);
    AllocationGuard::unseal_thread();
    std::this_thread::sleep_for(std::chrono::microseconds(500));
  }
  (void)p.publisher->counters();
  ASSERT_TRUE(socket->images_sent);
  EXPECT_EQ(nlohmann::json::parse(socket->lines.at(0))["enu"]["latitude_deg"], -27.4975);
  std::string_view rest = socket->images;
  const auto next = [&rest] {
    const std::size_t end = rest.find('\n');
    auto line = nlohmann::json::parse(rest.substr(0, end));
    rest.remove_prefix(end + 1);
    return line;
  };
  const auto left = next();
  EXPECT_EQ(left["type"], "image");
  EXPECT_EQ(left["name"], "left");
  EXPECT_EQ(left["bytes"], 6);
  EXPECT_EQ(left["stamp_ns"], left["frame"].get<std::int64_t>() * 50'000'000);
  EXPECT_EQ(rest.substr(0, 6), "abcefg") << "without padding";
  rest.remove_prefix(6);
  const auto right = next();
  EXPECT_EQ(right["camera"], 1);
  EXPECT_EQ(right["stamp_ns"], left["stamp_ns"]);
  EXPECT_EQ(rest, "abef");
}

struct RequestCase {
  const char* request;
  bool can_recalibrate, accepted;
};

TEST(LinePublisher, acceptsOnlyRequestsTheSessionCanMeet) {
  for (const RequestCase& c : {RequestCase{R"({"request": "recalibrate"})", true, true},
                               RequestCase{R"({"request": "recalibrate"})", false, false},
                               RequestCase{R"({"request": "images", "rate_hz": 200})", false, true},
                               RequestCase{R"({"request": "images", "rate_hz": 201})", true, false},
                               RequestCase{R"({"request": "images", "rate_hz": 0})", true, false},
                               RequestCase{R"({"request": "images"})", true, false},
                               RequestCase{R"({"request": "reboot"})", true, false},
                               RequestCase{R"({"request": 7})", true, false},
                               RequestCase{R"(["recalibrate"])", true, false},
                               RequestCase{"{\xff", true, false}, RequestCase{" ", true, false}}) {
    SCOPED_TRACE(c.request);
    SessionStart start;
    start.can_recalibrate = c.can_recalibrate;
    const Publishing p(start, c.request);
    // The publisher's thread reads the request when a pose wakes it.
    p.publisher->on_pose(report(0));
    while (!p.socket->answered.load()) std::this_thread::yield();
    const auto j = nlohmann::json::parse(p.socket->response);
    EXPECT_EQ(j["type"], "response");
    EXPECT_EQ(j["accepted"], c.accepted);
    EXPECT_EQ(p.requests.recalibrate.load(),
              c.accepted && std::string_view(c.request).find("images") == std::string_view::npos);
  }
}

}  // namespace
}  // namespace vergence::app
