#include "app/runtime/service_manager.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

using namespace std::chrono_literals;

/// Messages that systemd would receive.
class Manager {
 public:
  explicit Manager(const std::filesystem::path& path)
      : fd_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    EXPECT_EQ(::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  ~Manager() { ::close(fd_); }
  /// The next datagram; empty: there is none.
  std::string heard() {
    std::array<char, 256> text;
    const ssize_t n = ::recv(fd_, text.data(), text.size(), 0);
    return n > 0 ? std::string(text.data(), static_cast<std::size_t>(n)) : "";
  }
  /// The next datagram, waiting for it; empty: none in ten seconds.
  std::string awaited() {
    pollfd p{fd_, POLLIN, 0};
    return ::poll(&p, 1, 10'000) > 0 ? heard() : "";
  }

 private:
  int fd_;
};

struct ServiceManagerTest : testing::Test {
  ~ServiceManagerTest() override {
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC"}) ::unsetenv(name);
  }
  /// As systemd starts it; watchdog 0: no sign of life is wanted.
  ServiceManager started(std::chrono::microseconds watchdog) const {
    ::setenv("NOTIFY_SOCKET", path.c_str(), 1);
    if (watchdog.count() > 0)
      ::setenv("WATCHDOG_USEC", std::to_string(watchdog.count()).c_str(), 1);
    return ServiceManager();
  }

  test::TemporaryFolder folder;
  std::filesystem::path path = folder / "notify";
  Manager manager{path};
  std::chrono::steady_clock::time_point begin{};
};

TEST_F(ServiceManagerTest, reportsReadyThenStoppingWithMoreTime) {
  constexpr const char* kMoreTime = "WATCHDOG=1\nEXTEND_TIMEOUT_USEC=60000000";
  {
    ServiceManager service = started(30ms);
    service.ready();
    EXPECT_EQ(manager.heard(), "READY=1");
    service.stopping();
    EXPECT_EQ(manager.awaited(), "STOPPING=1\nWATCHDOG=1");
    for (int i = 0; i < 3; ++i) EXPECT_EQ(manager.awaited(), kMoreTime) << i;
  }
  while (!manager.heard().empty()) {
  }
  std::this_thread::sleep_for(50ms);
  EXPECT_EQ(manager.heard(), "") << "it goes on after the end";
}

TEST_F(ServiceManagerTest, slowLoopIsAliveHungLoopIsNot) {
  ServiceManager service = started(9s);
  for (int second = 0; second < 9; ++second)
    service.alive(static_cast<std::uint64_t>(second + 1), false, 0, begin + second * 1s);
  // Three signs in nine seconds.
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(manager.heard().starts_with("WATCHDOG=1\nSTATUS=")) << i;
  EXPECT_EQ(manager.heard(), "");
  for (int second = 9; second < 60; ++second)
    service.alive(9, false, static_cast<std::uint64_t>(second), begin + second * 1s);
  EXPECT_TRUE(manager.heard().starts_with("WATCHDOG=1")) << "of what was handled before it hung";
  EXPECT_EQ(manager.heard(), "") << "whatever the devices do";
}

TEST_F(ServiceManagerTest, waitingLoopIsAliveWithItsDevices) {
  ServiceManager service = started(3s);
  for (int second = 0; second < 10; ++second)
    service.alive(7, true, static_cast<std::uint64_t>(second), begin + second * 1s);
  for (int i = 0; i < 9; ++i) EXPECT_NE(manager.heard(), "") << i;
  while (!manager.heard().empty()) {
  }
  for (int second = 10; second < 20; ++second) service.alive(7, true, 9, begin + second * 1s);
  EXPECT_EQ(manager.heard(), "") << "a device holds that thread up";
}

}  // namespace
}  // namespace vergence::app
