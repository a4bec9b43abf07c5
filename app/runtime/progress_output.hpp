#pragma once
#include <cstdint>
#include <string>
#include <string_view>

namespace vergence::app {

/// A descriptor that lines for the user go to, and that may take none for a while: a terminal
/// stopped by Ctrl-S, `| less`, a connection that hangs. Who writes there waits a second at most,
/// and not again until something was taken.
///
/// Source   poll(2) is not enough: a terminal with room for one byte is writable and holds up who
///          writes two. So terminals and pipes are opened once more for writes that never wait
///          (O_NONBLOCK of the descriptor itself would be the shell's, too), and sockets are asked
///          by call; where opening is refused it is poll and pieces that a pipe takes whole.
/// Threads  One. Errors  A descriptor that fails for good counts as one that takes everything.
class ProgressOutput {
 public:
  explicit ProgressOutput(int fd);
  /// One more try for the rest of a line.
  ~ProgressOutput();
  ProgressOutput(const ProgressOutput&) = delete;
  ProgressOutput& operator=(const ProgressOutput&) = delete;

  /// False: not one byte of `text` was taken. Of what was taken in part the rest goes before the
  /// next text. `may_wait`: as above; else not at all.
  bool write(std::string_view text, bool may_wait);

 private:
  /// Takes away what was written. True: all of it.
  bool push(std::string_view* text);
  bool push(std::string_view* text, bool may_wait);
  [[nodiscard]] bool writable(int timeout_ms) const;

  /// plain: its writes wait for nobody. asks: by poll, before every piece.
  enum class Kind : std::uint8_t { plain, socket, asks };
  int fd_;
  bool own_ = false;  // fd_ was opened here
  Kind kind_ = Kind::plain;
  bool stuck_ = false;  // the last one waited for it in vain
  std::string rest_;    // of a text that was taken in part
};

}  // namespace vergence::app
