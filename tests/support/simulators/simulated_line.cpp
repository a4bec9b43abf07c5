#include "tests/support/simulators/simulated_line.hpp"

#include <algorithm>
#include <mutex>
#include <utility>

#include "core/math/random.hpp"

namespace vergence::test {

namespace {

constexpr Duration kUsbFrame = Duration::milliseconds(1);
constexpr std::size_t kPacketBytes = 62;
constexpr std::size_t kTransferPackets = 8;

}  // namespace

UsbConverter::UsbConverter(Duration latency_timer, double clock_ppm, HostStamp now,
                           HostStamp first_frame) noexcept
    : timer_(Duration::nanoseconds(
          std::llround(static_cast<double>(latency_timer.ns()) * (1 + 1e-6 * clock_ppm)))),
      next_frame_(first_frame),
      last_packet_(now) {}

std::optional<HostStamp> UsbConverter::timer_at() const noexcept {
  if (timer_ran_out_) return std::nullopt;
  return last_packet_ + timer_;
}

void UsbConverter::run_out() {
  timer_ran_out_ = true;
  if (chip_.size() >= kPacketBytes) return;
  short_packet_.assign(chip_.begin(), chip_.end());
  chip_.clear();
}

void UsbConverter::frame(HostStamp now, std::vector<std::vector<std::uint8_t>>* transfers) {
  next_frame_ = next_frame_ + kUsbFrame;
  if (timer_ran_out_ && (!short_packet_.empty() || chip_.size() < kPacketBytes)) {
    transfer_.insert(transfer_.end(), short_packet_.begin(), short_packet_.end());
    short_packet_.clear();
    packet_went(now);
    complete(transfers);
  }
  while (chip_.size() >= kPacketBytes) {
    transfer_.insert(transfer_.end(), chip_.begin(), chip_.begin() + kPacketBytes);
    chip_.erase(chip_.begin(), chip_.begin() + kPacketBytes);
    packet_went(now);
    if (++transfer_packets_ == kTransferPackets) complete(transfers);
  }
}

void UsbConverter::packet_went(HostStamp now) noexcept {
  last_packet_ = now;
  timer_ran_out_ = false;
}

void UsbConverter::complete(std::vector<std::vector<std::uint8_t>>* transfers) {
  transfer_packets_ = 0;
  if (!transfer_.empty()) transfers->push_back(std::exchange(transfer_, {}));
}

void UsbConverter::discard() noexcept {
  chip_.clear();
  short_packet_.clear();
  transfer_.clear();
  transfer_packets_ = 0;
}

/// All bytes under way, and the clock. Every member function with the mutex held.
class SimulatedLinkFactory::World {
 public:
  World(std::shared_ptr<DeviceModel> device, const SimulatedLineOptions& options)
      : device_(std::move(device)),
        options_(options),
        random_(options.seed, 62),
        now_(options.start),
        converter_(options.latency_timer, options.converter_clock_ppm, now_,
                   now_ + Duration::nanoseconds(random_.below(1'000'000))) {}

  std::mutex mutex;
  bool woken = false;

  [[nodiscard]] const SimulatedLineOptions& options() const noexcept { return options_; }
  [[nodiscard]] HostStamp now() const noexcept { return now_; }
  [[nodiscard]] bool unplugged() const noexcept {
    return outage_ < options_.outages.size() && now_ >= options_.outages[outage_].from;
  }
  [[nodiscard]] std::size_t outages_begun() const noexcept {
    return outage_ + (in_outage_ ? 1 : 0);
  }
  [[nodiscard]] bool anything_readable() const noexcept { return !ready_.empty(); }
  [[nodiscard]] bool ended() const {
    return device_->ended() && on_wire_.empty() && converter_.empty() && fifo_.empty() &&
           arriving_.empty() && ready_.empty();
  }

  /// Lets time pass until `until`, or until bytes can be read or the line is cut.
  void run(HostStamp until) {
    const std::size_t outages = outages_begun();
    while (ready_.empty() && outages == outages_begun() && step(until)) {
    }
  }
  void run_through(HostStamp until) {
    while (step(until)) {
    }
  }

  std::size_t read(std::span<std::uint8_t> out) noexcept {
    const std::size_t n = std::min(out.size(), ready_.size());
    for (std::size_t i = 0; i < n; ++i) out[i] = ready_[i];
    ready_.erase(ready_.begin(), ready_.begin() + static_cast<std::ptrdiff_t>(n));
    return n;
  }
  void send(std::span<const std::uint8_t> bytes) {
    const HostStamp begin = std::max(
        now_ + options_.transfer + late(options_.sent_late_fraction, options_.sent_late_mean),
        host_line_free_);
    host_line_free_ = begin + byte_time(host_baud_) * static_cast<std::int64_t>(bytes.size());
    to_device_.push_back({host_line_free_, {bytes.begin(), bytes.end()}});
  }
  void set_baud(std::uint32_t baud) {
    host_baud_ = baud;
    discard();
  }
  [[nodiscard]] std::uint32_t baud() const noexcept { return host_baud_; }
  void discard() {
    ready_.clear();
    arriving_.clear();
    converter_.discard();
    fifo_.clear();
  }
  void set_open(bool open) {
    open_ = open;
    discard();
  }

