// A simulated XSens INS that rests in Brisbane, on a socket: the far end of an emulated machine's
// serial line.
//   xsens_on_socket PATH
// Connects (waiting up to a minute), and ends when the other side closes.
#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <chrono>
#include <cstdio>

#include "tests/support/xsens_terminal.hpp"

namespace {

int connect_to(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) return -1;
  path.copy(address.sun_path, path.size());
  for (int i = 0; i < 600; ++i) {
    const int line = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (line < 0) return -1;
    // A serial line buffers next to nothing: unread bytes are dropped.
    const int bytes = 1024;
    (void)::setsockopt(line, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
    if (::connect(line, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0)
      return line;
    ::close(line);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return -1;
}

}  // namespace

int main(int count, char** words) {
  if (count != 2) {
    std::fprintf(stderr, "xsens_on_socket: takes the path of a socket\n");
    return 2;
  }
  const int line = connect_to(words[1]);
  if (line < 0) {
    std::fprintf(stderr, "xsens_on_socket: nobody listens at %s\n", words[1]);
    return 1;
  }
  (void)::fcntl(line, F_SETFL, O_NONBLOCK);
  // The machine's power may be cut in the middle of a message.
  ::signal(SIGPIPE, SIG_IGN);
  const vergence::test::DeviceOnDescriptor sensor(line, vergence::test::resting_xsens());
  pollfd closed{line, 0, 0};
  while (::poll(&closed, 1, -1) < 0 || (closed.revents & (POLLHUP | POLLERR)) == 0) {
  }
}
