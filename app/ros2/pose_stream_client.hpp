#pragma once
#include <functional>
#include <string>
#include <string_view>

#include "app/runtime/file_descriptor.hpp"

namespace vergence::app::ros2 {

/// Reader of the pose stream's Unix socket (docs/live_interface.md). Not thread-safe. No call
/// blocks.
///
/// Holds one line of at most kMaxLine bytes and the following image of at most kMaxImage bytes;
/// longer ones close the connection.
class PoseStreamClient {
 public:
  /// In bytes.
  static constexpr std::size_t kMaxLine = std::size_t{64} << 10;
  /// In bytes.
  static constexpr std::size_t kMaxImage = std::size_t{128} << 20;

  /// Receives a line without its line feed. Returns the size of the image that follows the line, in
  /// bytes.
  using OnLine = std::function<std::size_t(std::string_view line)>;
  /// Receives the image.
  using OnImage = std::function<void(std::string_view pixels)>;

  /// `address` is unix:///PATH; throws InputError for another form.
  explicit PoseStreamClient(std::string_view address);

  /// Returns 0 if connected, else errno.
  int connect();
  [[nodiscard]] bool connected() const noexcept { return static_cast<bool>(socket_); }
  /// Descriptor to poll; −1 without a connection.
  [[nodiscard]] int descriptor() const noexcept { return socket_.get(); }
  /// Passes on the complete lines and images received. Returns false if the connection has ended.
  bool read(const OnLine& on_line, const OnImage& on_image);
  /// Sends a line including its line feed. Returns false if it was not sent.
  bool send(std::string_view line) noexcept;
  void close() noexcept;
  [[nodiscard]] const std::string& path() const noexcept { return path_; }

 private:
  std::string path_;
  FileDescriptor socket_;
  // Incomplete line or image.
  std::string rest_;
  // Size of the next image in bytes; 0 if a line is next.
  std::size_t image_size_ = 0;
};

}  // namespace vergence::app::ros2
