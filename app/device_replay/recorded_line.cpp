#include "app/device_replay/recorded_line.hpp"

#include <algorithm>
#include <atomic>
#include <utility>

namespace vergence::app {
namespace {

using Kind = LineEvent::Kind;
using Step = LineRecord::Step;

/// Reads that are woken for a write before it is passed over: a driver's loop may go round once for
/// something else.
constexpr int kPatience = 4;
/// Steps ahead in which a write of the driver is looked for, where it is early.
constexpr std::size_t kAhead = 256;

}  // namespace

class RecordedPlace::Conversation {
 public:
  Conversation(const LineRecord& record, HostStamp until) : record_(record), until_(until) {
    made_.resize(record.steps.size());
    for (const Step& step : record.steps)
      if (step.event.kind == Kind::opened) {
        const auto bytes = record.bytes_of(step);
        name_.assign(bytes.begin(), bytes.end());
        latency_ = Duration::microseconds(step.event.value);
        break;
      }
  }

  /// False: no line was opened any more.
  bool open() noexcept {
    while (!at_end() && step().event.kind != Kind::opened) pass_over();
    if (at_end()) return false;
    pass_to(step().event.time);
    next();
    return true;
  }

  LineRead read(std::span<std::uint8_t> out) noexcept {
    for (;;) {  // each turn passes a step over, or returns
      if (at_end()) return {DeviceStatus::ended, 0, now_};
      const LineEvent& event = step().event;
      // Then the driver gave the line up; now it has to.
      if (event.kind == Kind::opened) return {DeviceStatus::gone, 0, now_};
      if (event.kind == Kind::read) return bytes(out);
      if (event.kind == Kind::timeout || event.kind == Kind::lost) {
        const auto status = event.kind == Kind::timeout ? DeviceStatus::timeout
                                                        : static_cast<DeviceStatus>(event.value);
        pass_to(event.time);
        next();
        return {status, 0, now_};
      }
      if (made_[at_]) {
        next();
        continue;
      }
      if (++woken_ > kPatience) {
        pass_over();
        continue;
      }
      pass_to(event.time);
      // Who waits for a baud rate takes the time out for an end; who writes, for a question.
      return {event.kind == Kind::written ? DeviceStatus::stopped : DeviceStatus::timeout, 0, now_};
    }
  }

  void write(std::span<const std::uint8_t> given) noexcept {
    for (std::size_t i = at_; i < std::min(record_.steps.size(), at_ + kAhead); ++i) {
      const Step& s = record_.steps[i];
      if (s.event.kind == Kind::opened) break;
      if (s.event.kind != Kind::written || made_[i]) continue;
      const auto then = record_.bytes_of(s);
      if (!std::equal(given.begin(), given.end(), then.begin(), then.end())) continue;
      made_[i] = true;
      ++counters_.writes;
      return;
    }
    if (!writes_next()) {
      ++counters_.other;
      return;
    }
    // Numbered otherwise since something else was written at another place, it stands for what was
    // written here.
    ++counters_.in_place;
    made_[at_] = true;
  }

  /// Reads before the switch that the driver did not make are lost, as on a line.
  void set_baud(std::uint32_t baud) noexcept {
    for (std::size_t i = at_; i < record_.steps.size(); ++i) {
      const LineEvent& event = record_.steps[i].event;
      if (event.kind == Kind::opened || (event.kind == Kind::baud && event.value != baud)) return;
      if (event.kind != Kind::baud) continue;
      at_ = i;
      pass_to(event.time);
      return next();
    }
  }

  /// What the driver's last look had told it, where it then wrote.
  [[nodiscard]] HostStamp now() noexcept {
    if (!writes_next()) return now_;
    if (before_writes_ && announced_ <= at_) {
      announced_ = at_ + 1;
      before_writes_(record_.bytes_of(step()));
    }
    return std::max(now_, step().event.time);
  }
  [[nodiscard]] bool at_end() const noexcept {
    return at_ >= record_.steps.size() || step().event.time > until_;
  }
  void before_writes(std::function<void(std::span<const std::uint8_t>)> call) {
    before_writes_ = std::move(call);
  }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] Duration latency() const noexcept { return latency_; }
  [[nodiscard]] const LineReplayCounters& counters() const noexcept { return counters_; }

