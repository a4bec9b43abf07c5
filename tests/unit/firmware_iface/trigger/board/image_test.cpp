// The image that is flashed, in an emulated machine, spoken to over its line.
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "firmware_iface/trigger/trigger.h"

namespace vergence {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// The real image in qemu-system-arm -M netduinoplus2, its line to the host on a socket.
///
/// Properties of the machine: RCC reads 0, so that the image runs on the clock it falls back to, 16
/// MHz; the timers count 1 GHz of virtual time, so that a second of the board's is 16 ms; compare
/// and capture units do nothing, so that pulses are forced by the main loop (late). An instruction
/// takes 8 ns of virtual time: nothing depends on how busy the host is.
///
/// Ownership  The process is killed by the destructor, and by the kernel when the test dies.
/// Errors     Throws std::runtime_error when the machine does not answer.
class QemuBoard {
 public:
  QemuBoard() {
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM, 0, ends) != 0) throw std::runtime_error("socketpair");
    line_ = ends[0];
    const std::string line = "socket,id=line,fd=" + std::to_string(ends[1]);
    const pid_t parent = ::getpid();
    pid_ = ::fork();
    if (pid_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      if (::getppid() != parent) ::_exit(1);
      ::close(ends[0]);
      ::execl(VERGENCE_QEMU_ARM, VERGENCE_QEMU_ARM, "-M", "netduinoplus2", "-display", "none",
              "-nodefaults", "-kernel", VERGENCE_BOARD_IMAGE, "-serial", "chardev:line", "-chardev",
              line.c_str(), "-icount", "shift=3,sleep=off", nullptr);
      ::_exit(127);
    }
    ::close(ends[1]);
    // The image now listens.
    (void)wait(trigger_status);
  }
  ~QemuBoard() {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
    ::close(line_);
  }
  QemuBoard(const QemuBoard&) = delete;
  QemuBoard& operator=(const QemuBoard&) = delete;

  /// The next frame that `requested` likes, waiting ten seconds for each; others before it are
  /// skipped. A machine whose line is full stands still meanwhile.
  template <class Predicate>
  TriggerFrame wait_for(const Predicate& requested) {
    for (TriggerFrame frame{};;) {
      pollfd p{line_, POLLIN, 0};
      std::uint8_t byte = 0;
      if (::poll(&p, 1, 10'000) != 1 || ::read(line_, &byte, 1) != 1)
        throw std::runtime_error("the board said nothing of the kind");
      if (trigger_decode(&decoder_, byte, &frame) == trigger_frame_ready && requested(frame))
        return frame;
    }
  }
  TriggerFrame wait(std::uint8_t type) {
    return wait_for([type](const TriggerFrame& f) { return f.type == type; });
  }
  /// Sends a message with the next sequence number and waits for its answer.
  TriggerFrame ask(std::uint8_t type, const Bytes& payload = {}) {
    Bytes frame(trigger_max_frame);
    sequence_ = static_cast<std::uint8_t>((sequence_ + 1) % trigger_unasked);
    frame.resize(
        trigger_write_frame(type, sequence_, payload.data(), payload.size(), frame.data()));
    if (::send(line_, frame.data(), frame.size(), MSG_NOSIGNAL) !=
        static_cast<ssize_t>(frame.size()))
      throw std::runtime_error("the machine has gone");
    return wait_for([this](const TriggerFrame& f) { return f.sequence == sequence_; });
  }

 private:
  pid_t pid_ = -1;
  int line_ = -1;
  std::uint8_t sequence_ = 0;
  TriggerDecoder decoder_{};
};

struct TriggerBoardImage : testing::Test {
  void SetUp() override {
    if (std::string(VERGENCE_BOARD_IMAGE).empty())
      GTEST_SKIP() << "needs the trigger board's image: sudo apt install gcc-arm-none-eabi, then "
                      "configure again";
    if (std::string(VERGENCE_QEMU_ARM).empty())
      GTEST_SKIP()
          << "needs qemu-system-arm: sudo apt install qemu-system-arm, then configure again";
  }
  static Bytes config(std::uint32_t millihertz, std::uint32_t dither_us = 0) {
    const TriggerConfig c{millihertz,          2000, dither_us, 0x3, 0, 0, 0, trigger_edge_rising,
                          trigger_edge_falling};
    Bytes payload(trigger_config_payload_size);
    trigger_put_config(&c, payload.data());
    return payload;
  }
  static TriggerStatus status(const TriggerFrame& f) {
    TriggerStatus s{};
    EXPECT_TRUE(f.type == trigger_status && trigger_get_status(f.payload, f.size, &s));
    return s;
  }
  static TriggerEvent event(const TriggerFrame& f) {
    TriggerEvent e{};
    EXPECT_TRUE(f.type == trigger_event && trigger_get_event(f.payload, f.size, &e));
    return e;
  }
};

TEST_F(TriggerBoardImage, answersHelloAndRefusesRateZero) {
  QemuBoard board;
  const TriggerFrame hello = board.ask(trigger_hello, {trigger_protocol_version});
  TriggerInfo info{};
  ASSERT_EQ(hello.type, trigger_info);
  ASSERT_TRUE(trigger_get_info(hello.payload, hello.size, &info));
  EXPECT_EQ(info.version, trigger_protocol_version);
  EXPECT_NE(info.boot_id, 0U);
  EXPECT_EQ(info.tick_hz, 16'000'000U) << "the crystal was waited for in vain";
  EXPECT_EQ(info.lines, 4);
  EXPECT_EQ(info.feedback_inputs, 2);
  EXPECT_EQ(status(board.wait(trigger_status)).boot_id, info.boot_id);

  const TriggerFrame refused = board.ask(trigger_config, config(0));
  EXPECT_EQ(refused.type, trigger_error);
  EXPECT_EQ(refused.payload[1], trigger_error_rate);
  const Bytes good = config(1000);
  EXPECT_EQ(status(board.ask(trigger_config, good)).configuration,
            trigger_crc32(good.data(), good.size()));
}

TEST_F(TriggerBoardImage, pulseNumbersContinueAcrossStopAndStart) {
  QemuBoard board;
  (void)board.ask(trigger_config, config(20'000, 5'000));
  const TriggerStatus started = status(board.ask(trigger_start));
  EXPECT_EQ(started.state, trigger_running);
  TriggerEvent last{};
  for (std::uint32_t k = 0; k < 40; ++k) {
    const TriggerEvent e = event(board.wait(trigger_event));
    EXPECT_EQ(e.boot_id, started.boot_id);
    EXPECT_EQ(e.pulse, k);
    EXPECT_EQ(e.lines, 0x3);
    EXPECT_EQ(e.flags & 1, k == 0 ? 1 : 0);
    EXPECT_EQ(e.flags & 2, 2) << "this machine's compare unit makes no edges: the main loop did";
    EXPECT_EQ(e.exposure[0].start_us, TRIGGER_NOT_SEEN);
    EXPECT_TRUE(k == 0 || e.tick > last.tick);
    last = e;
  }
  const TriggerStatus paused = status(board.ask(trigger_pause, {20, 0, 0, 0}));
  EXPECT_EQ(paused.state, trigger_paused);
  const TriggerFrame resumed = board.wait_for(
      [](const TriggerFrame& f) { return f.type == trigger_event && (event(f).flags & 1) != 0; });
  EXPECT_GE(event(resumed).pulse, paused.pulses + 20)
      << "counted from the armed one, which still went out";
  EXPECT_LE(event(resumed).pulse, paused.pulses + 21);

  const TriggerStatus stopped = status(board.ask(trigger_stop));
  EXPECT_EQ(stopped.state, trigger_stopped);
  (void)board.wait(trigger_status);
  (void)board.wait(trigger_status);
  const TriggerStatus later = status(board.wait(trigger_status));
  EXPECT_EQ(later.pulses, stopped.pulses) << "no pulse after STOP";
  (void)board.ask(trigger_start);
  const TriggerEvent again = event(board.wait(trigger_event));
  EXPECT_EQ(again.pulse, stopped.pulses);
  EXPECT_EQ(again.flags & 1, 1);
}

}  // namespace
}  // namespace vergence
