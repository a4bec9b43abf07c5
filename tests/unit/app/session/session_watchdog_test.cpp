#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/session/waiting_source.hpp"

namespace vergence::app {
namespace {

using namespace std::chrono_literals;

enum class Hangs { nothing, devices, estimator, halt };

class Drive final : public test::WaitingSource {
 public:
  explicit Drive(Hangs hangs)
      : WaitingSource(hangs == Hangs::estimator || hangs == Hangs::halt ? 0ms : 1s), hangs_(hangs) {
    frames_ = hangs == Hangs::estimator ? 1 : 0;
  }
  void halt() noexcept override { std::this_thread::sleep_for(hangs_ == Hangs::halt ? 1s : 0s); }
  void done(const PoseSample& /*sample*/) noexcept override { std::this_thread::sleep_for(1s); }
  void look() override { rounds_ += hangs_ == Hangs::devices ? 0 : 1; }
  [[nodiscard]] std::uint64_t rounds() const noexcept override { return rounds_; }

 private:
  const Hangs hangs_;
  std::uint64_t rounds_ = 1;  // of the thread that calls look() and asks
};

constexpr const char* kOfTheLoop = "WATCHDOG=1\nSTATUS=";
constexpr const char* kOfTheEnd = "WATCHDOG=1\nEXTEND_TIMEOUT_USEC=";

/// The signs of life that systemd hears of a drive of a second, with a watchdog that wants
/// five: the socket's queue has room for ten.
int signs_of_life(Hangs hangs, const char* sign = kOfTheLoop) {
  const test::TemporaryFolder folder;
  const std::string path = (folder / "notify").string();
  const int fd = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  EXPECT_EQ(::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ::setenv("NOTIFY_SOCKET", path.c_str(), 1);
  ::setenv("WATCHDOG_USEC", "600000", 1);

  Drive source(hangs);
  SessionOptions options;
  options.out = folder / "session";
  options.quiet = true;
  const SignalGuard signals;
  testing::internal::CaptureStderr();
  (void)run_session(source, load_configuration(std::nullopt, {}), options, signals);
  (void)testing::internal::GetCapturedStderr();
  ::unsetenv("NOTIFY_SOCKET");
  ::unsetenv("WATCHDOG_USEC");

  int signs = 0;
  std::array<char, 256> text{};
  for (ssize_t n = 0; (n = ::recv(fd, text.data(), text.size(), 0)) > 0;)
    signs += std::string_view(text.data(), static_cast<std::size_t>(n)).starts_with(sign) ? 1 : 0;
  (void)::close(fd);
  return signs;
}

TEST(SessionWatchdog, hearsOfALoopThatWaitsWhileTheDevicesThreadGoesRoundAndOfNoOther) {
  EXPECT_GE(signs_of_life(Hangs::nothing), 3);
  EXPECT_LE(signs_of_life(Hangs::devices), 1) << "of their first round";
  EXPECT_LE(signs_of_life(Hangs::estimator), 1) << "of the frame that it hangs at";
}

TEST(SessionWatchdog, hearsThatTheDriveIsOverWhileCamerasAreSlowToStop) {
  EXPECT_GE(signs_of_life(Hangs::halt, kOfTheEnd), 5);
}

}  // namespace
}  // namespace vergence::app
