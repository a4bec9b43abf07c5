#include "app/runtime/progress.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>

#include "app/runtime/terminal_text.hpp"
#include "drivers/clock.hpp"

namespace vergence::app {
namespace {

constexpr Duration kBetweenRedraws = Duration::milliseconds(100);
constexpr Duration kBetweenLines = Duration::seconds(10);
// Before this time the measured rate is that of the start-up.
constexpr Duration kFirstEstimate = Duration::seconds(1);
// Number of columns assumed if the terminal's width is unknown.
constexpr int kUnknownWidth = 80;
// Maximum in s (100 hours) of a remaining time that is shown.
constexpr double kLongestLeft = 360'000;

std::string clock_text(double seconds) {
  const auto s = static_cast<long>(seconds + 0.5);
  if (s >= 3600) return fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
  return fmt::format("{:02}:{:02}", s / 60, s % 60);
}

int width_of_stderr() {
  winsize size{};
  return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 ? size.ws_col : 0;
}

Progress::Mode mode_of_stderr(bool quiet) {
  if (quiet) return Progress::Mode::quiet;
  const char* terminal = std::getenv("TERM");
  const bool dumb = terminal != nullptr && std::string_view(terminal) == "dumb";
  return ::isatty(STDERR_FILENO) == 1 && !dumb ? Progress::Mode::terminal : Progress::Mode::lines;
}

}  // namespace

Progress::Progress(std::ostream& out, Mode mode, std::function<HostStamp()> clock,
                   std::function<int()> width)
    : out_(out), mode_(mode), clock_(std::move(clock)), width_(std::move(width)) {}

Progress Progress::on_stderr(bool quiet) {
  return {std::cerr, mode_of_stderr(quiet), monotonic_now, width_of_stderr};
}

Progress::~Progress() { finish(); }

void Progress::update(const ProgressState& state) {
  if (mode_ == Mode::quiet) return;
  const HostStamp now = clock_();
  last_ = state;
  drawn_ = false;
  if (!started_) {
    started_ = true;
    first_time_ = now;
    first_frame_ = state.frame;
    drawn_time_ = now;
    if (mode_ == Mode::terminal) draw(now);
    return;
  }
  if (now - drawn_time_ >= (mode_ == Mode::terminal ? kBetweenRedraws : kBetweenLines)) draw(now);
}

void Progress::print(std::string_view message) {
  const bool drawn = columns_ > 0;
  put_line(message);
  if (drawn) draw(clock_());
}

void Progress::put_line(std::string_view line) {
  out_ << wiped() << line << '\n' << std::flush;
  columns_ = 0;
}

void Progress::finish() {
  if (!started_) return;
  if (!drawn_) draw(clock_());
  if (mode_ == Mode::terminal) out_ << '\n' << std::flush;
  columns_ = 0;
  started_ = false;
}

std::string Progress::line(HostStamp now) const {
  const ProgressState& s = last_;
  std::string text;
  const auto part = [&text](const std::string& p) { text += (text.empty() ? "" : " · ") + p; };
  if (!s.state.empty()) part(s.state);
  part(s.frames > 0 ? fmt::format("frame {}/{}", s.frame, s.frames)
                    : fmt::format("frame {}", s.frame));
  if (s.activity.empty())
    part(fmt::format("{:.2f} km", s.path_m / 1000.0));
  else
    part(s.activity);
  if (s.inliers) part(fmt::format("{} inliers", *s.inliers));
  if (s.estimate_ms) part(fmt::format("{:.1f} ms", *s.estimate_ms));
  if (s.from_ins_m) part(fmt::format("{:.2f} m from INS", *s.from_ins_m));
  const Duration elapsed = now - first_time_;
  if (s.frames > s.frame && s.frame > first_frame_ && elapsed >= kFirstEstimate) {
    const double rate = static_cast<double>(s.frame - first_frame_) / elapsed.to_seconds();
    const double left = static_cast<double>(s.frames - s.frame) / rate;
    if (left < kLongestLeft) part(clock_text(left) + " left");
  }
  return text;
}

void Progress::draw(HostStamp now) {
  drawn_time_ = now;
  drawn_ = true;
  if (mode_ == Mode::lines)
    put_line(line(now));
  else
    redraw(line(now));
}

void Progress::redraw(const std::string& whole) {
  const int width = width_();
  // One column stays free: a terminal that has just filled its last one may already have begun the
  // next line.
  const auto room = static_cast<std::size_t>(std::max(1, (width < 1 ? kUnknownWidth : width) - 1));
  std::string_view shown = whole;
  while (columns(shown) > room) shown.remove_suffix(1);
  const std::size_t used = columns(shown);
  std::string text = "\r";
  text += shown;
  if (columns_ > used) text.append(std::min(columns_, room) - used, ' ');
  out_ << text << std::flush;
  columns_ = used;
}

}  // namespace vergence::app
