// The driver, and the image that is flashed, in an emulated machine.
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <set>
#include <stdexcept>

#include "drivers/trigger_board/trigger_board.hpp"

namespace vergence::trigger_board {
namespace {

/// qemu-system-arm with the image, its line to the host a pseudo-terminal. The process dies with this object, and with the test.
class Machine {
 public:
  Machine() {
    std::array<int, 2> in{}, out{};
    if (::pipe(in.data()) != 0 || ::pipe(out.data()) != 0) throw std::runtime_error("no pipe");
    pid_ = ::fork();
    if (pid_ < 0) throw std::runtime_error("no process");
    if (pid_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      ::dup2(in[0], STDIN_FILENO);
      ::dup2(out[1], STDOUT_FILENO);
      ::execl(VERGENCE_QEMU_ARM, VERGENCE_QEMU_ARM, "-M", "netduinoplus2", "-display", "none", "-nodefaults", "-kernel",
              VERGENCE_BOARD_IMAGE, "-serial", "pty", "-monitor", "stdio", nullptr);
      ::_exit(127);
    }
    ::close(in[0]);
    ::close(out[1]);
    commands_ = in[1];
    words_ = out[0];
    port_ = told("/dev/pts/");
  }
  Machine(const Machine&) = delete;
  Machine& operator=(const Machine&) = delete;
  ~Machine() {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
    ::close(commands_);
    ::close(words_);
  }
  [[nodiscard]] const std::string& port() const noexcept { return port_; }
  void reset() {
    const std::string command = "system_reset\n";
    ASSERT_EQ(::write(commands_, command.data(), command.size()), static_cast<ssize_t>(command.size()));
  }

 private:
  /// The word that begins like this in what the machine says first.
  std::string told(const std::string& beginning) {
    std::string said;
    for (pollfd p{words_, POLLIN, 0}; ::poll(&p, 1, 10'000) == 1;) {
      std::array<char, 256> some{};
      const ssize_t n = ::read(words_, some.data(), some.size());
      if (n <= 0) break;
      said.append(some.data(), static_cast<std::size_t>(n));
      const std::size_t at = said.find(beginning), end = at == std::string::npos ? at : said.find_first_of(" \r\n", at);
      if (end != std::string::npos) return said.substr(at, end - at);
    }
    throw std::runtime_error("the machine does not say where its line is: " + said);
  }
  pid_t pid_ = -1;
  int commands_ = -1, words_ = -1;
  std::string port_;
};

// The machine's timers count 62.5 times as fast as the image thinks, so that a second of the board's is 16 ms: its time cannot be tied to
// ours here, and the rate is asked for in its seconds. Numbers, boots and the dialogue are what they are on a board.
constexpr double kBoardRate = 0.16;  // Hz, 10 of ours

std::string missing() {
  if (std::string(VERGENCE_BOARD_IMAGE).empty()) return "no image of the trigger board: gcc-arm-none-eabi was not there to build it";
  if (std::string(VERGENCE_QEMU_ARM).empty()) return "no qemu-system-arm to run the trigger board's image in";
  return {};
}

TEST(Image, isDrivenAndItsRebootSeen) {
  if (const std::string why = missing(); !why.empty()) GTEST_SKIP() << why;
  Machine machine;
  Options options;
  options.native_usb = true;
  Driver driver(options);
  DeviceStatus status = DeviceStatus::ok;
  const auto board = driver.open_board(machine.port(), &status);
  ASSERT_NE(board, nullptr) << driver.complaint();
  EXPECT_EQ(board->info().serial.size(), 24U);
  TriggerConfiguration wanted;
  wanted.rate_hz = kBoardRate;
  ASSERT_EQ(board->configure(wanted, nullptr), DeviceStatus::ok) << board->complaint();

  const auto take = [&board](std::chrono::milliseconds time) {
    std::vector<Pulse> all;
    const auto end = std::chrono::steady_clock::now() + time;
    for (Pulse p; std::chrono::steady_clock::now() < end;) {
      const DeviceStatus s = board->wait(Duration::milliseconds(100), &p);
      if (s == DeviceStatus::ok) all.push_back(p);
      if (s != DeviceStatus::ok && s != DeviceStatus::timeout) {
        ADD_FAILURE() << to_string(s) << " " << board->complaint();
        break;
      }
    }
    return all;
  };
  ASSERT_EQ(board->start(nullptr), DeviceStatus::ok);
  const auto before = take(std::chrono::milliseconds(5000));
  ASSERT_GT(before.size(), 15U) << "of 50";
  std::uint64_t left_out = before[0].number;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (i > 0) {
      ASSERT_GT(before[i].number, before[i - 1].number);
      ASSERT_GT(before[i].edge, before[i - 1].edge);
      left_out += before[i].number - before[i - 1].number - 1;
    }
    ASSERT_EQ(before[i].boot, before[0].boot);
    ASSERT_EQ(before[i].resumed, i == 0);
  }
  // Where the host has no time for the machine its main loop comes too late for a pulse, and says so.
  EXPECT_GE(board->board_statistics().pulses.skipped, left_out);
  machine.reset();
  const auto after = take(std::chrono::milliseconds(1500));
  std::set<std::uint32_t> boots;
  for (const Pulse& p : after) boots.insert(p.boot);
  ASSERT_FALSE(after.empty());
  EXPECT_LE(boots.size(), 2U);
  EXPECT_NE(after.back().boot, before[0].boot);
  EXPECT_GT(after.back().number, 2U);
  board->stop();

  const BoardStatistics s = board->board_statistics();
  EXPECT_EQ(s.pulses.lost, 0U);
  EXPECT_EQ(s.reboots, 1U);
  EXPECT_EQ(s.restarts, 0U);
  EXPECT_EQ(s.gone, 0U);
  EXPECT_EQ(s.pulses.refused(), 0U);
  EXPECT_EQ(s.board.state, trigger_stopped);
  EXPECT_LE(s.line.refused(), 1U) << "a frame that the reset has cut";
}

}  // namespace
}  // namespace vergence::trigger_board
