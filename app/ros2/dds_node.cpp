#include "app/ros2/dds_node.hpp"

#include <sys/eventfd.h>

#include <cstdlib>
#include <deque>
#include <functional>
#include <map>
#include <mutex>

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>

#include "app/runtime/errors.hpp"

namespace vergence::app::ros2 {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

namespace {

/// Serialised bytes of a message including the encapsulation.
using Bytes = std::vector<std::uint8_t>;

/// Type of serialised messages, of which Fast DDS only transports the bytes.
class SerialisedType final : public dds::TopicDataType {
 public:
  explicit SerialisedType(const std::string& name) {
    setName(name.c_str());
    // Initial size of a payload in bytes; it grows with the messages.
    m_typeSize = 1024;
    m_isGetKeyDefined = false;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }

  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const Bytes& bytes = *static_cast<const Bytes*>(data);
    if (bytes.size() > payload->max_size) return false;
    std::memcpy(payload->data, bytes.data(), bytes.size());
    payload->length = static_cast<std::uint32_t>(bytes.size());
    payload->encapsulation = CDR_LE;
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

/// `nav_msgs/msg/Odometry` → `nav_msgs::msg::dds_::Odometry_`.
std::string dds_type_name(std::string_view ros) {
  const std::size_t first = ros.find('/'), second = ros.rfind('/');
  return fmt::format("{}::{}::dds_::{}_", ros.substr(0, first),
                     ros.substr(first + 1, second - first - 1), ros.substr(second + 1));
}

std::string user_data(std::string_view hash) { return fmt::format("typehash=RIHS01_{};", hash); }

bool this_machine_only() {
  const auto is = [](const char* name, std::string_view value) {
    const char* set = std::getenv(name);
    return set != nullptr && set == value;
  };
  return is("ROS_LOCALHOST_ONLY", "1") || is("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST");
}

/// Encodes rmw_dds_common/ParticipantEntitiesInfo of one node. `gid_bytes` is 24 in Humble and 16
/// later; a GUID fills the first 16.
Bytes node_info(const rtps::GUID_t& participant, std::span<const rtps::GUID_t> readers,
                std::span<const rtps::GUID_t> writers, std::size_t gid_bytes) {
  Bytes bytes(256 + (readers.size() + writers.size()) * gid_bytes);
  CdrWriter out(bytes);
  const auto gid = [&](const rtps::GUID_t& guid) {
    std::array<std::uint8_t, 24> id{};
    std::copy_n(guid.guidPrefix.value, rtps::GuidPrefix_t::size, id.begin());
    std::copy_n(guid.entityId.value, rtps::EntityId_t::size, id.begin() + rtps::GuidPrefix_t::size);
    out.raw(std::span(id).first(gid_bytes));
  };
  gid(participant);
  out.count(1).text("/").text("vergence_ros2");
  for (const auto guids : {readers, writers}) {
    out.count(guids.size());
    std::ranges::for_each(guids, gid);
  }
  bytes.resize(out.size());
  return bytes;
}

constexpr std::string_view kTriggerHash =
    "eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f";

}  // namespace

std::string_view type_hash(RosType type) noexcept {
  constexpr std::pair<RosType, std::string_view> kHashes[]{
      {RosType::image, "d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47"},
      {RosType::odometry, "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"},
      {RosType::tf, "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"},
      {RosType::camera_info, "b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275"},
      {RosType::nav_sat_fix, "62223ab3fe210a15976021da7afddc9e200dc9ec75231c1b6a557fc598a65404"},
      {RosType::pose_with_covariance,
       "26432f9803e43727d3c8f668d1fdb3c630f548af631e2f4e31382371bfea3b6e"},
      {RosType::diagnostics, "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"}};
  for (const auto& [with_hash, hash] : kHashes)
    if (with_hash == type) return hash;
  return {};
}

struct DdsNode::Request {
  rtps::SampleIdentity identity{};
  // In rmw_cyclonedds, the numbers of the client and of its request precede the request and are
  // repeated in the reply.
  std::vector<std::uint8_t> header{};
};

struct DdsNode::Parts : dds::DataReaderListener {
  dds::DomainParticipant* participant = nullptr;
  dds::Publisher* publisher = nullptr;
  dds::Subscriber* subscriber = nullptr;
  std::map<std::string, dds::DataWriter*> writers;
  dds::DataWriter* replies = nullptr;
  std::uint32_t domain = 0;
  int wake = -1;
  Bytes message;

