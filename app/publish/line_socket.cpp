#include "app/publish/line_socket.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <span>

#include "app/runtime/text_input.hpp"
#include "drivers/clock.hpp"

namespace vergence::app {

namespace {

/// Name of this machine for other computers.
std::string machine_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 && name[0] != 0 ? name.data()
                                                                          : "localhost";
}

// Robots have a handful of programs that read the pose.
constexpr std::size_t kReaders = 8;
// Patience with a reader that does not read.
constexpr Duration kPatience = Duration::seconds(5);
// Connections that may wait between two frames.
constexpr int kPending = 4;

/// Waits for events. The first one is that of an eventfd, which is reset.
void wait_for(std::span<pollfd> events, Duration timeout) noexcept {
  const auto ms = std::max<std::int64_t>(timeout.ns() / 1'000'000 + 1, 0);
  if (::poll(events.data(), events.size(), static_cast<int>(ms)) < 0)
    for (pollfd& event : events) event.revents = 0;
  eventfd_t ignored = 0;
  if (events[0].revents != 0) (void)::eventfd_read(events[0].fd, &ignored);
}

/// Removes a stale socket file of a killed program.
void remove_stale(const sockaddr_un& address, std::string_view key) {
  struct stat status {};
  if (::lstat(address.sun_path, &status) != 0) return;
  if (!S_ISSOCK(status.st_mode))
    throw InputError("{}: {} exists and is not a socket; choose another path", key,
                     address.sun_path);
  const FileDescriptor probe(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (::connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ||
      errno == EAGAIN)
    throw InputError("{}: another program publishes at {}; choose another path", key,
                     address.sun_path);
  // Only ECONNREFUSED proves that no program listens. A datagram socket or one of another user may
  // be in use.
  if (errno == ECONNREFUSED)
    (void)::unlink(address.sun_path);
  else if (errno != ENOENT)
    throw InputError("{}: {} is a socket of another program ({}); choose another path", key,
                     address.sun_path, std::strerror(errno));
}

/// A stream socket, so that up to kReaders readers can connect and disconnect without own
/// addresses. A line ends with a line feed.
class UnixLineSocket final : public LineSocket {
 public:
  UnixLineSocket(const std::string& path, std::string_view key) : path_(path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    remove_stale(address, key);
    listener_ = FileDescriptor(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    if (!listener_ ||
        ::bind(listener_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
        // The mode must not depend on the umask.
        ::chmod(address.sun_path, S_IRUSR | S_IWUSR | S_IRGRP | S_IWGRP) != 0 ||
        ::listen(listener_.get(), kPending) != 0)
      throw InputError(
          "{}: the socket {} cannot be created ({}); check that its directory exists and is "
          "writable",
          key, path, std::strerror(errno));
    bound_ = true;
  }
  ~UnixLineSocket() override {
    if (bound_) (void)::unlink(path_.c_str());
  }

  void send(std::string_view line) noexcept override {
    const HostStamp now = monotonic_now();
    for (Reader& reader : readers_)
      if (reader.socket && !reader.copies_images()) send(line, now, &reader);
  }
  void greet(std::string lines) noexcept override {
    greeting_ = std::move(lines);
    const HostStamp now = monotonic_now();
    for (Reader& reader : readers_) {
      reader.greeted = reader.copies_images();
      if (reader.socket) flush(now, &reader);
    }
  }
  void wait(int wake, Duration timeout, const Answer& answer) noexcept override {
    const HostStamp now = monotonic_now();
    std::array<pollfd, 2 + kReaders> events{};
    events[0] = {wake, POLLIN, 0};
    events[1] = {now >= accept_again_ ? listener_.get() : -1, POLLIN, 0};
    for (std::size_t i = 0; i < kReaders; ++i) {
      Reader& reader = readers_[i];
      if (reader.copies_images() && !reader.rest.empty() && now - reader.progress >= kPatience)
        close(&reader);
      // A reader's next request is read after the response to the previous one was sent.
      const short event = !reader.rest.empty() ? short{POLLOUT}
                          : reader.asks        ? short{POLLIN}
                                               : short{0};
      events[2 + i] = {reader.socket.get(), event, 0};
    }
    wait_for(events, timeout);
    for (std::size_t i = 0; i < kReaders; ++i) {
      if ((events[2 + i].revents & POLLOUT) != 0)
        flush(monotonic_now(), &readers_[i]);
      else if (events[2 + i].revents != 0)
        read_requests(events[2 + i].revents, answer, &readers_[i]);
    }
    if (events[1].revents != 0) accept_readers();
  }
  [[nodiscard]] bool wants_images() const noexcept override {
    const HostStamp now = monotonic_now();
    return std::ranges::any_of(readers_,
                               [now](const Reader& reader) { return reader.image_due(now); });
  }
  void send_images(std::string_view bytes) noexcept override {
    const HostStamp now = monotonic_now();
    for (Reader& reader : readers_) {
      if (!reader.image_due(now)) continue;
      reader.rest = bytes;
      // The rate holds on average, but a long delay is not compensated.
      reader.next_image =
          std::max(reader.next_image + reader.image_interval, now + reader.image_interval / 2);
      ++counters_.images;
      flush(now, &reader);
    }
  }
  [[nodiscard]] LineSocketCounters counters() const noexcept override { return counters_; }

 private:
  struct Reader {
    FileDescriptor socket;
    // Unsent rest of lines; the next line waits for it.
    std::string rest;
    // True if the newest greeting was sent or is in `rest`.
    bool greeted = false;
    // True until the reader closes its side.
    bool asks = true;
    // Incomplete request.
    std::string asked;
    // Time at which the reader last accepted data.
    HostStamp progress{};
    // If positive, the reader gets images instead of lines.
    Duration image_interval{};
    HostStamp next_image{};

    [[nodiscard]] bool copies_images() const noexcept { return image_interval > Duration{}; }
    [[nodiscard]] bool image_due(HostStamp now) const noexcept {
      return socket && copies_images() && rest.empty() && now >= next_image;
    }
  };

  void accept_readers() noexcept {
    for (int i = 0; i < kPending; ++i) {
      FileDescriptor socket(
          ::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
      const HostStamp now = monotonic_now();
      if (!socket) {
        // Without free descriptors the pending connection would wake this thread continuously.
        if (errno != EAGAIN && errno != EINTR) accept_again_ = now + Duration::seconds(1);
        return;
      }
      Reader* free = nullptr;
      for (Reader& reader : readers_)
        if (!reader.socket) free = &reader;
      if (free == nullptr) {
        ++counters_.turned_away;
        continue;
      }
      ++counters_.readers;
      *free = Reader{};
      free->socket = std::move(socket);
      free->progress = now;
      flush(now, free);
    }
  }

  /// Returns the number of sent bytes; −1 if the reader has disconnected.
  static ssize_t write(const Reader& reader, std::string_view bytes) noexcept {
    const ssize_t n =
        ::send(reader.socket.get(), bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (n >= 0) return n;
    return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR ? 0 : -1;
  }

  /// Sends pending data while the reader has room: the rest of a line, then a greeting.
  void flush(HostStamp now, Reader* reader) noexcept {
    while (!reader->rest.empty() || !reader->greeted) {
      if (reader->rest.empty()) {
        reader->rest = greeting_;
        reader->greeted = true;
        continue;
      }
      const ssize_t n = write(*reader, reader->rest);
      if (n < 0) return reader->socket.reset();
      if (n == 0) return;
      reader->progress = now;
      reader->rest.erase(0, static_cast<std::size_t>(n));
    }
  }

  void send(std::string_view line, HostStamp now, Reader* reader) noexcept {
    flush(now, reader);
    if (!reader->socket) return;
    const ssize_t n = reader->rest.empty() ? write(*reader, line) : 0;
    if (n < 0) return reader->socket.reset();
    if (n > 0) {
      reader->progress = now;
      reader->rest = line.substr(static_cast<std::size_t>(n));
      ++counters_.sent;
      return;
    }
    ++counters_.refused;
    if (now - reader->progress >= kPatience) close(reader);
  }

  /// Ends the connection of a reader that does not read.
  void close(Reader* reader) noexcept {
    ++counters_.closed;
    reader->socket.reset();
  }

  /// Reads a reader's requests and answers complete lines.
  void read_requests(short events, const Answer& answer, Reader* reader) noexcept {
    // In bytes.
    constexpr std::size_t kMaxRequest = 512;
    std::array<char, kMaxRequest> bytes;
    const ssize_t n = reader->asks && reader->rest.empty()
                          ? ::recv(reader->socket.get(), bytes.data(), bytes.size(), MSG_DONTWAIT)
                          : 0;
    if (n == 0) reader->asks = false;
    if (n <= 0 && ((events & (POLLHUP | POLLERR)) != 0 || (n < 0 && errno != EAGAIN)))
      return reader->socket.reset();
    if (n <= 0) return;
    reader->asked.append(bytes.data(), static_cast<std::size_t>(n));
    for (std::size_t end; (end = reader->asked.find('\n')) != std::string::npos;) {
      LineResponse response = answer(std::string_view(reader->asked).substr(0, end));
      reader->rest += response.line;
      if (response.image_interval > Duration{}) reader->image_interval = response.image_interval;
      reader->asked.erase(0, end + 1);
    }
    if (reader->asked.size() >= kMaxRequest) return reader->socket.reset();
    flush(monotonic_now(), reader);
  }

  std::string path_;
  FileDescriptor listener_;
  HostStamp accept_again_{};
  std::string greeting_;
  bool bound_ = false;
  std::array<Reader, kReaders> readers_{};
  LineSocketCounters counters_{};
};

class UdpLineSocket final : public LineSocket {
 public:
  UdpLineSocket(const HostPort& address, std::string_view key) {
    const auto found = resolve(address, SOCK_DGRAM, [&](const char* reason) {
      return InputError("{}: the host {} is unknown ({}); write its IP address, e.g. 127.0.0.1:{}",
                        key, address.host, reason, address.port);
    });
    socket_ =
        FileDescriptor(::socket(found->ai_family, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    if (!socket_ || ::connect(socket_.get(), found->ai_addr, found->ai_addrlen) != 0)
      throw InputError("{}: {} cannot be reached ({}); check the network", key, address.text(),
                       std::strerror(errno));
  }

  void greet(std::string lines) noexcept override {
    for (std::size_t begin = 0, end; (end = lines.find('\n', begin)) != std::string::npos;
         begin = end + 1)
      send(std::string_view(lines).substr(begin, end + 1 - begin));
  }
  void wait(int wake, Duration timeout, const Answer& /*answer*/) noexcept override {
    std::array<pollfd, 1> events{{{wake, POLLIN, 0}}};
    wait_for(events, timeout);
  }
  void send(std::string_view line) noexcept override {
    if (::send(socket_.get(), line.data(), line.size(), MSG_DONTWAIT | MSG_NOSIGNAL) ==
        static_cast<ssize_t>(line.size()))
      ++counters_.sent;
    else
      ++counters_.refused;
  }
  [[nodiscard]] LineSocketCounters counters() const noexcept override { return counters_; }

 private:
  FileDescriptor socket_;
  LineSocketCounters counters_{};
};

}  // namespace

bool HostPort::loopback() const {
  return host == "localhost" || host == "::1" ||
         (host.starts_with("127.") && host.find_first_not_of("0123456789.") == std::string::npos);
}

std::string HostPort::text() const {
  return host.find(':') == std::string::npos ? fmt::format("{}:{}", host, port)
                                             : fmt::format("[{}]:{}", host, port);
}

HostPort HostPort::link() const {
  return host == "0.0.0.0" || host == "::" ? HostPort{machine_name(), port} : *this;
}

std::unique_ptr<addrinfo, void (*)(addrinfo*)> resolve(
    const HostPort& address, int type,
    const std::function<InputError(const char* reason)>& refuse) {
  addrinfo hints{}, *found = nullptr;
  hints.ai_socktype = type;
  hints.ai_flags = AI_PASSIVE;
  const int error =
      ::getaddrinfo(address.host.c_str(), std::to_string(address.port).c_str(), &hints, &found);
  if (error != 0) throw refuse(::gai_strerror(error));
  return {found, ::freeaddrinfo};
}

HostPort parse_host_port(std::string_view text, std::string_view key) {
  const auto colon = std::min(text.rfind(':'), text.size());
  std::string_view host = text.substr(0, colon);
  const std::string_view digits = text.substr(std::min(colon + 1, text.size()));
  const bool bracketed = host.size() > 2 && host.front() == '[' && host.back() == ']';
  if (bracketed) host = host.substr(1, host.size() - 2);
  std::uint16_t port = 0;
  if (host.empty() || bracketed != (host.find(':') != std::string_view::npos) ||
      !parse_whole(digits, &port) || port == 0)
    throw InputError(
        "{}: \"{}\" is not an address; write HOST:PORT, e.g. 127.0.0.1:8080 or [::1]:8080", key,
        text.substr(0, 120));
  return {std::string(host), port};
}

LineAddress parse_line_address(std::string_view text, std::string_view key) {
  constexpr std::string_view kUnix = "unix://", kUdp = "udp://";
  LineAddress out;
  if (text.starts_with(kUdp)) {
    out.kind = LineAddress::Kind::udp;
    out.udp = parse_host_port(text.substr(kUdp.size()), key);
    return out;
  }
  if (!text.starts_with(kUnix))
    throw InputError("{}: \"{}\" is not an address; write unix:///PATH or udp://HOST:PORT", key,
                     text.substr(0, 120));
  out.path = text.substr(kUnix.size());
  if (!out.path.starts_with('/') || out.path.find('\0') != std::string::npos ||
      out.path.size() >= sizeof(sockaddr_un::sun_path))
    throw InputError("{}: the path of the socket must begin with / and have at most {} bytes", key,
                     sizeof(sockaddr_un::sun_path) - 1);
  return out;
}

std::unique_ptr<LineSocket> open_line_socket(const LineAddress& address, std::string_view key) {
  if (address.kind == LineAddress::Kind::udp)
    return std::make_unique<UdpLineSocket>(address.udp, key);
  return std::make_unique<UnixLineSocket>(address.path, key);
}

}  // namespace vergence::app
