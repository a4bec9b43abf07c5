#include "tests/support/simulators/xsens_simulator.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vergence::test {
namespace {

using namespace xbus;

/// Time that a host has to answer a wake-up.
constexpr Duration kWakeTime = Duration::milliseconds(500);
/// Time from power to the first byte.
constexpr Duration kStartTime = Duration::milliseconds(20);

}  // namespace

XsensSimulator::XsensSimulator(InsSource source, const XsensSimulatorOptions& options)
    : source_(std::move(source)),
      options_(options),
      random_(options.seed, 710),
      baud_(options.baud),
      settings_(options),
      messages_(options, settings_) {
  now_ = options.power_on;
  wake(now_);
}

HostStamp XsensSimulator::host_time(std::int64_t ns) const noexcept {
  return options_.power_on + Duration::nanoseconds(std::llround(static_cast<double>(ns) /
                                                                (1 + 1e-6 * options_.clock_ppm)));
}

std::int64_t XsensSimulator::device_ns(HostStamp host) const noexcept {
  return std::llround(static_cast<double>((host - options_.power_on).ns()) *
                      (1 + 1e-6 * options_.clock_ppm));
}

// ---- states

void XsensSimulator::wake(HostStamp at) {
  baud_ = settings_.stored_baud();
  in_.reset();
  outgoing_.clear();
  mode_ = Mode::waking;
  starts_at_ = at + kStartTime;
  send(starts_at_, id_of(MessageId::wake_up), {});
  waits_for_host_until_ = starts_at_ + kWakeTime;
}

void XsensSimulator::measure(HostStamp at) {
  mode_ = Mode::measuring;
  const std::int64_t period = settings_.period_ns();
  // On the device's own grid.
  sample_ns_ = (device_ns(at) / period + 2) * period;
  plan_sample();
  messages_.begin(sample_ns_);
}

void XsensSimulator::power_cycle(HostStamp at) {
  now_ = std::max(now_, at);
  messages_.power_cycle(device_ns(now_));
  wake(now_);
}

bool XsensSimulator::ended() const {
  return now_ > options_.power_on + options_.duration && outgoing_.empty();
}

// ---- what the host says

void XsensSimulator::receive(std::span<const std::uint8_t> bytes, HostStamp at) {
  now_ = std::max(now_, at);
  if (now_ < starts_at_) return;
  while (!bytes.empty()) {
    bytes = bytes.subspan(in_.accept(bytes));
    for (Message m; in_.next(&m);) handle(m);
  }
}

void XsensSimulator::answer(std::uint8_t id, std::span<const std::uint8_t> payload) {
  send(now_ + kAnswerTime, id, payload);
}

void XsensSimulator::send(HostStamp at, std::uint8_t id, std::span<const std::uint8_t> payload) {
  std::array<std::uint8_t, kMaxFrame> frame{};
  const WrittenFrame w = write_frame({kBusMaster, id, payload}, frame);
  Outgoing o{at, {frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(w.size)}};
  // In order of their times, the earlier said first among equals.
  const auto place = std::upper_bound(outgoing_.begin(), outgoing_.end(), at,
                                      [](HostStamp t, const Outgoing& e) { return t < e.at; });
  outgoing_.insert(place, std::move(o));
}

void XsensSimulator::handle(const Message& m) {
  if (m.is(MessageId::go_to_config)) {
    mode_ = Mode::configuring;
    answer(m.id + 1, {});
    return;
  }
  if (m.is(MessageId::wake_up_answer) && mode_ == Mode::waking) {
    mode_ = Mode::configuring;
    return;
  }
  if (m.is(MessageId::reset)) {
    answer(m.id + 1, {});
    // The answer still goes out at the old baud rate.
    reset_at_ = now_ + kAnswerTime * 5;
    return;
  }
  if (mode_ != Mode::configuring) return;
  if (m.is(MessageId::go_to_measurement)) return go_to_measurement(m);
  const XsensSettings::Reply reply = settings_.handle(m);
  answer(reply.id, reply.payload);
}

void XsensSimulator::go_to_measurement(const Message& m) {
  constexpr std::uint8_t kTooMuch = 0x29;
  if (settings_.line_load(baud_) > 1) {
    const XsensSettings::Reply reply = settings_.refuse(kTooMuch);
    return answer(reply.id, reply.payload);
  }
  if (settings_.legacy()) send_configuration(now_ + kAnswerTime);
  answer(m.id + 1, {});
  measure(now_ + kAnswerTime);
}

void XsensSimulator::send_configuration(HostStamp at) {
  std::array<std::uint8_t, kConfigurationSize> payload{};
  write_configuration(settings_.configuration(), payload);
  send(at, id_of(MessageId::configuration), payload);
}

// ---- what it measures

std::optional<HostStamp> XsensSimulator::next() const {
  std::optional<HostStamp> first;
  const auto consider = [&first](HostStamp t) {
    if (!first || t < *first) first = t;
  };
  if (!outgoing_.empty()) consider(outgoing_.front().at);
  if (reset_at_) consider(*reset_at_);
  if (mode_ == Mode::waking) consider(waits_for_host_until_);
  if (mode_ == Mode::measuring && sample_at_ <= options_.power_on + options_.duration)
    consider(sample_at_);
  if (silences_done_ < options_.silences.size()) consider(options_.silences[silences_done_]);
  if (!first && now_ <= options_.power_on + options_.duration)
    consider(options_.power_on + options_.duration + Duration::nanoseconds(1));
  return first;
}

void XsensSimulator::produce(HostStamp at, std::vector<std::uint8_t>* out) {
  now_ = std::max(now_, at);
  if (reset_at_ && now_ >= *reset_at_) {
    reset_at_.reset();
    power_cycle(now_);
  }
  if (silences_done_ < options_.silences.size() && now_ >= options_.silences[silences_done_]) {
    ++silences_done_;
    mode_ = Mode::mute;
    outgoing_.clear();
  }
  if (mode_ == Mode::waking && now_ >= waits_for_host_until_) {
    if (settings_.legacy()) send_configuration(now_);
    measure(now_);
  }
  if (mode_ == Mode::measuring && now_ >= sample_at_) take_sample();
  while (!outgoing_.empty() && outgoing_.front().at <= now_) {
    out->insert(out->end(), outgoing_.front().bytes.begin(), outgoing_.front().bytes.end());
    outgoing_.pop_front();
  }
}

void XsensSimulator::plan_sample() { sample_at_ = host_time(sample_ns_); }

void XsensSimulator::take_sample() {
  XsensMessages::Sample taken;
  taken.device_ns = sample_ns_;
  taken.sample = source_(samples_++, sample_at_ - options_.power_on);
  sample_times_.push_back(sample_ns_);
  if (sample_times_.size() > kRemembered) sample_times_.pop_front();
  const HostStamp ready =
      sample_at_ + options_.processing +
      Duration::nanoseconds(
          std::llround(random_.uniform() * static_cast<double>(options_.processing_jitter.ns())));
  std::vector<XsensMessages::Message> messages;
  messages_.add(taken, &random_, &messages);
  for (const XsensMessages::Message& message : messages) send(ready, message.id, message.payload);
  sample_ns_ += settings_.period_ns();
  plan_sample();
}

}  // namespace vergence::test
