#include "drivers/iidc/camera_registers.hpp"

#include <time.h>

#include <array>
#include <bit>
#include <cmath>
#include <span>

#include "drivers/clock.hpp"
#include "drivers/format_text.hpp"

namespace vergence::iidc {
namespace {

// Interval of polling a register.
constexpr Duration kPollInterval = Duration::milliseconds(1);

void pause(Duration d) noexcept {
  timespec t{static_cast<time_t>(d.ns() / 1'000'000'000),
             static_cast<long>(d.ns() % 1'000'000'000)};
  (void)::nanosleep(&t, nullptr);
}

}  // namespace

void CameraRegisters::fail(DeviceStatus status, std::uint64_t address, bool writing) noexcept {
  status_ = last_failure_ = status;
  failed_at_ = address;
  failed_writing_ = writing;
}

std::uint32_t CameraRegisters::get_at(std::uint64_t address) noexcept {
  if (status_ != DeviceStatus::ok) return 0;
  std::uint32_t value = 0;
  const DeviceStatus status = port_->read(address, &value);
  if (status == DeviceStatus::ok) return value;
  fail(status, address, false);
  return 0;
}

void CameraRegisters::set_at(std::uint64_t address, std::uint32_t value) noexcept {
  if (status_ != DeviceStatus::ok) return;
  const DeviceStatus status = port_->write(address, value);
  if (status != DeviceStatus::ok) fail(status, address, true);
}

std::uint32_t CameraRegisters::get_optional(std::uint32_t offset) noexcept {
  if (status_ != DeviceStatus::ok) return 0;
  std::uint32_t value = 0;
  const DeviceStatus status = port_->read(base_ + offset, &value);
  if (status == DeviceStatus::ok) return value;
  if (status != DeviceStatus::unsupported) fail(status, base_ + offset, false);
  return 0;
}

std::uint64_t CameraRegisters::table(std::uint32_t offset) noexcept {
  // Largest offset inside the node's register space.
  constexpr std::uint32_t kLargest = 0x0FFF'FFFF / 4;
  const std::uint32_t quadlets = get(offset);
  return quadlets == 0 || quadlets > kLargest
             ? 0
             : kRegisterSpace + 4 * static_cast<std::uint64_t>(quadlets);
}

void CameraRegisters::await_clear(std::uint64_t address, std::uint32_t bits) noexcept {
  const HostStamp end = monotonic_now() + patience_;
  while ((get_at(address) & bits) != 0 && status_ == DeviceStatus::ok) {
    if (monotonic_now() > end) return fail(DeviceStatus::timeout, address, false);
    pause(kPollInterval);
  }
}

bool CameraRegisters::has_mode(unsigned format, unsigned mode) noexcept {
  return (get(reg::kFormatInquiry) & bit(31 - format)) != 0 &&
         (get(reg::mode_inquiry(format)) & bit(31 - mode)) != 0;
}

AbsoluteRange CameraRegisters::absolute_range(Feature f) noexcept {
  const FeatureInquiry q = inquiry(f);
  if (!q.present || !q.absolute) return {};
  const std::uint64_t csr = table(reg::feature_absolute_base(f));
  if (csr == 0) return {};
  AbsoluteRange range;
  range.least = static_cast<double>(std::bit_cast<float>(get_at(csr + reg::absolute::kMin)));
  range.most = static_cast<double>(std::bit_cast<float>(get_at(csr + reg::absolute::kMax)));
  range.present =
      std::isfinite(range.least) && std::isfinite(range.most) && range.least <= range.most;
  return range;
}

double CameraRegisters::set_absolute(Feature f, double value) noexcept {
  const std::uint64_t csr = table(reg::feature_absolute_base(f));
  if (csr == 0) return value;
  FeatureValue v = FeatureValue::of(get(reg::feature_value(f)));
  v.absolute = v.on = true;
  v.automatic = v.one_push = false;
  set(reg::feature_value(f), v.quadlet());
  set_at(csr + reg::absolute::kValue, std::bit_cast<std::uint32_t>(static_cast<float>(value)));
  const auto rounded =
      static_cast<double>(std::bit_cast<float>(get_at(csr + reg::absolute::kValue)));
  return std::isfinite(rounded) ? rounded : value;
}

void CameraRegisters::switch_off(Feature f) noexcept {
  const FeatureInquiry q = inquiry(f);
  if (!q.present || (!q.on_off && !q.automatic)) return;
  FeatureValue v = FeatureValue::of(get(reg::feature_value(f)));
  v.automatic = v.one_push = false;
  if (q.on_off) v.on = false;
  set(reg::feature_value(f), v.quadlet());
}

void CameraRegisters::software_trigger() noexcept {
  await_clear(base_ + reg::kSoftwareTrigger, bit(31));
  set(reg::kSoftwareTrigger, bit(31));
}

bool CameraRegisters::apply_format7(std::uint64_t csr, std::uint32_t error) noexcept {
  using namespace reg::format7;
  if ((get_at(csr + kValueSetting) & kValuePresent) == 0) return status_ == DeviceStatus::ok;
  set_at(csr + kValueSetting, kValueApply);
  await_clear(csr + kValueSetting, kValueApply);
  return (get_at(csr + kValueSetting) & error) == 0 && status_ == DeviceStatus::ok;
}

DeviceStatus CameraRegisters::pop_status() noexcept {
  const DeviceStatus status = status_;
  status_ = DeviceStatus::ok;
  return status;
}

std::string CameraRegisters::last_error() const {
  if (last_failure_ == DeviceStatus::ok) return {};
  const char* what = last_failure_ == DeviceStatus::timeout       ? "did not become ready in time"
                     : last_failure_ == DeviceStatus::unsupported ? "was refused by the camera"
                     : last_failure_ == DeviceStatus::disconnected
                         ? "was not answered: the camera is disconnected"
                         : "could not be reached";
  return format_text("register 0x%llx %s%s",
                     static_cast<unsigned long long>(failed_at_ - kRegisterSpace), what,
                     failed_writing_ ? " (writing)" : "");
}

DeviceStatus read_rom(RegisterPort* port, ConfigRom* rom, std::string* message) {
  std::array<std::uint32_t, kMaxRomQuadlets> quadlets{};
  std::size_t n = 0;
  DeviceStatus status = DeviceStatus::ok;
  for (; n < quadlets.size(); ++n) {
    status = port->read(kRomAddress + 4 * n, &quadlets[n]);
    if (status != DeviceStatus::ok) break;
  }
  if (n == 0) {
    *message = "its configuration ROM cannot be read";
    return status;
  }
  // Some cameras end their ROM with a timeout instead of a refusal; the data read so far decide.
  const RomStatus parsed = parse_config_rom(std::span(quadlets).first(n), rom);
  if (parsed == RomStatus::ok) return DeviceStatus::ok;
  *message = to_string(parsed);
  return status == DeviceStatus::disconnected ? status : DeviceStatus::failed;
}

}  // namespace vergence::iidc
