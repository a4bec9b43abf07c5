// vergence-ros2 over restarts, with readers that do not read, and what it costs.
#include <fcntl.h>
#include <sched.h>

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>

#include "tests/support/quantile.hpp"
#include "tests/system/ros2/ros2_rig.hpp"

namespace vergence::test {
namespace {

using Clock = std::chrono::steady_clock;

using Ros2Restarts = Ros2Rig;

TEST_F(Ros2Restarts, nextSessionIsFoundGapIsStale) {
  const std::string log = (folder_.path() / "log").string();
  const app::FileDescriptor out(::open(log.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600));
  ChildProgram::Start start{.errors = out.get()};
  const auto bridge = start_bridge(socket_, domain_, {}, start);
  // Nothing listens yet.
  std::this_thread::sleep_for(1500ms);
  const RosParticipant participant(domain_);
  RosReader<RosOdometry> odometry(participant, "/vergence/odometry");
  RosReader<RosDiagnostics> diagnostics(participant, "/diagnostics");
  for (int i = 0; i < 2; ++i) {
    StreamSession session(socket_);
    while (odometry.read() != nullptr) {
    }
    EXPECT_TRUE(feed_until(&session, [&] { return odometry.read() != nullptr; })) << i;
  }
  const RosDiagnostics::Message* d = nullptr;
  do {
    d = diagnostics.next();
    ASSERT_NE(d, nullptr);
  } while (d->status._buffer[0].level != 3);
  const std::string text = read_file(log);
  const std::size_t first = text.find("unix://");
  EXPECT_NE(first, std::string::npos) << text;
  EXPECT_EQ(text.find("unix://", first + 1), std::string::npos) << "once\n" << text;
}

TEST_F(Ros2Restarts, restartedBridgeServesOldReaders) {
  StreamSession session(socket_);
  session.calibrate(450);
  const RosParticipant participant(domain_);
  RosReader<RosOdometry> odometry(participant, "/vergence/odometry");
  RosReader<RosCameraInfo> info(participant, "/vergence/left/camera_info", true);
  for (int i = 0; i < 2; ++i) {
    const auto bridge = start_bridge(socket_, domain_);
    while (odometry.read() != nullptr) {
    }
    EXPECT_TRUE(feed_until(&session, [&] { return odometry.read() != nullptr; })) << i;
    EXPECT_NE(info.next(), nullptr) << i;
    if (i == 0) bridge->signal(SIGKILL);
  }
}

TEST_F(Ros2Restarts, otherDomainReceivesNothing) {
  StreamSession session(socket_);
  const auto bridge = start_bridge(socket_, domain_);
  const RosParticipant here(domain_), elsewhere(domain_ + 1);
  RosReader<RosOdometry> odometry(here, "/vergence/odometry"),
      other(elsewhere, "/vergence/odometry");
  EXPECT_TRUE(feed_until(&session, [&] { return odometry.read() != nullptr; }));
  EXPECT_EQ(other.next(2s), nullptr);
}

std::size_t resident_kb(pid_t pid) {
  std::ifstream status(fmt::format("/proc/{}/status", pid));
  for (std::string word; status >> word;)
    if (word == "VmRSS:") {
      std::size_t kb = 0;
      status >> kb;
      return kb;
    }
  return 0;
}

/// CPU time of a process, user and system.
double cpu_seconds(pid_t pid) {
  std::ifstream stat(fmt::format("/proc/{}/stat", pid));
  std::string field;
  double ticks = 0;
  for (int i = 1; i <= 15 && stat >> field; ++i)
    if (i >= 14) ticks += std::stod(field);
  return ticks / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

TEST_F(Ros2Restarts, stoppedReaderCostsNoPosesOrMemory) {
  // A process of its own, which is stopped when it has got its first message.
  std::array<int, 2> ready{};
  ASSERT_EQ(::pipe(ready.data()), 0);
  const pid_t stopped = ::fork();
  if (stopped == 0) {
    const RosParticipant participant(domain_);
    RosReader<RosOdometry> odometry(participant, "/vergence/odometry");
    (void)odometry.next(30s);
    (void)!::write(ready[1], "x", 1);
    for (;;) ::pause();
  }
  StreamSession session(socket_);
  session.calibrate(450);
  const auto bridge = start_bridge(socket_, domain_);
  (void)::fcntl(ready[0], F_SETFL, O_NONBLOCK);
  char byte = 0;
  const bool got = feed_until(&session, [&] { return ::read(ready[0], &byte, 1) == 1; });
  ASSERT_EQ(::kill(stopped, SIGSTOP), 0);
  EXPECT_TRUE(got);
  const RosParticipant participant(domain_);
  RosReader<RosOdometry> odometry(participant, "/vergence/odometry");
  EXPECT_TRUE(feed_until(&session, [&] { return odometry.read() != nullptr; }));
  const auto feed = [&](int poses) {
    for (int i = 0; i < poses; ++i, std::this_thread::sleep_for(2ms)) {
      session.pose();
      while (odometry.read() != nullptr) {
      }
    }
  };
  feed(500);
  const std::size_t before = resident_kb(bridge->pid());
  feed(2500);
  EXPECT_LT(resident_kb(bridge->pid()), before + 1024);
  session.pose();
  EXPECT_NE(odometry.next(), nullptr) << "the reader that reads is served";
  EXPECT_EQ(session.counters()["lines_refused"], 0U);
  (void)::kill(stopped, SIGKILL);
  (void)::waitpid(stopped, nullptr, 0);
}

/// Measures the way of 50 poses a second; images: beside pairs of 640×480 at 10 Hz, which a reader
/// takes.
void measure_poses(const std::string& socket, std::uint32_t domain, bool images) {
  // Where the system lets it, before what else the machine does: the figure is that of the
  // programs.
  const sched_param priority{1};
  (void)::sched_setscheduler(0, SCHED_FIFO, &priority);
  StreamSession session(socket);
  session.calibrate(450);
  session.align();
  const auto bridge = start_bridge(socket, domain, {"--image-rate-hz", images ? "10" : "0"});
  const RosParticipant participant(domain);
  RosReader<RosImage> left(participant, "/vergence/left/image_raw"),
      right(participant, "/vergence/right/image_raw");
  RosReader<RosOdometry> odometry(participant, "/vergence/odometry");
  ASSERT_TRUE(feed_until(&session, [&] { return odometry.read() != nullptr; }));
  std::this_thread::sleep_for(500ms);
  while (odometry.read() != nullptr) {
  }

  const dds_entity_t waitset = dds_create_waitset(participant.get()),
                     condition = dds_create_readcondition(odometry.get(), DDS_ANY_STATE);
  ASSERT_EQ(dds_waitset_attach(waitset, condition, 0), 0);
  constexpr int kPoses = 500;
  std::vector<double> ms;
  int received = 0;
  const double cpu_before = cpu_seconds(bridge->pid());
  const auto start = Clock::now();
  for (int i = 0; i < kPoses; ++i) {
    std::this_thread::sleep_until(start + i * 20ms);
    const auto sent = Clock::now();
    session.pose();
    if (dds_waitset_wait(waitset, nullptr, 0, DDS_MSECS(1000)) <= 0) continue;
    ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - sent).count());
    while (odometry.read() != nullptr) {
    }
    while (left.read() != nullptr || right.read() != nullptr) ++received;
  }
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
  const double cpu = 100 * (cpu_seconds(bridge->pid()) - cpu_before) / seconds;
  ASSERT_EQ(ms.size(), static_cast<std::size_t>(kPoses));
  EXPECT_LE(quantile(ms, 0.99), 2);
  EXPECT_LE(cpu, images ? 15 : 3);
  EXPECT_GE(received, images ? kPoses / 5 : 0);
  const sched_param normal{0};
  (void)::sched_setscheduler(0, SCHED_OTHER, &normal);
}

TEST_F(Ros2Restarts, posesAt50HzArriveWithin2Ms) { measure_poses(socket_, domain_, false); }
TEST_F(Ros2Restarts, posesArriveWithin2MsBesideImages) { measure_poses(socket_, domain_, true); }

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

/// A message of rmw_fastrtps as bytes.
class BytesType final : public fast::TopicDataType {
 public:
  using Bytes = std::vector<std::uint8_t>;
  explicit BytesType(const char* name) {
    setName(name);
    m_typeSize = 256;
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const auto& bytes = *static_cast<const Bytes*>(data);
    std::copy(bytes.begin(), bytes.end(), payload->data);
    payload->length = static_cast<std::uint32_t>(bytes.size());
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<const Bytes*>(data)->size()); };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void* /*data*/, rtps::InstanceHandle_t* /*handle*/, bool /*md5*/) override {
    return false;
  }
};

