#pragma once
#include <sys/socket.h>
#include <unistd.h>

#include "drivers/gige/detail/link.hpp"

namespace vergence::test {

/// Empty: a socket may hold enough here. Else the message to skip with.
inline std::string socket_buffer_obstacle() {
  // These bytes hold two images of 1280 x 960 and more.
  constexpr std::int64_t kEnough = 2 << 20;
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const std::int64_t got = fd < 0 ? 0 : gige::set_receive_buffer(fd, kEnough);
  if (fd >= 0) (void)::close(fd);
  return got >= kEnough
             ? ""
             : "receive buffers are too small here: sudo sysctl -w net.core.rmem_max=10485760";
}

}  // namespace vergence::test
