// Checks vergence-ros2's topics with Cyclone DDS, which the product does not use.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/eventfd.h>

#include <string>
#include <vector>

#include "tests/system/ros2/ros2_rig.hpp"

namespace vergence::test {
namespace {

using app::FileDescriptor;

class Ros2Topics : public testing::Test {
 protected:
  TemporaryFolder folder_;
  std::string socket_ = (folder_.path() / "pose.sock").string();
  std::uint32_t domain_ = own_domain();
};

void expect_identity(const geometry_msgs_msg_dds__Quaternion_& q) {
  EXPECT_EQ(q.w, 1);
  for (const double v : {q.x, q.y, q.z}) EXPECT_EQ(v, 0);
}

TEST_F(Ros2Topics, AreReadByAnotherDdsAndLatchedOnesByALateReader) {
  StreamSession session(socket_);
  session.calibrate(450);
  session.align();
  const auto bridge = start_bridge(socket_, domain_, {"--camera-xyz-m", "1.5", "0", "0.5"});
  const RosParticipant participant(domain_);
  RosReader<RosOdometry> odometry(participant, "/vergence/odometry");
  RosReader<RosTf> tf(participant, "/tf");
  RosReader<RosFix> fix(participant, "/vergence/fix");
  RosReader<RosPose> pose_enu(participant, "/vergence/pose_enu");
  RosReader<RosDiagnostics> diagnostics(participant, "/diagnostics");

  const RosOdometry* o = nullptr;
  ASSERT_TRUE(feed_until(&session, [&] {
    o = odometry.take();
    return o != nullptr && o->twist.twist.linear.x > 0;
  }));
  EXPECT_STREQ(o->header.frame_id, "odom");
  EXPECT_STREQ(o->child_frame_id, "base_link");
  const auto frame = static_cast<double>(frame_of(o->header));
  EXPECT_EQ(o->header.stamp.nanosec % 50'000'000, 1U);
  // The vehicle's forward is the camera's z; a micrometre is the stream's digit.
  EXPECT_NEAR(o->pose.pose.position.x, 0.1 * frame, 1e-6);
  EXPECT_NEAR(o->pose.pose.position.y, 0, 1e-12);
  expect_identity(o->pose.pose.orientation);
  EXPECT_NEAR(o->pose.covariance[7], 0.25, 1e-12) << "right of the camera is y of the vehicle";
  EXPECT_NEAR(o->twist.twist.linear.x, 2, 1e-4);
  EXPECT_EQ(
      odometry.user_data(),
      std::vector<std::string>{
          "typehash=RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0;"});

  const RosTf* moved = tf.next();
  ASSERT_NE(moved, nullptr);
  ASSERT_EQ(moved->transforms._length, 1U);
  EXPECT_STREQ(moved->transforms._buffer[0].child_frame_id, "base_link");
  EXPECT_NEAR(moved->transforms._buffer[0].transform.translation.x,
              0.1 * static_cast<double>(frame_of(moved->transforms._buffer[0].header)), 1e-6);

  const RosFix* f = fix.next();
  ASSERT_NE(f, nullptr);
  EXPECT_EQ(f->status.status, 0);
  EXPECT_EQ(f->position_covariance_type, 3);
  EXPECT_NEAR(f->longitude, 153.0137, 1e-4);
  EXPECT_GT(f->latitude, -27.4975);
  const RosPose* p = pose_enu.next();
  ASSERT_NE(p, nullptr);
  EXPECT_STREQ(p->header.frame_id, "enu");
  EXPECT_NEAR(p->pose.pose.position.x, 1, 1e-9);
  // The vehicle's origin is 1.5 m behind the camera.
  EXPECT_NEAR(p->pose.pose.position.y, 2 + 0.1 * static_cast<double>(frame_of(p->header)) - 1.5,
              1e-6);
  EXPECT_NEAR(p->pose.pose.position.z, 2.5, 1e-9);

  // Late: both were published before any of these were there.
  RosReader<RosTf> tf_static(participant, "/tf_static", true);
  RosReader<RosCameraInfo> left(participant, "/vergence/left/camera_info", true),
      right(participant, "/vergence/right/camera_info", true);
  const RosTf* rig = tf_static.next();
  ASSERT_NE(rig, nullptr);
  ASSERT_EQ(rig->transforms._length, 2U);
  const auto& T = rig->transforms._buffer[1];
  EXPECT_STREQ(T.header.frame_id, "base_link");
  EXPECT_STREQ(T.child_frame_id, "right_optical_frame");
  EXPECT_NEAR(T.transform.translation.x, 1.5, 1e-12);
  EXPECT_NEAR(T.transform.translation.y, -0.75, 1e-12);
  EXPECT_NEAR(T.transform.rotation.x, -0.5, 1e-12);
  const RosCameraInfo* info = right.next();
  ASSERT_NE(info, nullptr);
  EXPECT_STREQ(info->header.frame_id, "right_optical_frame");
  EXPECT_STREQ(info->distortion_model, "plumb_bob");
  EXPECT_EQ(info->width, 640U);
  ASSERT_EQ(info->d._length, 5U);
  EXPECT_EQ(info->d._buffer[3], -2e-4);
  EXPECT_EQ(info->k[0], 450);
  EXPECT_EQ(info->k[4], 451);
  EXPECT_NEAR(info->p[3], -450.5 * 0.75, 1e-9);
  ASSERT_NE(left.next(), nullptr);
  session.calibrate(460);
  info = left.next();
  ASSERT_NE(info, nullptr) << "an adopted calibration is published again";
  EXPECT_EQ(info->k[0], 460);

  const RosDiagnostics* d = diagnostics.next();
  ASSERT_NE(d, nullptr);
  ASSERT_EQ(d->status._length, 5U);
  EXPECT_STREQ(d->status._buffer[0].name, "vergence: odometry");
  EXPECT_STREQ(d->status._buffer[0].values._buffer[0].value, "session");

  // A call as rmw_cyclonedds makes it.
  const auto qos = RosParticipant::reliable(false);
  const dds_entity_t requests = dds_create_writer(
      participant.get(), participant.topic<TriggerRequest>("rq/vergence/recalibrateRequest"),
      qos.get(), nullptr);
  RosReader<TriggerResponse> responses(
      participant, participant.topic<TriggerResponse>("rr/vergence/recalibrateReply"));
  const auto matched = [&] {
    dds_publication_matched_status_t writer{};
    dds_subscription_matched_status_t reader{};
    (void)dds_get_publication_matched_status(requests, &writer);
    (void)dds_get_subscription_matched_status(responses.get(), &reader);
    return writer.current_count > 0 && reader.current_count > 0;
  };
  ASSERT_TRUE(feed_until(&session, matched));
  TriggerRequest request{0x123456789abcdef0, 42, 0};
  ASSERT_EQ(dds_write(requests, &request), 0);
  const TriggerResponse* response = responses.next();
  ASSERT_NE(response, nullptr);
  EXPECT_EQ(response->client, 0x123456789abcdef0U);
  EXPECT_EQ(response->number, 42);
  EXPECT_TRUE(response->success);
  EXPECT_TRUE(session.requests.recalibrate.load());

  bridge->signal(SIGTERM);
  EXPECT_EQ(bridge->wait(10s), 143);
}

struct RefusalCase {
  std::vector<std::string> words;
  std::string named;  // by the message
};
void PrintTo(const RefusalCase& c, std::ostream* out) { *out << c.named; }

class Ros2Refusals : public testing::TestWithParam<RefusalCase> {};

TEST_P(Ros2Refusals, EndWithTwoAndNameWhatIsWrong) {
  const TemporaryFolder folder;
  const std::string log = (folder.path() / "log").string();
  const FileDescriptor out(::open(log.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600));
  ChildProgram::Start start;
  start.errors = out.get();
  ChildProgram bridge(GetParam().words, start);
  EXPECT_EQ(bridge.wait(20s), 2);
  EXPECT_NE(read_file(log).find(GetParam().named), std::string::npos) << read_file(log);
}

INSTANTIATE_TEST_SUITE_P(All, Ros2Refusals,
                         testing::Values(RefusalCase{{"--domain", "300"}, "--domain"},
                                         RefusalCase{{"--socket", "udp://127.0.0.1:9870"},
                                                     "--socket"},
                                         RefusalCase{{"--namespace", "two words"}, "--namespace"},
                                         RefusalCase{{"--child", "wheel"}, "--child"},
                                         RefusalCase{{"--speed", "1"}, "--speed"}));

TEST_F(Ros2Topics, AnotherVersionOfTheStreamIsRefused) {
  const auto socket =
      app::open_line_socket({app::LineAddress::Kind::unix_socket, socket_, {}}, "test");
  socket->greet("{\"version\":1,\"frame\":0}\n");
  const auto bridge = start_bridge(socket_, domain_);
  const FileDescriptor wake(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  while (socket->counters().readers == 0) socket->wait(wake.get(), Duration::milliseconds(20), {});
  EXPECT_EQ(bridge->wait(20s), 2);
}

}  // namespace
}  // namespace vergence::test
