#include "drivers/trigger_board/setup.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "drivers/format_text.hpp"

namespace vergence::trigger_board {

namespace {

// In Hz; more than two events per millisecond exceed the link.
constexpr double kFastest = 2000;
// Maximum pulse width of the trigger board, in µs.
constexpr std::int64_t kWidest = 1'000'000;

std::uint8_t edge_kind(Edge edge) noexcept {
  return static_cast<std::uint8_t>(edge == Edge::none     ? trigger_edge_none
                                   : edge == Edge::rising ? trigger_edge_rising
                                                          : trigger_edge_falling);
}

/// Outputs or inputs in a mask that do not exist.
bool beyond(std::uint8_t mask, std::uint8_t lines) noexcept {
  return lines < 8 && (mask >> lines) != 0;
}

}  // namespace

DeviceStatus wire_configuration(const TriggerConfiguration& requested, const Options& options,
                                const TriggerInfo& board, TriggerConfig* config,
                                std::string* message) {
  const auto refuse = [message](DeviceStatus status, std::string why) {
    *message = std::move(why);
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
        format_text("trigger.rate is %g Hz; it must be 0.001 to %g", requested.rate_hz, kFastest));
  const auto millihertz = static_cast<std::uint32_t>(std::llround(requested.rate_hz * 1000));
  const std::int64_t period_us = 1'000'000'000 / millihertz, width_us = requested.width.ns() / 1000,
                     dither_us = requested.vary.ns() / 1000;
  if (width_us < 1) return bad("trigger.width_us must be 1 or more");
  if (width_us > kWidest)
    return bad(format_text("trigger.width_us is %lld, longer than a second; lower it",
                           static_cast<long long>(width_us)));
  if (dither_us < 0 || dither_us >= period_us)
    return bad(
        format_text("trigger.dither_us is %lld; it must be between 0 and the period of %lld µs",
                    static_cast<long long>(dither_us), static_cast<long long>(period_us)));
  if (width_us >= period_us - dither_us)
    return bad(format_text(
        "trigger.width_us is %lld, but the shortest interval is %lld µs; lower it",
        static_cast<long long>(width_us), static_cast<long long>(period_us - dither_us)));
  if (requested.lines == 0)
    return bad("no line is pulsed; set the cameras' lines in trigger.lines");
  if (beyond(requested.lines, board.lines) || beyond(requested.active_low, board.lines))
    return cannot(
        format_text("the trigger board has %u lines, numbered from 0; change trigger.lines",
                    static_cast<unsigned>(board.lines)));
  if (beyond(requested.feedback, board.feedback_inputs) ||
      beyond(requested.feedback_active_low, board.feedback_inputs))
    return cannot(
        format_text("the trigger board has %u inputs for exposure feedback, numbered from 0; "
                    "change trigger.feedback",
                    static_cast<unsigned>(board.feedback_inputs)));
  if (options.pps != Edge::none && board.has_pps == 0)
    return cannot("the trigger board has no input for PPS; set trigger.pps to none");
  if (options.ins != Edge::none && board.has_ins == 0)
    return cannot("the trigger board has no input for the INS' SyncOut; set trigger.ins to none");

  TriggerConfig c{};
  c.rate_millihertz = millihertz;
  c.pulse_us = static_cast<std::uint32_t>(width_us);
  c.dither_us = static_cast<std::uint32_t>(dither_us);
  c.lines = requested.lines;
  c.active_low = requested.active_low;
  c.feedback_inputs = requested.feedback;
  c.feedback_active_low = requested.feedback_active_low;
  c.pps_edge = edge_kind(options.pps);
  c.ins_edge = edge_kind(options.ins);
  *config = c;
  return DeviceStatus::ok;
}

TriggerConfiguration to_configuration(const TriggerConfig& config) noexcept {
  TriggerConfiguration c;
  c.rate_hz = static_cast<double>(config.rate_millihertz) / 1000;
  c.width = Duration::microseconds(config.pulse_us);
  c.vary = Duration::microseconds(config.dither_us);
  c.lines = config.lines;
  c.active_low = config.active_low;
  c.feedback = config.feedback_inputs;
  c.feedback_active_low = config.feedback_active_low;
  return c;
}

std::string remark_about(const TriggerConfiguration& requested, const TriggerConfig& config) {
  const double rate = static_cast<double>(config.rate_millihertz) / 1000;
  if (std::abs(rate - requested.rate_hz) < 1e-6 * requested.rate_hz) return {};
  return format_text("it pulses at %.3f Hz, because its rates are multiples of 0.001 Hz", rate);
}

namespace {

constexpr std::array<std::uint32_t, 3> kBauds{921600, 115200, 460800};
constexpr Duration kHello = Duration::milliseconds(500);
constexpr Duration kAnswer = Duration::seconds(1);
constexpr Duration kRetryInterval = Duration::milliseconds(150);
// Attempts of a request whose answer does not show the requested state yet.
constexpr int kTurns = 3;

/// Forward distance between two own sequence numbers.
int steps(std::uint8_t from, std::uint8_t to) noexcept {
  return (to + trigger_unasked - from) % trigger_unasked;
}

const char* request_name(std::uint8_t type) noexcept {
  switch (type) {
    case trigger_hello:
      return "its identity";
    case trigger_config:
      return "its configuration";
    case trigger_start:
      return "to start";
    case trigger_stop:
      return "to stop";
    default:
      return "something";
  }
}

std::string error_text(std::uint8_t code) {
  switch (code) {
    case trigger_error_rate:
      return "its timer cannot make this rate; choose another trigger.rate";
    case trigger_error_pulse:
      return "the pulse is not shorter than its period, or has no width; change trigger.width_us "
             "or trigger.dither_us";
    case trigger_error_line:
      return "it lacks some of these lines and inputs; change trigger.lines, trigger.feedback, "
             "trigger.pps or trigger.ins";
    case trigger_error_version:
      return format_text(
          "it does not support version %d of the trigger protocol; flash this release's firmware",
          static_cast<int>(trigger_protocol_version));
    case trigger_error_unknown_type:
    case trigger_error_wrong_size:
      return "it does not support the message; flash this release's firmware";
    case trigger_error_not_running:
      return "it makes no pulses";
    case trigger_error_not_stopped:
      return "it still makes pulses";
    case trigger_error_not_configured:
      return "it has lost its configuration";
    default:
      return format_text("it reports error %u, which is unknown in this protocol version",
                         static_cast<unsigned>(code));
  }
}

}  // namespace

std::uint32_t configuration_mark(const TriggerConfig& config) noexcept {
  std::array<std::uint8_t, trigger_config_payload_size> payload{};
  trigger_put_config(&config, payload.data());
  return trigger_crc32(payload.data(), payload.size());
}

Setup::Answer Setup::listen(std::uint8_t type, std::uint8_t first, std::uint8_t last,
                            std::uint8_t requested, HostStamp until) {
  // Ends at `until`.
  for (;;) {
    if (stop_.load(std::memory_order_acquire)) return Answer::stopped;
    TriggerFrame frame;
    BoardLine::Times times;
    const DeviceStatus status = frames_.next(until, &frame, &times);
    if (status == DeviceStatus::timeout) return Answer::silent;
    // Woken, perhaps to stop.
    if (status == DeviceStatus::stopped) continue;
    if (status != DeviceStatus::ok) return Answer::disconnected;
    const bool mine =
        frame.sequence < trigger_unasked && steps(first, frame.sequence) <= steps(first, last);
    if (mine && frame.type == requested) {
      frame_ = frame;
      return Answer::ok;
    }
    TriggerError error;
    if (mine && frame.type == trigger_error &&
        trigger_get_error(frame.payload, frame.size, &error) && error.refused == type) {
      error_ = error.code;
      return Answer::refused;
    }
    if (others_ != nullptr) others_->accept(frame, times);
  }
}

Setup::Answer Setup::ask(std::uint8_t type, std::span<const std::uint8_t> payload,
                         std::uint8_t requested, Duration limit) {
  const HostStamp end = frames_.now() + limit;
  std::uint8_t first = 0, last = 0;
  // Each round listens for kRetryInterval within the limit.
  for (bool again = false;; again = true) {
    const DeviceStatus sent = frames_.send(type, payload, &last);
    if (sent == DeviceStatus::disconnected || sent == DeviceStatus::failed)
      return Answer::disconnected;
    if (!again) first = last;
    const Answer answer =
        listen(type, first, last, requested, std::min(end, frames_.now() + kRetryInterval));
    if (answer != Answer::silent || frames_.now() >= end) return answer;
  }
}

DeviceStatus Setup::verdict(Answer answer, std::uint8_t type) {
  switch (answer) {
    case Answer::ok:
      return DeviceStatus::ok;
    case Answer::stopped:
      return DeviceStatus::stopped;
    case Answer::refused:
      last_error_ =
          format_text("the trigger board refuses %s: ", request_name(type)) + error_text(error_);
      return error_ == trigger_error_not_stopped || error_ == trigger_error_not_configured
                 ? DeviceStatus::failed
                 : DeviceStatus::unsupported;
    case Answer::silent:
    case Answer::disconnected:
      break;
  }
  last_error_ =
      format_text("the trigger board did not respond (requested: %s); check its cable and supply",
                  request_name(type));
  return DeviceStatus::disconnected;
}

DeviceStatus Setup::hello(Duration limit, TriggerInfo* info) {
  const std::array<std::uint8_t, 1> version{trigger_protocol_version};
  const Answer answer = ask(trigger_hello, version, trigger_info, limit);
  if (answer == Answer::silent) return DeviceStatus::timeout;
  if (answer != Answer::ok) return verdict(answer, trigger_hello);
  // The version is the first byte in every version; the rest is valid only in this one.
  const unsigned theirs = frame_.size > 0 ? frame_.payload[0] : 0U;
  if (theirs != trigger_protocol_version) return other_version(theirs);
  if (trigger_get_info(frame_.payload, frame_.size, info)) return DeviceStatus::ok;
  last_error_ = format_text(
      "the trigger board answered %u bytes, which are not an INFO message; flash this release's "
      "firmware",
      static_cast<unsigned>(frame_.size));
  return DeviceStatus::unsupported;
}

DeviceStatus Setup::other_version(unsigned theirs) {
  last_error_ = format_text(
      "the trigger board uses protocol version %u, this program version %d; flash this "
      "release's firmware",
      theirs, static_cast<int>(trigger_protocol_version));
  return DeviceStatus::unsupported;
}

DeviceStatus Setup::find(std::uint32_t baud, TriggerInfo* info) {
  std::string received;
  // Two rounds, because boards that restart when their port is opened miss the first.
  for (int round = 0; round < 2; ++round) {
    for (const std::uint32_t candidate : kBauds) {
      const std::uint32_t rate = baud != 0 ? baud : candidate;
      if (line_.baud() != rate) {
        if (const DeviceStatus s = line_.set_baud(rate); s != DeviceStatus::ok) {
          last_error_ = format_text("the port cannot be set to %u baud", rate);
          return s;
        }
        frames_.attach(&line_);
      }
      const DeviceStatus status = hello(kHello, info);
      if (status != DeviceStatus::timeout) return status;
      if (received.empty()) received = frames_.received_instead();
      if (baud != 0) break;
    }
  }
  last_error_ = received.empty()
                    ? std::string("no trigger board responds; check its cable, supply and firmware")
                    : "the device is not a trigger board: " + received +
                          "; set trigger.port to the trigger board's port";
  return DeviceStatus::not_found;
}

template <class Fits>
DeviceStatus Setup::ask_status(std::uint8_t type, std::span<const std::uint8_t> payload,
                               TriggerStatus* status, Fits fits) {
  for (int turn = 0; turn < kTurns; ++turn) {
    const DeviceStatus answered = verdict(ask(type, payload, trigger_status, kAnswer), type);
    if (answered != DeviceStatus::ok) return answered;
    // The late answer to an earlier, abandoned request shows the state before.
    TriggerStatus s;
    if (!trigger_get_status(frame_.payload, frame_.size, &s) || !fits(s)) continue;
    *status = s;
    return DeviceStatus::ok;
  }
  last_error_ = format_text(
      "the trigger board responds, but does not execute the command (requested: %s); switch it off "
      "and on",
      request_name(type));
  return DeviceStatus::failed;
}

DeviceStatus Setup::halt(TriggerStatus* status) {
  return ask_status(trigger_stop, {}, status,
                    [](const TriggerStatus& s) { return s.state == trigger_stopped; });
}

DeviceStatus Setup::configure(const TriggerConfig& config, TriggerStatus* status) {
  std::array<std::uint8_t, trigger_config_payload_size> payload{};
  trigger_put_config(&config, payload.data());
  return ask_status(trigger_config, payload, status, [&](const TriggerStatus& s) {
    return s.configuration == configuration_mark(config);
  });
}

DeviceStatus Setup::start(TriggerStatus* status) {
  return ask_status(trigger_start, {}, status,
                    [](const TriggerStatus& s) { return s.state != trigger_stopped; });
}

}  // namespace vergence::trigger_board
