// vergence-ros2: the pose stream of a running vergence as ROS 2 topics (docs/ros2.md).
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <deque>
#include <exception>
#include <numbers>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include "app/ros2/dds_node.hpp"
#include "app/runtime/file_descriptor.hpp"
#include "app/runtime/signals.hpp"
#include "app/runtime/version.hpp"
#include "core/comparison/comparison.hpp"

namespace vergence::app::ros2 {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

struct Options {
  std::string socket = "unix:///run/vergence/pose.sock";
  std::uint32_t domain = 0;
  BridgeOptions bridge{};
  std::string child = "base", ros_distribution{};
  double image_rate_hz = 0;
  std::array<double, 3> camera_xyz_m{}, camera_rpy_deg{};
};

void declare(CLI::App* app, Options* o) {
  // Ports of a domain beyond 232 are above 65535.
  constexpr std::uint32_t kMaxDomain = 232;
  BridgeOptions& b = o->bridge;
  app->set_version_flag("--version", "vergence-ros2 " + std::string(version()));
  app->add_option("--socket", o->socket, "Address of the pose stream: unix:///PATH")
      ->capture_default_str();
  app->add_option("--domain", o->domain, "DDS domain")
      ->envname("ROS_DOMAIN_ID")
      ->check(CLI::Range(std::uint32_t{0}, kMaxDomain))
      ->capture_default_str();
  app->add_option("--namespace", b.name_space, "Namespace of the topics, like /robot1/vergence")
      ->capture_default_str();
  app->add_option("--odom-frame", b.odom_frame, "Parent frame of the odometry")
      ->capture_default_str();
  app->add_option("--base-frame", b.base_frame, "Frame of the vehicle")->capture_default_str();
  app->add_option("--enu-frame", b.enu_frame, "Frame of pose_enu")->capture_default_str();
  app->add_option("--child", o->child, "Child of the odometry: base, or camera (left, optical)")
      ->check(CLI::IsMember({"base", "camera"}))
      ->capture_default_str();
  app->add_option("--camera-xyz-m", o->camera_xyz_m,
                  "Position of the left camera in the base frame")
      ->type_name("X Y Z");
  app->add_option("--camera-rpy-deg", o->camera_rpy_deg,
                  "Roll, pitch and yaw of the camera's forward, left, up axes in the base frame")
      ->type_name("R P Y");
  app->add_option("--image-rate-hz", o->image_rate_hz,
                  "Publish images of the left and right camera at this rate; 0: none")
      ->check(CLI::Range(0.0, 200.0))
      ->capture_default_str();
  app->add_option("--ros-distro", o->ros_distribution,
                  "ROS 2 distribution of the readers: announces the node to it")
      ->envname("ROS_DISTRO");
  app->add_flag("!--no-tf", b.publish_tf, "Do not publish odom -> child on /tf");
}

void finish(Options* o) {
  // The pose stream does not accept a lower rate.
  if (o->image_rate_hz > 0 && o->image_rate_hz < 0.01)
    throw InputError("--image-rate-hz {:g}: must be 0 or 0.01 to 200", o->image_rate_hz);
  std::string& space = o->bridge.name_space;
  if (!space.starts_with('/')) space.insert(0, "/");
  while (space.ends_with('/')) space.pop_back();
  for (const char c : space)
    if (!(c == '/' || c == '_' || (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') ||
          (c >= 'A' && c <= 'Z')))
      throw InputError("--namespace: \"{}\" is not a ROS name; use letters, digits, _ and /",
                       space);
  o->bridge.images = o->image_rate_hz > 0;
  o->bridge.camera_child = o->child == "camera";
  const auto& x = o->camera_xyz_m;
  const auto& r = o->camera_rpy_deg;
  o->bridge.T_base_left =
      mount_of({x[0], x[1], x[2]}, Vec3(r[0], r[1], r[2]) * (std::numbers::pi / 180));
}

/// Reader of the pose stream's Unix socket (docs/live_interface.md). No call blocks.
///
/// Holds one line of at most kMaxLine bytes and the following image of at most kMaxImage bytes;
/// longer ones close the connection.
class PoseStreamClient {
 public:
  // In bytes.
  static constexpr std::size_t kMaxLine = std::size_t{64} << 10;
  static constexpr std::size_t kMaxImage = std::size_t{128} << 20;

  /// `address` is unix:///PATH; throws InputError for another form.
  explicit PoseStreamClient(std::string_view address) {
    constexpr std::string_view kUnix = "unix://";
    if (address.starts_with(kUnix)) path_ = address.substr(kUnix.size());
    if (!path_.starts_with('/') || path_.size() >= sizeof(sockaddr_un::sun_path))
      throw InputError(
          "--socket: \"{}\" is not unix:///PATH of at most {} bytes; give the address of "
          "publish.pose_stream",
          address.substr(0, 120), sizeof(sockaddr_un::sun_path) - 1);
  }

  /// Returns 0 if connected, else errno.
  int connect() {
    close();
    FileDescriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.copy(address.sun_path, sizeof address.sun_path - 1);
    if (::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
      return errno;
    socket_ = std::move(socket);
    return 0;
  }
  [[nodiscard]] bool connected() const noexcept { return static_cast<bool>(socket_); }
  /// Descriptor to poll; −1 without a connection.
  [[nodiscard]] int descriptor() const noexcept { return socket_.get(); }
  /// Passes on the complete lines and images received: `on_line` gets a line without its line feed
  /// and returns the size of the image that follows it, in bytes. Returns false if the connection
  /// has ended.
  template <class OnLine, class OnImage>
  bool read(const OnLine& on_line, const OnImage& on_image) {
    std::array<char, 65536> bytes;
    const ssize_t n = ::recv(socket_.get(), bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (n < 0 && (errno == EAGAIN || errno == EINTR)) return true;
    if (n <= 0) {
      close();
      return false;
    }
    rest_.append(bytes.data(), static_cast<std::size_t>(n));
    std::string_view rest = rest_;
    for (;;) {
      const std::size_t end = image_size_ > 0 ? image_size_ : rest.find('\n');
      // This includes npos.
      if (end > rest.size()) break;
      if (image_size_ > 0) {
        image_size_ = 0;
        on_image(rest.substr(0, end));
        rest.remove_prefix(end);
      } else {
        image_size_ = on_line(rest.substr(0, end));
        rest.remove_prefix(end + 1);
      }
    }
    rest_.erase(0, rest_.size() - rest.size());
    if (image_size_ > 0 ? image_size_ <= kMaxImage : rest_.size() <= kMaxLine) return true;
    close();
    return false;
  }
  /// Sends a line including its line feed. Returns false if it was not sent.
  bool send(std::string_view line) noexcept {
    return connected() && ::send(socket_.get(), line.data(), line.size(),
                                 MSG_DONTWAIT | MSG_NOSIGNAL) == static_cast<ssize_t>(line.size());
  }
  void close() noexcept {
    socket_.reset();
    rest_.clear();
    image_size_ = 0;
  }
  [[nodiscard]] const std::string& path() const noexcept { return path_; }

 private:
  std::string path_;
  FileDescriptor socket_;
  // Incomplete line or image.
  std::string rest_;
  // Size of the next image in bytes; 0 if a line is next.
  std::size_t image_size_ = 0;
};

/// Main loop: reads the stream, publishes topics and forwards service calls.
///
/// Threads  One. Fast DDS's threads write to an eventfd.
class Program {
 public:
  explicit Program(const Options& options)
      : client_(options.socket),
        images_(options.socket),
        image_rate_hz_(options.image_rate_hz),
        node_(options.domain, options.ros_distribution),
        bridge_(options.bridge, &node_),
        wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    node_.serve_trigger(options.bridge.name_space + "/recalibrate", wake_.get());
  }
  ~Program() {
    while (!calls_.empty()) answer({false, "vergence-ros2 is stopping"});
  }

  ExitCode run() {
    const SignalGuard signals;
    for (;;) {
      if (const auto code = signals.stop_code()) return *code;
      const Clock::time_point now = Clock::now();
      if (!client_.connected() && now >= connect_at_) connect(now);
      if (now >= stale_at_) {
        stale_at_ = now + 1s;
        bridge_.publish_stale(wall_clock(), client_.connected() ? "no status from vergence"
                                                                : "vergence is not running");
      }
      // Long enough to cost nothing, and short enough for a signal that arrives just before poll().
      constexpr int kTimeoutMs = 200;
      std::array<pollfd, 3> events{{{client_.descriptor(), POLLIN, 0},
                                    {wake_.get(), POLLIN, 0},
                                    {images_.descriptor(), POLLIN, 0}}};
      if (::poll(events.data(), events.size(), kTimeoutMs) <= 0) continue;
      if (events[1].revents != 0) serve_calls();
      if (events[0].revents != 0 && !read()) lose();
      if (events[2].revents != 0) read_images();
    }
  }

 private:
  static Stamp wall_clock() {
    return Stamp(
        std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count());
  }

  void connect(Clock::time_point now) {
    connect_at_ = now + 500ms;
    const int error = client_.connect();
    if (error == 0) {
      fmt::print(stderr, "vergence-ros2: connected to {}\n", client_.path());
      waiting_reported_ = false;
    } else if (!waiting_reported_) {
      fmt::print(
          stderr,
          "vergence-ros2: {}: {}; waiting for vergence with publish.pose_stream: unix://{}\n",
          client_.path(), std::strerror(error), client_.path());
      waiting_reported_ = true;
    }
  }

  bool read() {
    const auto on_line = [this](std::string_view line) -> std::size_t {
      const std::uint64_t malformed = bridge_.malformed(), statuses = bridge_.statuses();
      if (const auto response = bridge_.add(line)) answer(*response);
      if (bridge_.statuses() > statuses) {
        stale_at_ = Clock::now() + 3s;
        request_images();
      }
      if (malformed == 0 && bridge_.malformed() > 0)
        fmt::print(stderr,
                   "vergence-ros2: a malformed line was skipped; further ones are only counted in "
                   "/diagnostics\n");
      return 0;
    };
    return client_.read(on_line, [](std::string_view) {});
  }

  /// Images use a separate connection, so that poses do not wait behind them.
  void request_images() {
    if (image_rate_hz_ <= 0 || images_.connected() || images_.connect() != 0) return;
    (void)images_.send(
        fmt::format("{{\"request\": \"images\", \"rate_hz\": {}}}\n", image_rate_hz_));
  }

  void read_images() {
    (void)images_.read([this](std::string_view line) { return bridge_.begin_image(line); },
                       [this](std::string_view pixels) { bridge_.end_image(pixels); });
  }

  void lose() {
    fmt::print(stderr, "vergence-ros2: the pose stream has ended; waiting for vergence\n");
    waiting_reported_ = true;
    bridge_.disconnected();
    images_.close();
    while (!calls_.empty()) answer({false, "vergence has ended"});
    stale_at_ = Clock::now();
  }

  void serve_calls() {
    eventfd_t ignored = 0;
    (void)::eventfd_read(wake_.get(), &ignored);
    while (auto call = node_.next_request()) {
      calls_.push_back(std::move(call));
      if (!client_.send("{\"request\": \"recalibrate\"}\n")) {
        const auto refused = std::move(calls_.back());
        calls_.pop_back();
        node_.reply(*refused, false, "vergence is not running");
      }
    }
  }

  /// Responses come in the order of their requests.
  void answer(const Bridge::Response& response) {
    if (calls_.empty()) return;
    node_.reply(*calls_.front(), response.accepted, response.message);
    calls_.pop_front();
  }

  PoseStreamClient client_, images_;
  const double image_rate_hz_;
  DdsNode node_;
  Bridge bridge_;
  FileDescriptor wake_;
  std::deque<std::shared_ptr<const DdsNode::Request>> calls_;
  Clock::time_point connect_at_{}, stale_at_ = Clock::now() + 3s;
  bool waiting_reported_ = false;
};

ExitCode run(int argc, char** argv) {
  CLI::App app("Publish the pose stream of vergence as ROS 2 topics", "vergence-ros2");
  Options options;
  declare(&app, &options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {
    // These are --help and --version.
    app.exit(asked);
    return ExitCode::done;
  } catch (const CLI::ParseError& error) {
    throw InputError(std::string(error.what()) + "; see vergence-ros2 --help");
  }
  finish(&options);
  Program program(options);
  return program.run();
}

}  // namespace
}  // namespace vergence::app::ros2

int main(int argc, char** argv) {
  using vergence::app::ExitCode;
  try {
    return static_cast<int>(vergence::app::ros2::run(argc, argv));
  } catch (const std::exception& e) {
    fmt::print(stderr, "vergence-ros2: {}\n", e.what());
    return static_cast<int>(ExitCode::bad_input);
  }
}
