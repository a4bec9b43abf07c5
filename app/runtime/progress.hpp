#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iosfwd>
#include <optional>
#include <string>
#include <string_view>

#include "core/types/time.hpp"

namespace vergence::app {

/// Content of the progress line; unset fields are omitted.
struct ProgressState {
  std::string state{};                  // `stereo`
  std::uint64_t frame = 0;              // done so far
  std::uint64_t frames = 0;             // in all; 0: nobody knows (no time left is told)
  double path_m = 0;                    // travelled
  std::optional<int> inliers{};         // of the last pose
  std::optional<double> estimate_ms{};  // of the last frame
  std::optional<double> from_ins_m{};   // distance to the INS
  std::string activity{};  // instead of path and figures, where there are none: `calibrate · frame
                           // 7/26 · 5 with the board`
};

/// `stereo · frame 1204/33000 · 0.62 km · 318 inliers · 7.9 ms · 0.42 m from INS · 03:12 left`
///
/// terminal  one line, redrawn at most 10 times a second, cut to the terminal's width
/// lines     one line every 10 s, the last one at finish(): for files and pipes
/// quiet     nothing
/// Threads   One caller. Time  Monotonic, from the clock handed in. Errors  A stream that fails is
///           ignored.
class Progress {
 public:
  enum class Mode : std::uint8_t { terminal, lines, quiet };
  /// `width` in columns is asked at every redraw, as a terminal may be resized; < 1: not known, 80.
  Progress(std::ostream& out, Mode mode, std::function<HostStamp()> clock,
           std::function<int()> width);
  /// On standard error with the machine's clock: terminal or lines by what standard error is.
  [[nodiscard]] static Progress on_stderr(bool quiet);
  /// Ends the line as finish() does.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Called as often as wanted; draws when it is time. The clock of the rate starts with the first
  /// call.
  void update(const ProgressState& state);
  /// A message for the user between the redraws, on a line of its own; also with `quiet`.
  void print(std::string_view message);
  /// Draws the last state and ends the line. Later updates start a new one.
  void finish();

 private:
  [[nodiscard]] std::string line(HostStamp now) const;
  void draw(HostStamp now);
  void redraw(const std::string& whole);
  [[nodiscard]] std::string wiped() const;
  void put_line(std::string_view line);

  std::ostream& out_;
  Mode mode_;
  std::function<HostStamp()> clock_;
  std::function<int()> width_;
  ProgressState last_{};
  bool started_ = false;  // an update has come since the start or the last finish()
  bool drawn_ = false;    // the last update is on the screen
  HostStamp first_time_{}, drawn_time_{};
  std::uint64_t first_frame_ = 0;
  std::size_t columns_ = 0;  // of the line on the terminal now
};

}  // namespace vergence::app
