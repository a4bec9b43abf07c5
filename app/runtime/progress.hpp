#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iosfwd>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "core/types/time.hpp"

namespace vergence::app {

/// Content of the progress line; unset fields are omitted.
struct ProgressState {
  /// State, such as `stereo`.
  std::string state{};
  /// Number of frames done.
  std::uint64_t frame = 0;
  /// Total number of frames; 0 if unknown (no remaining time is then printed).
  std::uint64_t frames = 0;
  /// Distance travelled.
  double path_m = 0;
  /// Inliers of the last pose.
  std::optional<int> inliers{};
  /// Time of the last frame.
  std::optional<double> estimate_ms{};
  /// Distance to the INS.
  std::optional<double> from_ins_m{};
  /// Text in place of path and measurements: `calibrate · frame 7/26 · 5 with the board`.
  std::string activity{};
};

/// Progress line: `stereo · frame 1204/33000 · 0.62 km · 318 inliers · 7.9 ms · 0.42 m from INS ·
/// 03:12 left`
///
/// terminal  one line, redrawn at most 10 times per second, cut to the terminal's width
/// lines     for files and pipes: one line every 10 s, the last one at finish()
/// quiet     no output
///
/// Not thread-safe. Uses the given monotonic clock. Errors of the stream are ignored.
class Progress {
 public:
  enum class Mode : std::uint8_t { terminal, lines, quiet };
  /// `width` in columns is queried at every redraw, because a terminal may be resized; below 1 it
  /// is unknown, and 80 is used.
  Progress(std::ostream& out, Mode mode, std::function<HostStamp()> clock,
           std::function<int()> width);
  /// Writes to stderr with the machine's clock, in a mode that depends on stderr.
  [[nodiscard]] static Progress on_stderr(bool quiet);
  /// Ends the line as finish() does.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Stores the state and draws it when due. The first call starts the clock of the rate.
  void update(const ProgressState& state);
  /// Prints a message on its own line, also with `quiet`.
  void print(std::string_view message);
  /// Same with a formatted message.
  template <class First, class... Rest>
  void print(fmt::format_string<First, Rest...> message, First&& first, Rest&&... rest) {
    print(fmt::format(message, std::forward<First>(first), std::forward<Rest>(rest)...));
  }
  /// Draws the last state and ends the line. Later updates start a new one.
  void finish();

 private:
  [[nodiscard]] std::string line(HostStamp now) const;
  void draw(HostStamp now);
  void redraw(const std::string& whole);
  /// Escape sequence that erases the line.
  [[nodiscard]] std::string wiped() const {
    return columns_ > 0 ? '\r' + std::string(columns_, ' ') + '\r' : "";
  }

  void put_line(std::string_view line);

  std::ostream& out_;
  Mode mode_;
  std::function<HostStamp()> clock_;
  std::function<int()> width_;
  ProgressState last_{};
  // True after an update since the start or the last finish().
  bool started_ = false;
  // True if the last update is on the screen.
  bool drawn_ = false;
  HostStamp first_time_{}, drawn_time_{};
  std::uint64_t first_frame_ = 0;
  // Length of the line now on the terminal.
  std::size_t columns_ = 0;
};

}  // namespace vergence::app
