#pragma once
#include <functional>
#include <string>
#include <string_view>

#include "app/runtime/file_descriptor.hpp"

namespace vergence::app::ros2 {

/// A reader of the pose stream's Unix socket (docs/live_interface.md).
///
/// Threads  Not thread-safe: call from one thread. Nothing waits.
/// Memory   One line of at most kMaxLine bytes; a longer one closes the connection.
class PoseStreamClient {
 public:
  static constexpr std::size_t kMaxLine = std::size_t{64} << 10;  // bytes

  /// `address`: unix:///PATH. InputError: another form.
  explicit PoseStreamClient(std::string_view address);

  /// Returns 0 when there is a connection now, else errno.
  int connect();
  [[nodiscard]] bool connected() const noexcept { return static_cast<bool>(socket_); }
  /// Descriptor to poll; −1 without a connection.
  [[nodiscard]] int descriptor() const noexcept { return socket_.get(); }
  /// Hands over the complete lines that have arrived, without their line feeds. False: the
  /// connection has ended.
  bool read(const std::function<void(std::string_view)>& on_line);
  /// Sends a line, its line feed included. False: not sent.
  bool send(std::string_view line) noexcept;
  void close() noexcept;
  [[nodiscard]] const std::string& path() const noexcept { return path_; }

 private:
  std::string path_;
  FileDescriptor socket_;
  std::string rest_;  // the beginning of a line
};

}  // namespace vergence::app::ros2
