#include "tests/support/simulators/board_simulator.hpp"

#include <algorithm>
#include <numbers>
#include <utility>

#include "core/math/random.hpp"

namespace vergence::test {
namespace {

constexpr Duration kSecond = Duration::seconds(1);
constexpr Duration kPpsWidth = Duration::milliseconds(100);
constexpr std::uint32_t kMaxMillihertz = 1'000'000;

}  // namespace

BoardSimulator::BoardSimulator(PulseSource pulses, const BoardSimulatorOptions& options)
    : pulses_(std::move(pulses)), options_(options), end_(options.power_on + options.duration) {
  start(options_.power_on);
  if (options_.pps) plan_pps(options_.power_on);
  plan();
}

// ---- its clock

double BoardSimulator::counts_since_power_on(HostStamp host) const noexcept {
  const double t = (host - options_.power_on).to_seconds();
  const double turn = 2 * std::numbers::pi / options_.wander_period.to_seconds();
  const double ahead =
      options_.clock_ppm * t + options_.wander_ppm * (1 - std::cos(turn * t)) / turn;
  return static_cast<double>(options_.counts_hz) * (t + 1e-6 * ahead);
}

std::uint64_t BoardSimulator::count_at(HostStamp host) const noexcept {
  return static_cast<std::uint64_t>(
      std::max(0.0, std::floor(counts_since_power_on(host) - zero_counts_)));
}

HostStamp BoardSimulator::host_at(std::uint64_t count) const noexcept {
  const double requested = zero_counts_ + static_cast<double>(count);
  HostStamp host = options_.power_on + Duration::seconds(requested / options_.counts_hz);
  // Each turn leaves a part in ten thousand of the error, the crystal's.
  for (int i = 0; i < 4; ++i)
    host = host + Duration::seconds((requested - counts_since_power_on(host)) / options_.counts_hz);
  return host;
}

// ---- its life

void BoardSimulator::start(HostStamp at) {
  const auto& o = options_;
  BoardDescription d{o.counts_hz,       100,       kMaxMillihertz, o.lines,
                     o.feedback_inputs, o.has_pps, o.has_ins,      {}};
  std::copy(options_.serial.begin(), options_.serial.end(), d.serial);
  Random ids(options_.seed, 64);
  std::uint32_t id = 0;
  for (int i = 0; i <= boots_; ++i) id = ids.next();
  ++boots_;
  zero_counts_ = counts_since_power_on(at);
  awake_ = at + options_.boot_time;
  armed_.reset();
  std::erase_if(edges_, [](const Edge& e) { return e.input >= board_input_feedback; });
  board_init(&board_, &d, id, 0);
}

void BoardSimulator::power_cycle(HostStamp at) {
  advance(at);
  start(at);
  plan();
}

/// The earliest thing that happens by itself in the hardware, before the firmware.
HostStamp BoardSimulator::next_inside() const {
  HostStamp at = end_;
  if (reboots_done_ < options_.reboots.size()) at = std::min(at, options_.reboots[reboots_done_]);
  if (armed_) at = std::min(at, armed_at_);
  if (!edges_.empty()) at = std::min(at, edges_.front().at);
  // One count later than that at which it is due: a host time has a fraction of a count.
  return std::min(at, std::max(awake_, host_at(board_deadline(&board_) + 1)));
}

void BoardSimulator::advance(HostStamp until) {
  // Every turn handles something, and time goes on.
  while (!ended_) {
    const HostStamp at = std::max(now_, next_inside());
    if (at > until) break;
    now_ = at;
    if (at >= end_) {
      ended_ = true;
    } else if (reboots_done_ < options_.reboots.size() && options_.reboots[reboots_done_] <= at) {
      ++reboots_done_;
      start(at);
    } else if (armed_ && armed_at_ <= at) {
      make_pulse(at);
    } else if (!edges_.empty() && edges_.front().at <= at) {
      const Edge edge = edges_.front();
      edges_.pop_front();
      take_edge(edge);
    }
    serve(at);
  }
  now_ = std::max(now_, until);
}

/// A turn of the firmware's loop.
void BoardSimulator::serve(HostStamp at) {
  if (at < awake_ || ended_) return;
  const std::uint64_t now = count_at(at);
  board_poll(&board_, now);
  if (board_wants_disarm(&board_)) {
    armed_.reset();
    board_pulse_disarmed(&board_, now);
  }
  BoardPulse pulse{};
  if (!armed_ && board_schedule_pulse(&board_, now, &pulse)) {
    armed_ = pulse;
    armed_at_ = host_at(pulse.count);
  }
}

void BoardSimulator::make_pulse(HostStamp at) {
  const BoardPulse pulse = *std::exchange(armed_, std::nullopt);
  // Before the firmware hears of it: the cameras do.
  ++made_;
  SimulatedExposures exposures{};
  if (pulses_) exposures = pulses_({board_.boot_id, pulse.number, at, pulse.lines});
  board_pulse_made(&board_, std::max(pulse.count, count_at(at)), pulse.count, false);
  const std::uint8_t active_low = board_configuration(&board_)->feedback_active_low;
  for (unsigned k = 0; k < options_.feedback_inputs && k < exposures.size(); ++k) {
    if (!exposures[k].happens) continue;
    const bool active = ((active_low >> k) & 1U) == 0;
    const auto input = static_cast<BoardInput>(board_input_feedback + k);
    plan_edge({std::max(at, exposures[k].start), input, active});
    plan_edge({std::max(at, exposures[k].end), input, !active});
  }
}

void BoardSimulator::take_edge(const Edge& edge) {
  const std::uint64_t count = count_at(edge.at);
  if (edge.at >= awake_) board_edge(&board_, count, edge.input, edge.rising, count);
  if (edge.input != board_input_pps) return;
  if (edge.rising)
    plan_edge({edge.at + kPpsWidth, board_input_pps, false});
  else
    plan_pps(edge.at);
}

void BoardSimulator::plan_edge(const Edge& edge) {
  const auto later = [](const Edge& a, const Edge& b) { return a.at < b.at; };
  edges_.insert(std::upper_bound(edges_.begin(), edges_.end(), edge, later), edge);
}

void BoardSimulator::plan_pps(HostStamp after) {
  plan_edge({HostStamp((after.ns() / kSecond.ns() + 1) * kSecond.ns()), board_input_pps, true});
}

// ---- its line

void BoardSimulator::receive(std::span<const std::uint8_t> bytes, HostStamp at) {
  advance(at);
  const std::uint64_t now = count_at(at);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const HostStamp came = at - byte_time() * static_cast<std::int64_t>(bytes.size() - 1 - i);
    if (came >= awake_ && !ended_) board_receive(&board_, now, count_at(came), bytes[i]);
  }
  serve(at);
  plan();
}

void BoardSimulator::produce(HostStamp at, std::vector<std::uint8_t>* out) {
  advance(at);
  serve(at);
  if (at >= awake_ && at >= line_free_ && !ended_) {
    std::array<std::uint8_t, trigger_max_frame> frame{};
    std::size_t size = board_send(&board_, count_at(at), frame.data());
    line_free_ = at + byte_time() * static_cast<std::int64_t>(size);
    // A start that comes while the frame is on the wire ends it there.
    if (reboots_done_ < options_.reboots.size() && options_.reboots[reboots_done_] < line_free_)
      size = std::min(size, static_cast<std::size_t>((options_.reboots[reboots_done_] - at).ns() /
                                                     byte_time().ns()));
    out->insert(out->end(), frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(size));
  }
  plan();
}

void BoardSimulator::plan() {
  next_.reset();
  if (ended_) return;
  HostStamp at = next_inside();
  if (board_.outbox.used > 0) at = std::min(at, std::max(awake_, line_free_));
  next_ = std::max(now_, at);
}

}  // namespace vergence::test