 private:
  [[nodiscard]] const Step& step() const noexcept { return record_.steps[at_]; }

  void next() noexcept {
    ++at_;
    taken_ = 0;
    woken_ = 0;
  }
  void pass_over() noexcept {
    if (step().event.kind == Kind::written && !made_[at_]) ++counters_.not_made;
    next();
  }
  [[nodiscard]] bool writes_next() const noexcept {
    return !at_end() && step().event.kind == Kind::written && !made_[at_];
  }
  void pass_to(HostStamp then) noexcept { now_ = std::max(now_, then); }
  LineRead bytes(std::span<std::uint8_t> out) noexcept {
    const auto left = record_.bytes_of(step()).subspan(taken_);
    const std::size_t size = std::min(left.size(), out.size());
    const HostStamp arrival = step().event.time;
    pass_to(arrival);
    std::copy_n(left.begin(), size, out.begin());
    taken_ += size;
    if (size == left.size()) next();
    ++counters_.reads;
    return {DeviceStatus::ok, size, arrival};
  }

  const LineRecord& record_;
  const HostStamp until_;
  std::vector<bool> made_;  // by step: the driver wrote it
  std::string name_;
  Duration latency_{};
  HostStamp now_{};
  std::size_t at_ = 0;
  std::size_t taken_ = 0;  // of the bytes of the step in hand
  int woken_ = 0;          // for the write in hand
  std::function<void(std::span<const std::uint8_t>)> before_writes_;
  std::size_t announced_ = 0;  // steps before this were
  LineReplayCounters counters_{};
};

namespace {

class RecordedLine final : public ByteLine {
 public:
  RecordedLine(std::shared_ptr<RecordedPlace::Conversation> conversation, std::uint32_t baud)
      : conversation_(std::move(conversation)), baud_(baud) {}

  LineRead read(std::span<std::uint8_t> out, Duration /*limit*/) noexcept override {
    if (woken_.exchange(false, std::memory_order_acq_rel))
      return {DeviceStatus::stopped, 0, conversation_->now()};
    return conversation_->read(out);
  }
  DeviceStatus write(std::span<const std::uint8_t> bytes, Duration /*limit*/) noexcept override {
    conversation_->write(bytes);
    return DeviceStatus::ok;
  }
  DeviceStatus set_baud(std::uint32_t baud) noexcept override {
    conversation_->set_baud(baud);
    baud_ = baud;
    return DeviceStatus::ok;
  }
  std::uint32_t baud() const noexcept override { return baud_; }
  void discard_input() noexcept override {}  // what was discarded then was not recorded
  void wake() noexcept override { woken_.store(true, std::memory_order_release); }
  HostStamp now() const noexcept override { return conversation_->now(); }

 private:
  std::shared_ptr<RecordedPlace::Conversation> conversation_;
  std::uint32_t baud_;
  std::atomic<bool> woken_{false};
};

}  // namespace

RecordedPlace::RecordedPlace(const LineRecord& record, HostStamp until)
    : conversation_(std::make_shared<Conversation>(record, until)) {}
RecordedPlace::~RecordedPlace() = default;

std::unique_ptr<ByteLine> RecordedPlace::open(const LineSettings& settings, DeviceStatus* status) {
  (void)conversation_->open();
  *status = DeviceStatus::ok;
  return std::make_unique<RecordedLine>(conversation_, settings.baud);
}

std::string RecordedPlace::name() const { return conversation_->name(); }
Duration RecordedPlace::latency_timer() const { return conversation_->latency(); }
bool RecordedPlace::exhausted() const noexcept { return conversation_->at_end(); }
const LineReplayCounters& RecordedPlace::counters() const noexcept {
  return conversation_->counters();
}
void RecordedPlace::before_writes(std::function<void(std::span<const std::uint8_t>)> call) {
  conversation_->before_writes(std::move(call));
}

}  // namespace vergence::app
