#pragma once
#include <functional>
#include <string>
#include <string_view>

#include "app/runtime/file_descriptor.hpp"

namespace vergence::app::ros2 {

/// A reader of the pose stream's Unix socket (docs/live_interface.md).
///
/// Threads  Not thread-safe: call from one thread. Nothing waits.
/// Memory   One line of at most kMaxLine bytes and the image that follows it, of at most kMaxImage
///          bytes; longer ones close the connection.
class PoseStreamClient {
 public:
  static constexpr std::size_t kMaxLine = std::size_t{64} << 10;    // bytes
  static constexpr std::size_t kMaxImage = std::size_t{128} << 20;  // bytes

  /// Receives a line without its line feed. Returns the number of bytes behind the line that are
  /// no lines: an image's.
  using OnLine = std::function<std::size_t(std::string_view line)>;
  /// Receives those bytes.
  using OnImage = std::function<void(std::string_view pixels)>;

  /// `address`: unix:///PATH. InputError: another form.
  explicit PoseStreamClient(std::string_view address);

  /// Returns 0 when there is a connection now, else errno.
  int connect();
  [[nodiscard]] bool connected() const noexcept { return static_cast<bool>(socket_); }
  /// Descriptor to poll; −1 without a connection.
  [[nodiscard]] int descriptor() const noexcept { return socket_.get(); }
  /// Hands over the complete lines and images that have arrived. False: the connection has ended.
  bool read(const OnLine& on_line, const OnImage& on_image);
  /// Sends a line, its line feed included. False: not sent.
  bool send(std::string_view line) noexcept;
  void close() noexcept;
  [[nodiscard]] const std::string& path() const noexcept { return path_; }

 private:
  std::string path_;
  FileDescriptor socket_;
  std::string rest_;            // the beginning of a line or an image
  std::size_t image_size_ = 0;  // bytes of the image that comes next; 0: a line comes next
};

}  // namespace vergence::app::ros2
