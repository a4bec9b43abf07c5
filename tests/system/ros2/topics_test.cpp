// Checks vergence-ros2's topics with Cyclone DDS, which the product does not use.
#include <fcntl.h>
#include <sys/eventfd.h>

#include <algorithm>

#include "tests/system/ros2/ros2_rig.hpp"

namespace vergence::test {
namespace {

using Ros2Topics = Ros2Rig;

void expect_identity(const geometry_msgs_msg_dds__Quaternion_& q) {
  EXPECT_EQ(q.w, 1);
  for (const double v : {q.x, q.y, q.z}) EXPECT_EQ(v, 0);
}

TEST_F(Ros2Topics, areReadByCycloneDdsAlsoLate) {
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

  const RosOdometry::Message* o = nullptr;
  ASSERT_TRUE(feed_until(&session, [&] {
    o = odometry.read();
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

  const auto* moved = tf.next();
  ASSERT_NE(moved, nullptr);
  ASSERT_EQ(moved->transforms._length, 1U);
  EXPECT_STREQ(moved->transforms._buffer[0].child_frame_id, "base_link");
  EXPECT_NEAR(moved->transforms._buffer[0].transform.translation.x,
              0.1 * static_cast<double>(frame_of(moved->transforms._buffer[0].header)), 1e-6);

  const auto* f = fix.next();
  ASSERT_NE(f, nullptr);
  EXPECT_EQ(f->status.status, 0);
  EXPECT_EQ(f->position_covariance_type, 3);
  EXPECT_NEAR(f->longitude, 153.0137, 1e-4);
  EXPECT_GT(f->latitude, -27.4975);
  const auto* p = pose_enu.next();
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
  const auto* rig = tf_static.next();
  ASSERT_NE(rig, nullptr);
  ASSERT_EQ(rig->transforms._length, 2U);
  const auto& T = rig->transforms._buffer[1];
  EXPECT_STREQ(T.header.frame_id, "base_link");
  EXPECT_STREQ(T.child_frame_id, "right_optical_frame");
  EXPECT_NEAR(T.transform.translation.x, 1.5, 1e-12);
  EXPECT_NEAR(T.transform.translation.y, -0.75, 1e-12);
  EXPECT_NEAR(T.transform.rotation.x, -0.5, 1e-12);
  const auto* info = right.next();
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

  const auto* d = diagnostics.next();
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
  TriggerRequest::Message request{0x123456789abcdef0, 42, 0};
  const TriggerResponse::Message* response = nullptr;
  // A response is lost while the bridge has not yet discovered the reader, so the call is repeated.
  ASSERT_TRUE(feed_until(&session, [&] {
    EXPECT_EQ(dds_write(requests, &request), 0);
    response = responses.read();
    return response != nullptr;
  }));
  EXPECT_EQ(response->client, 0x123456789abcdef0U);
  EXPECT_EQ(response->number, 42);
  EXPECT_TRUE(response->success);
  EXPECT_TRUE(session.requests.recalibrate.load());

  bridge->signal(SIGTERM);
  EXPECT_EQ(bridge->wait(10s), 143);
}

/// stereo_image_proc synchronises images and camera_info of both cameras by equal stamps.
TEST_F(Ros2Topics, imagesEqualTheSessionsAndShareStamps) {
  StreamSession session(socket_);
  session.calibrate(450);
  const auto bridge = start_bridge(socket_, domain_, {"--image-rate-hz", "20"});
  const RosParticipant participant(domain_);
  RosReader<RosImage> left(participant, "/vergence/left/image_raw"),
      right(participant, "/vergence/right/image_raw");
  RosReader<RosCameraInfo> left_info(participant, "/vergence/left/camera_info"),
      right_info(participant, "/vergence/right/camera_info");
  RosReader<RosOdometry> odometry(participant, "/vergence/odometry");
  // Number of images, camera_info and odometry messages by frame.
  std::map<std::int64_t, int> received;
  int images = 0;
  const auto read_all = [&](RosReader<RosImage>* reader, std::size_t camera) {
    for (const RosImage::Message* m; (m = reader->read()) != nullptr; ++images) {
      const std::int64_t frame = frame_of(m->header);
      ++received[frame];
      EXPECT_EQ(m->header.stamp.nanosec % 50'000'000, 1U);
      EXPECT_STREQ(m->header.frame_id, camera == 0 ? "left_optical_frame" : "right_optical_frame");
      EXPECT_STREQ(m->encoding, "mono8");
      const ImageView seen = StreamSession::image(static_cast<std::uint64_t>(frame), camera);
      ASSERT_EQ(m->width, static_cast<std::uint32_t>(seen.width));
      ASSERT_EQ(m->height, static_cast<std::uint32_t>(seen.height));
      EXPECT_EQ(m->step, m->width);
      ASSERT_EQ(m->data._length, m->width * m->height);
      bool same = true;
      for (int y = 0; y < seen.height; ++y)
        same = same &&
               std::equal(seen.row(y), seen.row(y) + seen.width, m->data._buffer + y * seen.width);
      EXPECT_TRUE(same) << "frame " << frame << ", camera " << camera;
    }
  };
  const auto count = [&](auto* reader) {
    while (const auto* m = reader->read()) ++received[frame_of(m->header)];
  };
  EXPECT_TRUE(feed_until(&session, [&] {
    read_all(&left, 0);
    read_all(&right, 1);
    count(&left_info);
    count(&right_info);
    count(&odometry);
    return std::count_if(received.begin(), received.end(),
                         [](const auto& frame) { return frame.second == 5; }) >= 10;
  }));
  // At most every fifth frame, as they come at 100 Hz here.
  EXPECT_LT(images, 2 * (received.rbegin()->first / 5 + 2));
}

/// `ros2 node list` and `ros2 node info` read this topic.
template <class Nodes>
void expect_node(const std::string& socket, std::uint32_t domain, const char* distribution) {
  StreamSession session(socket);
  const auto bridge = start_bridge(socket, domain, {"--ros-distro", distribution});
  const RosParticipant participant(domain);
  RosReader<Nodes> nodes(participant, participant.topic<Nodes>("ros_discovery_info"), true);
  RosReader<RosOdometry> odometry(participant, "/vergence/odometry");
  const typename Nodes::Message* n = nullptr;
  // The service is the last of the endpoints without a calibration.
  ASSERT_TRUE(feed_until(&session, [&] {
    n = nodes.read();
    return n != nullptr && n->node_entities_info_seq._length == 1 &&
           n->node_entities_info_seq._buffer[0].reader_gid_seq._length == 1 &&
           !odometry.writer_guids().empty();
  }));
  const auto& node = n->node_entities_info_seq._buffer[0];
  EXPECT_STREQ(node.node_namespace, "/");
  EXPECT_STREQ(node.node_name, "vergence_ros2");
  EXPECT_EQ(node.writer_gid_seq._length, 7U) << "six topics and the service's replies";
  const std::string odometry_guid = odometry.writer_guids().at(0);
  int found = 0;
  for (std::uint32_t i = 0; i < node.writer_gid_seq._length; ++i) {
    const std::uint8_t* gid = node.writer_gid_seq._buffer[i].data;
    if (std::equal(odometry_guid.begin(), odometry_guid.end(), reinterpret_cast<const char*>(gid)))
      ++found;
    EXPECT_TRUE(std::equal(n->gid.data, n->gid.data + 12, gid)) << "the participant's prefix";
  }
  EXPECT_EQ(found, 1);
}

TEST_F(Ros2Topics, nodeIsAnnouncedInJazzysLayout) {
  expect_node<RosNodes>(socket_, domain_, "jazzy");
}

TEST_F(Ros2Topics, nodeIsAnnouncedInHumblesLayout) {
  expect_node<HumbleNodes>(socket_, domain_, "humble");
}

struct RefusalCase {
  std::vector<std::string> words;
  /// Part of the message.
  std::string named;
};
void PrintTo(const RefusalCase& c, std::ostream* out) { *out << c.named; }

class Ros2Refusals : public testing::TestWithParam<RefusalCase> {};

TEST_P(Ros2Refusals, exitWithTwoAndNameTheOption) {
  const TemporaryFolder folder;
  const std::string log = (folder.path() / "log").string();
  const app::FileDescriptor out(::open(log.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600));
  ChildProgram bridge(GetParam().words, {.errors = out.get()});
  EXPECT_EQ(bridge.wait(20s), 2);
  EXPECT_NE(read_file(log).find(GetParam().named), std::string::npos) << read_file(log);
}

INSTANTIATE_TEST_SUITE_P(All, Ros2Refusals,
                         testing::Values(RefusalCase{{"--domain", "300"}, "--domain"},
                                         RefusalCase{{"--socket", "udp://127.0.0.1:9870"},
                                                     "--socket"},
                                         RefusalCase{{"--namespace", "two words"}, "--namespace"},
                                         RefusalCase{{"--child", "wheel"}, "--child"},
                                         RefusalCase{{"--image-rate-hz", "-1"}, "--image-rate-hz"},
                                         RefusalCase{{"--speed", "1"}, "--speed"}));

TEST_F(Ros2Topics, otherStreamVersionExitsWithTwo) {
  const auto socket =
      app::open_line_socket({app::LineAddress::Kind::unix_socket, socket_, {}}, "test");
  socket->greet("{\"version\":1,\"frame\":0}\n");
  const auto bridge = start_bridge(socket_, domain_);
  const app::FileDescriptor wake(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  while (socket->counters().readers == 0) socket->wait(wake.get(), Duration::milliseconds(20), {});
  EXPECT_EQ(bridge->wait(20s), 2);
}

}  // namespace
}  // namespace vergence::test
