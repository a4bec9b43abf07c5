#pragma once
#include <functional>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "drivers/iidc/bus.hpp"
#include "drivers/iidc/slot_memory.hpp"
#include "firmware_iface/iidc/iidc.hpp"

extern "C" {
#include "tests/rigs/emulators/iidc_model.h"
}

namespace vergence::test {

/// The register model behind a bus that is nothing but function calls.
///
/// Exposures are made by expose() on the caller's thread, which then is the stream's. Its time is
/// virtual: host and camera clock begin at kStart and 100 s, and expose() moves both.
class FakeBus final : public iidc::CameraBus {
 public:
  // Host time in ns.
  static constexpr std::int64_t kStart = 5'000'000'000'000;
  static constexpr std::int64_t kCameraStart = 100'000'000'000;

  explicit FakeBus(bool isochronous = false, bool beta = false);

  // ---- the camera's side ----
  iidc_camera& model() { return model_; }
  [[nodiscard]] iidc::ConfigRom rom();
  /// Makes exposures `period` apart and delivers them, those in `lost` (0: the first of this call)
  /// excepted.
  void expose(int count, Duration period = Duration::milliseconds(100),
              const std::set<int>& lost = {});
  /// One exposure whose buffer is changed before it is delivered: what is there, how many bytes of
  /// it are said to have come.
  using Tamper = std::function<void(std::vector<std::uint8_t>* image, std::size_t* bytes)>;
  void expose_tampered(const Tamper& tamper, Duration period = Duration::milliseconds(100));
  void unplug();
  void replug();

  // ---- faults of the registers ----
  // Address and bits that always read 1; the model need not know the register.
  std::map<std::uint64_t, std::uint32_t> stuck;
  // Address and the only bits that can read 1.
  std::map<std::uint64_t, std::uint32_t> masked;
  // Addresses that the camera refuses.
  std::set<std::uint64_t> refused;
  // Status of every access unless it is ok.
  DeviceStatus all_accesses = DeviceStatus::ok;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> written;
  DeviceStatus start_status = DeviceStatus::ok;

  // ---- CameraBus ----
  DeviceStatus read(std::uint64_t address, std::uint32_t* value) noexcept override;
  DeviceStatus write(std::uint64_t address, std::uint32_t value) noexcept override;
  const DeviceInfo& info() const noexcept override { return info_; }
  const iidc::BusTraits& traits() const noexcept override { return traits_; }
  DeviceStatus allocate(const iidc::StreamShape& shape) noexcept override;
  DeviceStatus start(iidc::StreamSink* sink) noexcept override;
  void stop() noexcept override { sink_ = nullptr; }
  DeviceStatus reopen() noexcept override;
  void give_back(FrameSlot slot) noexcept override { memory_.release(slot); }
  const std::uint8_t* bytes(FrameSlot slot) const noexcept override { return memory_.bytes(slot); }
  std::string last_error() const override { return "the fake bus says so"; }

  [[nodiscard]] HostStamp now() const { return HostStamp(kStart + elapsed_); }
  [[nodiscard]] std::int64_t camera_now() const { return kCameraStart + elapsed_; }
  [[nodiscard]] const iidc::StreamShape& shape() const { return shape_; }
  [[nodiscard]] int reopened() const { return reopened_; }
  [[nodiscard]] std::uint32_t command(std::uint32_t offset);

 private:
  void deliver(const std::vector<std::uint8_t>& image, std::size_t bytes, HostStamp at);
  std::vector<std::uint8_t> draw(std::int64_t end_of_exposure);

  iidc_camera model_{};
  DeviceInfo info_{"iidc-fake", "0205a9000000c000", "register model", "this process"};
  iidc::BusTraits traits_{};
  iidc::StreamShape shape_{};
  iidc::SlotMemory memory_;
  bool plugged_ = true;
  std::int64_t elapsed_ = 0;
  int reopened_ = 0;
  iidc::StreamSink* sink_ = nullptr;
};

}  // namespace vergence::test
