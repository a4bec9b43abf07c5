#include "app/ros2/pose_stream_client.hpp"

#include <sys/socket.h>
#include <sys/un.h>

#include <array>
#include <cerrno>

#include <fmt/format.h>

#include "app/runtime/errors.hpp"

namespace vergence::app::ros2 {

PoseStreamClient::PoseStreamClient(std::string_view address) {
  constexpr std::string_view kUnix = "unix://";
  if (address.starts_with(kUnix)) path_ = address.substr(kUnix.size());
  if (!path_.starts_with('/') || path_.size() >= sizeof(sockaddr_un::sun_path))
    throw InputError(
        fmt::format("--socket: \"{}\" is not unix:///PATH of at most {} bytes; give the address of "
                    "publish.pose_stream",
                    address.substr(0, 120), sizeof(sockaddr_un::sun_path) - 1));
}

int PoseStreamClient::connect() {
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

bool PoseStreamClient::read(const OnLine& on_line, const OnImage& on_image) {
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

bool PoseStreamClient::send(std::string_view line) noexcept {
  return connected() && ::send(socket_.get(), line.data(), line.size(),
                               MSG_DONTWAIT | MSG_NOSIGNAL) == static_cast<ssize_t>(line.size());
}

void PoseStreamClient::close() noexcept {
  socket_.reset();
  rest_.clear();
  image_size_ = 0;
}

}  // namespace vergence::app::ros2