  // Announcement of the ROS node (null without one), and its endpoints.
  dds::DataWriter* discovery = nullptr;
  std::size_t gid_bytes = 16;
  std::vector<rtps::GUID_t> node_readers, node_writers;

  // Guards requests.
  std::mutex mutex;
  std::deque<std::shared_ptr<const Request>> requests;

  ~Parts() override {
    if (participant == nullptr) return;
    participant->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant);
  }

  template <class Entity>
  Entity* required(Entity* entity, std::string_view what) const {
    if (entity == nullptr)
      throw InputError(
          "ROS_DOMAIN_ID: domain {} cannot be joined (no {}); check the network, the ports from {} "
          "on and the Fast DDS profile",
          domain, what, 7400 + 250 * domain);
    return entity;
  }

  dds::Topic* topic(const std::string& name, std::string_view type) {
    const std::string type_name = dds_type_name(type);
    dds::TypeSupport(new SerialisedType(type_name)).register_type(participant);
    if (auto* known = dynamic_cast<dds::Topic*>(participant->lookup_topicdescription(name)))
      return known;
    return required(participant->create_topic(name, type_name, dds::TOPIC_QOS_DEFAULT), name);
  }

  /// Reliable quality of service as in ROS 2, with `depth` messages kept.
  template <class Qos>
  static Qos reliable(bool latched, int depth, const std::string& hash) {
    Qos qos;
    qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
    qos.durability().kind =
        latched ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
    qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = depth;
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    qos.data_sharing().off();
    qos.user_data().data_vec({hash.begin(), hash.end()});
    return qos;
  }

  dds::DataWriter* writer(const std::string& name, std::string_view type, bool latched, int depth,
                          const std::string& hash) {
    auto qos = reliable<dds::DataWriterQos>(latched, depth, hash);
    // The caller's thread sends, which has the lowest latency; datagrams do not block.
    qos.publish_mode().kind = dds::SYNCHRONOUS_PUBLISH_MODE;
    // Images are sent by another thread, because poses would wait behind them.
    if (type == ros_type_name(RosType::image))
      qos.publish_mode().kind = dds::ASYNCHRONOUS_PUBLISH_MODE;
    return required(publisher->create_datawriter(topic(name, type), qos), name);
  }

  void announce_node() {
    if (discovery == nullptr) return;
    message = node_info(participant->guid(), node_readers, node_writers, gid_bytes);
    discovery->write(&message);
  }

