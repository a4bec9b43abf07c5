#pragma once
#include <functional>
#include <memory>
#include <utility>

#include "tests/support/simulators/device_model.hpp"

namespace vergence::test {

/// A device whose bytes a test changes or drops on their way to the host.
class Tampered final : public DeviceModel {
 public:
  // The frame is complete and unchanged.
  using Tamper = std::function<void(HostStamp at, std::vector<std::uint8_t>* frame)>;
  explicit Tampered(std::shared_ptr<DeviceModel> device, Tamper tamper = {})
      : device_(std::move(device)), tamper_(std::move(tamper)) {}
  void tamper(Tamper tamper) { tamper_ = std::move(tamper); }
  /// Called for bytes from the host; returns true if they are lost.
  using Loss = std::function<bool(HostStamp at, std::span<const std::uint8_t> bytes)>;
  void lose(Loss loss) { loss_ = std::move(loss); }
  void receive(std::span<const std::uint8_t> bytes, HostStamp at) override {
    if (!loss_ || !loss_(at, bytes)) device_->receive(bytes, at);
  }
  std::optional<HostStamp> next() const override { return device_->next(); }
  void produce(HostStamp at, std::vector<std::uint8_t>* out) override {
    std::vector<std::uint8_t> frame;
    device_->produce(at, &frame);
    if (!frame.empty() && tamper_) tamper_(at, &frame);
    out->insert(out->end(), frame.begin(), frame.end());
  }
  std::uint32_t baud() const override { return device_->baud(); }
  void power_cycle(HostStamp at) override { device_->power_cycle(at); }
  bool ended() const override { return device_->ended(); }

 private:
  std::shared_ptr<DeviceModel> device_;
  Tamper tamper_;
  Loss loss_;
};

}  // namespace vergence::test
