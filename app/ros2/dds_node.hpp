#pragma once
#include <memory>

#include "app/ros2/bridge.hpp"

namespace vergence::app::ros2 {

/// RIHS01 hash of a message type, which ROS 2 Iron and later read from an endpoint's USER_DATA.
/// Empty for a type that is not published.
[[nodiscard]] std::string_view type_hash(RosType type) noexcept;

/// DDS participant with ROS 2's names of topics, types and services. Not thread-safe; Fast DDS has
/// its own threads. The constructor, advertise() and serve() throw InputError if the domain cannot
/// be joined.
class DdsNode final : public TopicWriter {
 public:
  /// Opaque call of the service.
  struct Request;

  /// Uses multicast on all interfaces, or only on this machine if ROS_LOCALHOST_ONLY is 1 or
  /// ROS_AUTOMATIC_DISCOVERY_RANGE is LOCALHOST.
  ///
  /// `ros_distribution` announces the node /vergence_ros2 with its endpoints in the layout of that
  /// distribution, `humble` or later. If empty there is no announcement, because the wrong layout
  /// ends the discovery of Humble's nodes.
  DdsNode(std::uint32_t domain, const std::string& ros_distribution);
  ~DdsNode() override;

  void advertise(const std::string& topic, RosType type, bool latched) override;
  void publish(const std::string& topic, std::span<const std::uint8_t> cdr) override;

  /// Offers a service of type std_srvs/srv/Trigger. The eventfd `wake` is written for each request.
  /// Supports requests of rmw_fastrtps and rmw_cyclonedds.
  void serve_trigger(const std::string& name, int wake);
  /// Oldest waiting request; null if none. At most kMaxRequests wait; further ones are dropped, so
  /// their callers time out.
  [[nodiscard]] std::shared_ptr<const Request> next_request();
  void reply(const Request& request, bool success, std::string_view message);

  static constexpr std::size_t kMaxRequests = 16;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace vergence::app::ros2