  /// Runs on a thread of Fast DDS.
  void on_data_available(dds::DataReader* reader) override {
    Bytes bytes;
    dds::SampleInfo info;
    while (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      constexpr std::size_t kEncapsulation = 4, kHeader = 16;
      Request request;
      request.identity = info.sample_identity;
      // rmw_fastrtps expects the reply for the reader named in the request, if there is one.
      if (info.related_sample_identity.writer_guid() != rtps::GUID_t::unknown())
        request.identity.writer_guid() = info.related_sample_identity.writer_guid();
      if (bytes.size() >= kEncapsulation + kHeader)
        request.header.assign(bytes.begin() + kEncapsulation,
                              bytes.begin() + kEncapsulation + kHeader);
      const std::lock_guard lock(mutex);
      if (requests.size() < kMaxRequests)
        requests.push_back(std::make_shared<const Request>(std::move(request)));
    }
    (void)::eventfd_write(wake, 1);
  }
};

DdsNode::DdsNode(std::uint32_t domain, const std::string& ros_distribution)
    : parts_(std::make_unique<Parts>()) {
  parts_->domain = domain;
  auto* factory = dds::DomainParticipantFactory::get_instance();
  factory->load_profiles();
  dds::DomainParticipantQos qos = factory->get_default_participant_qos();
  qos.name("vergence_ros2");
  // ROS 2 recognises its participants by an enclave.
  constexpr std::string_view kEnclave = "enclave=/;";
  qos.user_data().data_vec({kEnclave.begin(), kEnclave.end()});
  // Without a profile of the user only UDP is used. Shared memory does not reach programs of other
  // users, and the service has its own user.
  if (qos.transport().use_builtin_transports && qos.transport().user_transports.empty()) {
    auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    if (this_machine_only()) udp->interfaceWhiteList.emplace_back("127.0.0.1");
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(std::move(udp));
  }
  parts_->participant =
      parts_->required(factory->create_participant(domain, qos), "DDS participant");
  parts_->publisher = parts_->required(
      parts_->participant->create_publisher(dds::PUBLISHER_QOS_DEFAULT), "publisher");
  parts_->subscriber = parts_->required(
      parts_->participant->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT), "subscriber");
  if (ros_distribution.empty()) return;
  parts_->gid_bytes = ros_distribution == "humble" ? 24 : 16;
  parts_->discovery = parts_->writer("ros_discovery_info",
                                     "rmw_dds_common/msg/ParticipantEntitiesInfo", true, 1, "");
}

DdsNode::~DdsNode() = default;

void DdsNode::advertise(const std::string& topic, RosType type, bool latched) {
  dds::DataWriter*& writer = parts_->writers[topic];
  // Depths are those of ROS 2: 10 by default, 100 for /tf, 1 for latched topics. Two images are
  // kept, because each is large and only the newest is useful.
  const int depth = latched ? 1 : type == RosType::tf ? 100 : type == RosType::image ? 2 : 10;
  if (writer != nullptr) return;
  writer =
      parts_->writer("rt" + topic, ros_type_name(type), latched, depth, user_data(type_hash(type)));
  parts_->node_writers.push_back(writer->guid());
  parts_->announce_node();
}

void DdsNode::publish(const std::string& topic, std::span<const std::uint8_t> cdr) {
  parts_->message.assign(cdr.begin(), cdr.end());
  parts_->writers.at(topic)->write(&parts_->message);
}

void DdsNode::serve_trigger(const std::string& name, int wake) {
  constexpr int kDepth = 10;
  Parts& p = *parts_;
  const std::string hash = user_data(kTriggerHash);
  p.wake = wake;
  p.replies = p.writer("rr" + name + "Reply", "std_srvs/srv/Trigger_Response", false, kDepth, hash);
  const dds::DataReader* requests =
      p.required(p.subscriber->create_datareader(
                     p.topic("rq" + name + "Request", "std_srvs/srv/Trigger_Request"),
                     Parts::reliable<dds::DataReaderQos>(false, kDepth, hash), &p),
                 name);
  p.node_writers.push_back(p.replies->guid());
  p.node_readers.push_back(requests->guid());
  p.announce_node();
}

std::shared_ptr<const DdsNode::Request> DdsNode::next_request() {
  const std::lock_guard lock(parts_->mutex);
  if (parts_->requests.empty()) return nullptr;
  auto request = parts_->requests.front();
  parts_->requests.pop_front();
  return request;
}

void DdsNode::reply(const Request& request, bool success, std::string_view message) {
  Bytes bytes(64 + message.size());
  CdrWriter out(bytes);
  out.raw(request.header).boolean(success).text(message);
  bytes.resize(out.size());
  rtps::WriteParams parameters;
  parameters.related_sample_identity(request.identity);
  parts_->replies->write(&bytes, parameters);
}

}  // namespace vergence::app::ros2
