#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "app/ros2/bridge.hpp"

namespace vergence::app::ros2 {

/// RIHS01 hash of a message type, which ROS 2 Iron and later read from an endpoint's USER_DATA.
/// Empty: a type that is not published.
[[nodiscard]] std::string_view type_hash(RosType type) noexcept;

/// A DDS participant with ROS 2's names of topics, types and services.
///
/// Threads  Fast DDS has its own; calls come from one thread.
/// Errors   The constructor, advertise() and serve() throw InputError: the domain cannot be joined.
class DdsNode final : public TopicWriter {
 public:
  /// A call of the service. Opaque.
  struct Request;

  /// Multicast on all interfaces, or only on this machine where ROS_LOCALHOST_ONLY is 1 or
  /// ROS_AUTOMATIC_DISCOVERY_RANGE is LOCALHOST.
  ///
  /// `ros_distribution`: announces the node /vergence_ros2 with its endpoints in the layout of that
  /// distribution, `humble` or a later one. Empty: no announcement, because the wrong layout ends
  /// the discovery of Humble's nodes.
  DdsNode(std::uint32_t domain, const std::string& ros_distribution);
  ~DdsNode() override;
  DdsNode(const DdsNode&) = delete;
  DdsNode& operator=(const DdsNode&) = delete;

  void advertise(const std::string& topic, RosType type, bool latched) override;
  void publish(const std::string& topic, std::span<const std::uint8_t> cdr) override;

  /// A service of type std_srvs/srv/Trigger. `wake`, an eventfd, is written to when a request has
  /// come. Requests of rmw_fastrtps and of rmw_cyclonedds are understood.
  void serve_trigger(const std::string& name, int wake);
  /// The oldest request that waits; null: none. At most kMaxRequests wait; further ones are dropped
  /// and their callers time out.
  [[nodiscard]] std::shared_ptr<const Request> next_request();
  void reply(const Request& request, bool success, std::string_view message);

  static constexpr std::size_t kMaxRequests = 16;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace vergence::app::ros2
