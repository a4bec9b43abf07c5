// The driver, and the image that is flashed, in an emulated machine.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <set>
#include <stdexcept>
#include <thread>

#include "drivers/serial/detail/fd_line.hpp"
#include "drivers/trigger_board/trigger_board.hpp"

namespace vergence::trigger_board {
namespace {

/// qemu-system-arm with the image, its line to the host a socket. The process dies with this
/// object, and with the test.
class Machine {
 public:
  Machine() {
    std::array<int, 2> in{}, line{};
    if (::pipe(in.data()) != 0 || ::socketpair(AF_UNIX, SOCK_STREAM, 0, line.data()) != 0)
      throw std::runtime_error("no pipes");
    pid_ = ::fork();
    if (pid_ < 0) throw std::runtime_error("no process");
    if (pid_ == 0) {
      constexpr int kLine = 100;
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      ::dup2(in[0], STDIN_FILENO);
      ::dup2(line[1], kLine);
      ::dup2(::open("/dev/null", O_WRONLY), STDOUT_FILENO);
      ::execl(VERGENCE_QEMU_ARM, VERGENCE_QEMU_ARM, "-M", "netduinoplus2", "-display", "none",
              "-nodefaults", "-kernel", VERGENCE_BOARD_IMAGE, "-chardev", "socket,id=line,fd=100",
              "-serial", "chardev:line", "-monitor", "stdio", "-icount", "shift=3,sleep=off",
              nullptr);
      ::_exit(127);
    }
    ::close(in[0]);
    ::close(line[1]);
    commands_ = in[1];
    line_ = line[0];
    (void)::fcntl(line_, F_SETFL, O_NONBLOCK);
    pollfd speaks{line_, POLLIN, 0};
    if (::poll(&speaks, 1, 20'000) != 1) throw std::runtime_error("the board says nothing");
  }
  Machine(const Machine&) = delete;
  Machine& operator=(const Machine&) = delete;
  ~Machine() {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
    ::close(commands_);
    ::close(line_);
  }
  void reset() {
    const std::string command = "system_reset\n";
    ASSERT_EQ(::write(commands_, command.data(), command.size()),
              static_cast<ssize_t>(command.size()));
  }

  /// The line's end at the host, as often as it is opened. Outlived by the machine.
  class Place final : public LinePlace {
   public:
    explicit Place(int line) : line_(line) {}
    std::unique_ptr<ByteLine> open(const LineSettings& settings, DeviceStatus* status) override {
      *status = DeviceStatus::ok;
      return std::make_unique<FdLine>(UniquePort{}, UniqueFd(::dup(line_)),
                                      UniqueFd(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)), settings);
    }
    std::string name() const override { return "machine"; }

   private:
    int line_;
  };
  [[nodiscard]] std::unique_ptr<LinePlace> place() const { return std::make_unique<Place>(line_); }

 private:
  pid_t pid_ = -1;
  int commands_ = -1, line_ = -1;
};

// An instruction is eight nanoseconds of the machine's time, so that nothing in it depends on how
// busy the host is; its timers count 62.5 times as fast as the image thinks. So its time cannot be
// tied to ours here, and the rate is asked for in its seconds, of which ours has five to fifty.
// Numbers, boots and the dialogue are what they are on a board.
constexpr double kBoardRate = 1;  // Hz

std::string missing() {
  if (std::string(VERGENCE_BOARD_IMAGE).empty())
    return "no image of the trigger board: gcc-arm-none-eabi was not there to build it";
  if (std::string(VERGENCE_QEMU_ARM).empty())
    return "no qemu-system-arm to run the trigger board's image in";
  return {};
}

TEST(Image, isDrivenAndItsRebootSeen) {
  if (const std::string why = missing(); !why.empty()) GTEST_SKIP() << why;
  Machine machine;
  Options options;
  options.native_usb = true;
  DeviceStatus status = DeviceStatus::ok;
  std::string error;
  const auto board = open_on(machine.place(), options, &status, &error);
  ASSERT_NE(board, nullptr) << error;
  EXPECT_EQ(board->info().serial.size(), 24U);
  TriggerConfiguration requested;
  requested.rate_hz = kBoardRate;
  ASSERT_EQ(board->configure(requested, nullptr), DeviceStatus::ok) << board->last_error();

  const auto take = [&board](std::chrono::milliseconds time) {
    std::vector<Pulse> all;
    const auto end = std::chrono::steady_clock::now() + time;
    for (Pulse p; std::chrono::steady_clock::now() < end;) {
      const DeviceStatus s = board->wait(Duration::milliseconds(100), &p);
      if (s == DeviceStatus::ok) all.push_back(p);
      // A busy host lets the machine wait: it then is silent, and back with all that it had to say.
      if (s == DeviceStatus::gone) {
        (void)board->start(nullptr);
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
        continue;
      }
      if (s != DeviceStatus::ok && s != DeviceStatus::timeout) {
        ADD_FAILURE() << to_string(s) << " " << board->last_error();
        break;
      }
    }
    return all;
  };
  ASSERT_EQ(board->start(nullptr), DeviceStatus::ok);
  const auto before = take(std::chrono::milliseconds(5000));
  ASSERT_GT(before.size(), 10U);
  for (std::size_t i = 0; i < before.size(); ++i) {
    ASSERT_EQ(before[i].number, i);
    ASSERT_EQ(before[i].boot, before[0].boot);
    ASSERT_EQ(before[i].resumed, i == 0);
    ASSERT_TRUE(i == 0 || before[i].edge > before[i - 1].edge);
  }
  machine.reset();
  auto after = take(std::chrono::milliseconds(500));
  for (int i = 0;
       i < 20 && (after.empty() || after.back().boot == before[0].boot || after.back().number < 3);
       ++i) {
    const auto more = take(std::chrono::milliseconds(500));
    after.insert(after.end(), more.begin(), more.end());
  }
  std::set<std::uint32_t> boots;
  for (const Pulse& p : after) boots.insert(p.boot);
  ASSERT_FALSE(after.empty());
  EXPECT_LE(boots.size(), 2U);
  EXPECT_NE(after.back().boot, before[0].boot);
  EXPECT_GT(after.back().number, 2U);
  EXPECT_EQ(board->board_statistics().pulses.lost, 0U);
  board->stop();

  const BoardStatistics s = board->board_statistics();
  EXPECT_EQ(s.pulses.lost, 0U) << s.board.events_dropped << " dropped by the board, "
                               << s.line.refused() << " bad frames, next pulse " << s.board.pulses
                               << ", last taken " << after.back().number << ", state "
                               << int{s.board.state} << " skipped " << s.pulses.skipped;
  EXPECT_EQ(s.pulses.skipped, 0U);
  EXPECT_EQ(s.reboots, 1U);
  EXPECT_EQ(s.restarts, 0U);
  EXPECT_EQ(s.pulses.refused(), 0U);
  EXPECT_EQ(s.board.state, trigger_stopped) << board->last_error();
  EXPECT_LE(s.line.refused(), 1U) << "a frame that the reset has cut";
}

}  // namespace
}  // namespace vergence::trigger_board
