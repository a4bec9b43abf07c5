#include "tests/unit/drivers/iidc/fake_bus.hpp"

#include <algorithm>
#include <cstring>

#include "drivers/iidc/camera_registers.hpp"

namespace vergence::test {

FakeBus::FakeBus(bool isochronous, bool beta) {
  iidc_init(&model_, 0);
  if (beta) iidc_init_beta(&model_);
  traits_ = {isochronous, iidc::BusSpeed::s800, 8192, 53e6};
}

iidc::ConfigRom FakeBus::rom() {
  iidc::ConfigRom rom;
  std::string why;
  (void)iidc::read_rom(this, &rom, &why);
  return rom;
}

std::uint32_t FakeBus::command(std::uint32_t offset) {
  std::uint32_t value = 0;
  (void)iidc_read(&model_, iidc::kRegisterSpace + 0xF00000 + offset, &value);
  return value;
}

DeviceStatus FakeBus::read(std::uint64_t address, std::uint32_t* value) noexcept {
  if (!plugged_) return DeviceStatus::disconnected;
  if (all_accesses != DeviceStatus::ok) return all_accesses;
  const bool known = iidc_read(&model_, address, value) == 0;
  if (refused.contains(address) || (!known && !stuck.contains(address)))
    return DeviceStatus::unsupported;
  if (!known) *value = 0;
  if (const auto it = stuck.find(address); it != stuck.end()) *value |= it->second;
  if (const auto it = masked.find(address); it != masked.end()) *value &= it->second;
  return DeviceStatus::ok;
}

DeviceStatus FakeBus::write(std::uint64_t address, std::uint32_t value) noexcept {
  if (!plugged_) return DeviceStatus::disconnected;
  if (all_accesses != DeviceStatus::ok) return all_accesses;
  written.emplace_back(address, value);
  return refused.contains(address) || iidc_write(&model_, address, value) != 0
             ? DeviceStatus::unsupported
             : DeviceStatus::ok;
}

DeviceStatus FakeBus::allocate(const iidc::StreamShape& shape) noexcept {
  shape_ = shape;
  memory_.allocate(shape.buffers, shape.frame_bytes);
  return DeviceStatus::ok;
}

DeviceStatus FakeBus::start(iidc::StreamSink* sink) noexcept {
  if (!plugged_) return DeviceStatus::disconnected;
  if (start_status != DeviceStatus::ok) return start_status;
  sink_ = sink;
  return DeviceStatus::ok;
}

DeviceStatus FakeBus::reopen() noexcept {
  ++reopened_;
  return plugged_ ? DeviceStatus::ok : DeviceStatus::disconnected;
}

void FakeBus::unplug() {
  plugged_ = false;
  if (sink_ != nullptr) sink_->disconnected(now());
}

void FakeBus::replug() {
  const bool beta = model_.beta;
  iidc_init(&model_, 0);
  if (beta) iidc_init_beta(&model_);
  plugged_ = true;
}

std::vector<std::uint8_t> FakeBus::draw(std::int64_t end_of_exposure) {
  std::vector<std::uint8_t> image(std::max(iidc_frame_bytes(&model_), shape_.frame_bytes));
  iidc_draw(&model_, image.data(), static_cast<std::uint64_t>(end_of_exposure),
            iidc::CycleTime::at(end_of_exposure).quadlet());
  return image;
}

void FakeBus::deliver(const std::vector<std::uint8_t>& image, std::size_t bytes, HostStamp at) {
  if (sink_ == nullptr) return;
  // As the real buses: a free buffer must be there to replace a full one; one is always on the
  // wire.
  const auto filling = memory_.acquire();
  if (!filling) return;
  const auto next = memory_.acquire();
  bytes = std::min(bytes, shape_.frame_bytes);
  std::memcpy(memory_.bytes(*filling), image.data(), bytes);
  const iidc::Arrival a{*filling, memory_.bytes(*filling), bytes, at, false, next.has_value()};
  if (next) memory_.release(*next);
  if (!sink_->frame(a)) memory_.release(*filling);
}

void FakeBus::expose(int count, Duration period, const std::set<int>& lost) {
  for (int i = 0; i < count; ++i) {
    elapsed_ += period.ns();
    if (!model_.transmitting) continue;
    const auto image = draw(camera_now());
    if (!lost.contains(i)) deliver(image, shape_.frame_bytes, now() + Duration::milliseconds(5));
  }
}

void FakeBus::expose_tampered(const Tamper& tamper, Duration period) {
  elapsed_ += period.ns();
  auto image = draw(camera_now());
  std::size_t bytes = shape_.frame_bytes;
  tamper(&image, &bytes);
  deliver(image, bytes, now() + Duration::milliseconds(5));
}

}  // namespace vergence::test
