#include "drivers/trigger_board/requested_configuration.hpp"

#include <array>
#include <cmath>
#include <cstdio>

namespace vergence::trigger_board {
namespace {

template <class... Args>
std::string text(const char* format, Args... args) {
  std::array<char, 240> buffer{};
  (void)std::snprintf(buffer.data(), buffer.size(), format, args...);
  return buffer.data();
}

constexpr double kFastest = 2000;  // Hz: two events a millisecond are more than a line carries
constexpr std::int64_t kWidest = 1'000'000;  // µs, of a pulse: the board's own limit

std::uint8_t edge_kind(Edge edge) noexcept {
  return static_cast<std::uint8_t>(edge == Edge::none     ? trigger_edge_none
                                   : edge == Edge::rising ? trigger_edge_rising
                                                          : trigger_edge_falling);
}

/// Lines that a mask names beyond those that are there.
bool beyond(std::uint8_t mask, std::uint8_t lines) noexcept {
  return lines < 8 && (mask >> lines) != 0;
}

}  // namespace

DeviceStatus wire_configuration(const TriggerConfiguration& requested, const Options& options,
                                const TriggerInfo& board, TriggerConfig* config,
                                std::string* sentence) {
  const auto refuse = [sentence](DeviceStatus status, std::string why) {
    *sentence = std::move(why);
    return status;
  };
  const auto bad = [&refuse](std::string why) {
    return refuse(DeviceStatus::bad_configuration, std::move(why));
  };
  const auto cannot = [&refuse](std::string why) {
    return refuse(DeviceStatus::unsupported, std::move(why));
  };

  if (!(requested.rate_hz >= 0.001 && requested.rate_hz <= kFastest))
    return bad(
        text("a trigger.rate of %g Hz is none; choose 0.001 to %g", requested.rate_hz, kFastest));
  const auto millihertz = static_cast<std::uint32_t>(std::llround(requested.rate_hz * 1000));
  const std::int64_t period_us = 1'000'000'000 / millihertz, width_us = requested.width.ns() / 1000,
                     vary_us = requested.vary.ns() / 1000;
  if (width_us < 1) return bad("a pulse needs a width: set trigger.width_us to 1 or more");
  if (width_us > kWidest)
    return bad(text("a pulse of %lld µs is longer than a second; lower trigger.width_us",
                    static_cast<long long>(width_us)));
  if (vary_us < 0 || vary_us >= period_us)
    return bad(
        text("trigger.vary_us is %lld and the period %lld µs; it must lie between 0 and that",
             static_cast<long long>(vary_us), static_cast<long long>(period_us)));
  if (width_us >= period_us - vary_us)
    return bad(text(
        "a pulse of %lld µs does not fit into %lld µs from pulse to pulse; lower trigger.width_us",
        static_cast<long long>(width_us), static_cast<long long>(period_us - vary_us)));
  if (requested.lines == 0)
    return bad("no line is to be pulsed; name the cameras' lines in trigger.lines");
  if (beyond(requested.lines, board.lines) || beyond(requested.active_low, board.lines))
    return cannot(text("the trigger board has %u lines, numbered from 0; trigger.lines names more",
                       static_cast<unsigned>(board.lines)));
  if (beyond(requested.feedback, board.feedback_inputs) ||
      beyond(requested.feedback_active_low, board.feedback_inputs))
    return cannot(
        text("the trigger board has %u inputs for exposure feedback, numbered from 0; "
             "trigger.feedback names more",
             static_cast<unsigned>(board.feedback_inputs)));
  if (options.pps != Edge::none && board.has_pps == 0)
    return cannot("the trigger board has no input for PPS; set trigger.pps to none");
  if (options.ins != Edge::none && board.has_ins == 0)
    return cannot("the trigger board has no input for the INS' SyncOut; set trigger.ins to none");

  TriggerConfig c{};
  c.rate_millihertz = millihertz;
  c.pulse_us = static_cast<std::uint32_t>(width_us);
  c.vary_us = static_cast<std::uint32_t>(vary_us);
  c.lines = requested.lines;
  c.active_low = requested.active_low;
  c.feedback_inputs = requested.feedback;
  c.feedback_active_low = requested.feedback_active_low;
  c.pps_edge = edge_kind(options.pps);
  c.ins_edge = edge_kind(options.ins);
  *config = c;
  return DeviceStatus::ok;
}

TriggerConfiguration configuration_of(const TriggerConfig& config) noexcept {
  TriggerConfiguration c;
  c.rate_hz = static_cast<double>(config.rate_millihertz) / 1000;
  c.width = Duration::microseconds(config.pulse_us);
  c.vary = Duration::microseconds(config.vary_us);
  c.lines = config.lines;
  c.active_low = config.active_low;
  c.feedback = config.feedback_inputs;
  c.feedback_active_low = config.feedback_active_low;
  return c;
}

std::string remark_about(const TriggerConfiguration& requested, const TriggerConfig& config) {
  const double rate = static_cast<double>(config.rate_millihertz) / 1000;
  if (std::abs(rate - requested.rate_hz) < 1e-6 * requested.rate_hz) return {};
  return text("it pulses at %.3f Hz: rates are whole thousandths", rate);
}

}  // namespace vergence::trigger_board