 private:
  struct Byte {
    HostStamp done{};
    std::uint8_t value = 0;
  };
  struct Chunk {
    HostStamp at{};
    std::vector<std::uint8_t> bytes;
  };

  [[nodiscard]] static Duration byte_time(std::uint32_t baud) noexcept {
    return Duration::nanoseconds(10'000'000'000 / baud);
  }

  /// The earliest thing that happens by `until`; false: nothing any more, and now_ is `until`.
  bool step(HostStamp until) {
    enum class What : std::uint8_t {
      nothing,
      arrival,
      outage,
      command,
      produce,
      byte,
      timer,
      frame
    } what = What::nothing;
    HostStamp at = until;
    const auto consider = [&](HostStamp t, What w) {
      if (t < at || (t == at && what == What::nothing)) at = std::max(t, now_), what = w;
    };
    if (!arriving_.empty()) consider(arriving_.front().at, What::arrival);
    if (outage_ < options_.outages.size()) {
      const Outage& outage = options_.outages[outage_];
      consider(in_outage_ ? outage.to : outage.from, What::outage);
    }
    if (!to_device_.empty()) consider(to_device_.front().at, What::command);
    if (const auto next = device_->next()) consider(*next, What::produce);
    if (!on_wire_.empty()) consider(on_wire_.front().done, What::byte);
    if (options_.converter) {
      if (const auto timer = converter_.timer_at()) consider(*timer, What::timer);
      consider(converter_.frame_at(), What::frame);
    }
    now_ = std::max(now_, at);
    switch (what) {
      case What::nothing:
        return false;
      case What::arrival:
        ready_.insert(ready_.end(), arriving_.front().bytes.begin(), arriving_.front().bytes.end());
        arriving_.pop_front();
        return true;
      case What::outage:
        change_outage();
        return true;
      case What::command:
        command();
        return true;
      case What::produce:
        produce();
        return true;
      case What::byte:
        take_byte();
        return true;
      case What::timer:
        converter_.run_out();
        return true;
      case What::frame:
        frame();
        return true;
    }
    return false;
  }

  void change_outage() {
    in_outage_ = !in_outage_;
    if (in_outage_) return discard();
    if (options_.outages[outage_++].device_powered) return;
    on_wire_.clear();
    device_->power_cycle(now_);
  }

  void command() {
    Chunk chunk = std::move(to_device_.front());
    to_device_.pop_front();
    if (in_outage_) return;
    if (device_->baud() != host_baud_) garble(&chunk.bytes);
    device_->receive(chunk.bytes, now_);
  }

  void produce() {
    std::vector<std::uint8_t> bytes;
    device_->produce(now_, &bytes);
    line_free_ = std::max(line_free_, now_);
    const Duration each = byte_time(device_->baud());
    if (device_->baud() != host_baud_) garble(&bytes);
    for (const std::uint8_t value : bytes) {
      line_free_ = line_free_ + each;
      on_wire_.push_back({line_free_, value});
    }
  }

  void take_byte() {
    std::uint8_t value = on_wire_.front().value;
    on_wire_.pop_front();
    if (in_outage_ || !open_) return;
    if (options_.corrupt > 0 && random_.uniform() < options_.corrupt)
      value ^= static_cast<std::uint8_t>(1U << random_.below(8));
    if (options_.converter) {
      converter_.receive(value);
      return;
    }
    // The UART's FIFO: an interrupt at so many bytes, or when the line falls idle.
    fifo_.push_back(value);
    if (fifo_.size() >= options_.fifo || on_wire_.empty()) arrive(std::exchange(fifo_, {}));
  }

  void frame() {
    std::vector<std::vector<std::uint8_t>> transfers;
    converter_.frame(now_, &transfers);
    for (std::vector<std::uint8_t>& bytes : transfers) arrive(std::move(bytes));
  }

  void arrive(std::vector<std::uint8_t> bytes) {
    last_arrival_ = std::max(
        last_arrival_, now_ + options_.transfer + late(options_.late_fraction, options_.late_mean));
    arriving_.push_back({last_arrival_, std::move(bytes)});
  }

  [[nodiscard]] Duration late(double fraction, Duration mean) noexcept {
    if (!(fraction > 0 && random_.uniform() < fraction)) return {};
    return Duration::nanoseconds(
        std::llround(-std::log(1 - random_.uniform()) * static_cast<double>(mean.ns())));
  }

  void garble(std::vector<std::uint8_t>* bytes) {
    for (std::uint8_t& b : *bytes) b = static_cast<std::uint8_t>(random_.next() >> 24U);
  }

  std::shared_ptr<DeviceModel> device_;
  SimulatedLineOptions options_;
  Random random_;
  HostStamp now_;
  HostStamp line_free_{}, host_line_free_{}, last_arrival_{};
  std::uint32_t host_baud_ = LineSettings{}.baud;
  bool open_ = false;
  /// Index in the options: the outage that has begun or will be next.
  std::size_t outage_ = 0;
  bool in_outage_ = false;
  std::deque<Chunk> to_device_, arriving_;
  std::deque<Byte> on_wire_;
  /// Used with options_.converter, `fifo_` without.
  UsbConverter converter_;
  std::vector<std::uint8_t> fifo_;
  /// Bytes to be read.
  std::deque<std::uint8_t> ready_;
};

namespace {

class SimulatedLine final : public SerialLink {
 public:
  explicit SimulatedLine(std::shared_ptr<SimulatedLinkFactory::World> world)
      : world_(std::move(world)), outages_(world_->outages_begun()) {
    world_->set_open(true);
  }
  SimulatedLine(const SimulatedLine&) = delete;
  SimulatedLine& operator=(const SimulatedLine&) = delete;
  ~SimulatedLine() override {
    const std::lock_guard lock(world_->mutex);
    world_->set_open(false);
  }

