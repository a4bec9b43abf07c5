#pragma once
#include <sys/types.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "firmware_iface/trigger/trigger.h"

namespace vergence {

/// The real image in qemu-system-arm -M netduinoplus2, its line to the host on a socket.
///
/// What the machine is: RCC reads 0, so that the image runs on the clock it falls back to, 16 MHz;
/// the timers count 1 GHz of virtual time, so that a second of the board's is 16 ms; compare and
/// capture units do nothing, so that pulses are forced by the main loop (late). Virtual time is the
/// host's, or it goes on with every instruction: then nothing depends on how busy the host is.
///
/// Ownership  The process is killed by the destructor, and by the kernel when the test dies.
/// Threads    One of its own reads the line: a machine whose line is full stands still.
/// Errors     Throws std::runtime_error when the machine does not answer.
class QemuBoard {
 public:
  using Bytes = std::vector<std::uint8_t>;
  using Predicate = std::function<bool(const TriggerFrame&)>;

  /// Sentence why the image cannot be run here; empty: it can.
  static std::string missing();

  /// `icount_shift`: an instruction takes 2^icount_shift ns of virtual time; −1: virtual time is
  /// the host's.
  explicit QemuBoard(int icount_shift = -1);
  ~QemuBoard();
  QemuBoard(const QemuBoard&) = delete;
  QemuBoard& operator=(const QemuBoard&) = delete;

  void bytes(const Bytes& sent);
  /// Sends a message with the next sequence number. → that number
  std::uint8_t send(std::uint8_t type, const Bytes& payload = {});
  /// The next frame not yet looked at that `requested` likes, waiting ten seconds; others before it
  /// are skipped.
  TriggerFrame wait(const Predicate& requested);
  TriggerFrame wait(std::uint8_t type) {
    return wait([type](const TriggerFrame& f) { return f.type == type; });
  }
  /// Sends and waits for the answer with its sequence number.
  TriggerFrame ask(std::uint8_t type, const Bytes& payload = {});
  /// Frames not yet looked at; now they are.
  std::vector<TriggerFrame> drain();

 private:
  void read_line();

  pid_t pid_ = -1;
  int line_ = -1;
  std::uint8_t sequence_ = 0;
  std::thread reader_;
  std::mutex mutex_;
  std::condition_variable heard_something_;
  std::vector<TriggerFrame> heard_;
  std::size_t looked_at_ = 0;
};

}  // namespace vergence