/// As rmw_fastrtps calls: the reply names the request's writer and number beside the message.
TEST_F(Ros2Restarts, answersRmwFastrtpsCall) {
  // vergence is not running.
  const auto bridge = start_bridge(socket_, domain_);
  auto* factory = fast::DomainParticipantFactory::get_instance();
  fast::DomainParticipantQos here;
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList.emplace_back("127.0.0.1");
  here.transport().use_builtin_transports = false;
  here.transport().user_transports.push_back(std::move(udp));
  auto* participant = factory->create_participant(domain_, here);
  ASSERT_NE(participant, nullptr);
  const auto topic = [&](const char* name, const char* type) {
    fast::TypeSupport(new BytesType(type)).register_type(participant);
    return participant->create_topic(name, type, fast::TOPIC_QOS_DEFAULT);
  };
  auto* writer = participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT)
                     ->create_datawriter(topic("rq/vergence/recalibrateRequest",
                                               "std_srvs::srv::dds_::Trigger_Request_"),
                                         fast::DATAWRITER_QOS_DEFAULT);
  fast::DataReaderQos reliable;
  reliable.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  auto* reader = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT)
                     ->create_datareader(topic("rr/vergence/recalibrateReply",
                                               "std_srvs::srv::dds_::Trigger_Response_"),
                                         reliable);
  fast::PublicationMatchedStatus writer_matched;
  fast::SubscriptionMatchedStatus reader_matched;
  for (int i = 0;
       i < 200 && (writer_matched.current_count == 0 || reader_matched.current_count == 0);
       ++i, std::this_thread::sleep_for(50ms)) {
    writer->get_publication_matched_status(writer_matched);
    reader->get_subscription_matched_status(reader_matched);
  }
  BytesType::Bytes request{0, 1, 0, 0, 0}, reply;
  rtps::WriteParams parameters;
  ASSERT_TRUE(writer->write(&request, parameters));
  ASSERT_TRUE(reader->wait_for_unread_message({10, 0}));
  fast::SampleInfo info;
  ASSERT_EQ(reader->take_next_sample(&reply, &info), ReturnCode_t::RETCODE_OK);
  EXPECT_EQ(info.related_sample_identity, parameters.sample_identity());
  ASSERT_GT(reply.size(), 12U);
  EXPECT_EQ(reply[4], 0) << "not successful";
  EXPECT_EQ(std::string(reply.begin() + 12, reply.end() - 1), "vergence is not running");
  participant->delete_contained_entities();
  factory->delete_participant(participant);
}

}  // namespace
}  // namespace vergence::test