  LineRead read(std::span<std::uint8_t> out, Duration limit) noexcept override {
    const std::lock_guard lock(world_->mutex);
    if (disconnected()) return {DeviceStatus::disconnected, 0, world_->now()};
    const HostStamp deadline = world_->now() + limit;
    world_->run(deadline);
    if (std::exchange(world_->woken, false)) return {DeviceStatus::stopped, 0, {}};
    const HostStamp now = world_->now();
    if (disconnected()) return {DeviceStatus::disconnected, 0, now};
    if (world_->anything_readable()) return {DeviceStatus::ok, world_->read(out), now};
    return {world_->ended() ? DeviceStatus::ended : DeviceStatus::timeout, 0, now};
  }
  DeviceStatus write(std::span<const std::uint8_t> bytes, Duration /*limit*/) noexcept override {
    const std::lock_guard lock(world_->mutex);
    if (disconnected()) return DeviceStatus::disconnected;
    world_->send(bytes);
    return DeviceStatus::ok;
  }
  DeviceStatus set_baud(std::uint32_t baud) noexcept override {
    const std::lock_guard lock(world_->mutex);
    if (disconnected()) return DeviceStatus::disconnected;
    world_->set_baud(baud);
    return DeviceStatus::ok;
  }
  std::uint32_t baud() const noexcept override {
    const std::lock_guard lock(world_->mutex);
    return world_->baud();
  }
  void discard_input() noexcept override {
    const std::lock_guard lock(world_->mutex);
    world_->discard();
  }
  void wake() noexcept override {
    const std::lock_guard lock(world_->mutex);
    world_->woken = true;
  }
  HostStamp now() const noexcept override {
    const std::lock_guard lock(world_->mutex);
    return world_->now();
  }

 private:
  [[nodiscard]] bool disconnected() const noexcept { return world_->outages_begun() != outages_; }

  std::shared_ptr<SimulatedLinkFactory::World> world_;
  /// Outages that had begun when it was opened: one more, and this line is dead.
  std::size_t outages_;
};

}  // namespace

SimulatedLinkFactory::SimulatedLinkFactory(std::shared_ptr<DeviceModel> device,
                                           const SimulatedLineOptions& options)
    : world_(std::make_shared<World>(std::move(device), options)) {}
SimulatedLinkFactory::~SimulatedLinkFactory() = default;

std::unique_ptr<SerialLink> SimulatedLinkFactory::open(const LineSettings& settings,
                                                       DeviceStatus* status) {
  const std::lock_guard lock(world_->mutex);
  if (world_->unplugged()) {
    *status = DeviceStatus::not_found;
    return nullptr;
  }
  *status = DeviceStatus::ok;
  world_->set_baud(settings.baud);
  return std::make_unique<SimulatedLine>(world_);
}

Duration SimulatedLinkFactory::latency_timer() const {
  return world_->options().converter ? world_->options().latency_timer : Duration{};
}

bool SimulatedLinkFactory::pass(Duration time) {
  const std::lock_guard lock(world_->mutex);
  world_->run_through(world_->now() + time);
  return true;
}

}  // namespace vergence::test
