#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "drivers/mock/simulators/device_model.hpp"
#include "drivers/mock/simulators/outage_schedule.hpp"
#include "drivers/serial/byte_line.hpp"

namespace vergence::mock {

struct SimulatedLineOptions {
  bool converter = true;  // a USB converter of FTDI's kind; false: bytes go straight into the host
  Duration latency_timer = Duration::milliseconds(16);
  std::size_t fifo = 14;  // without a converter: bytes that come at once, at the latest; 64:
                          // packets of a device's own USB
  double converter_clock_ppm = 20;  // of its timer against the host's USB frames
  Duration transfer =
      Duration::microseconds(125);  // from the USB frame to the reading program at best
  double late_fraction = 0.01;      // of the arrivals: the reading program is late …
  Duration late_mean = Duration::milliseconds(4);  // … by an exponential time of this mean
  double sent_late_fraction = 0;                   // of what the host writes: it leaves late …
  Duration sent_late_mean = Duration::milliseconds(4);  // … by an exponential time of this mean
  double corrupt = 0;             // of the bytes from the device: one bit flips
  std::vector<Outage> outages{};  // in order
  HostStamp start{};              // of virtual time
  bool real_time = false;         // the clock is the host's: reads wait
  std::uint64_t seed = 1;
};

/// A serial line to a simulated device: pacing by the baud rate, and the converter's packets.
///
/// Model  A byte takes ten bits. The converter gathers 62 bytes to a packet and sends it with the
///        next USB frame (1 ms); when its latency timer has run since the last packet, what is
///        there then goes as a short packet with the next frame. The host's transfer is complete
///        with a short packet or with eight full ones (496 bytes); only then do the bytes reach the
///        reading program. So a dense stream with a long timer comes in bursts of 496 bytes.
/// Time   Virtual unless real_time: reading is what lets it pass. Deterministic by the seed.
/// Threads  As ByteLine says; the place's own calls: one caller, while no line of it is in use.
class SimulatedPlace final : public LinePlace {
 public:
  SimulatedPlace(std::shared_ptr<DeviceModel> device, const SimulatedLineOptions& options);
  ~SimulatedPlace() override;

  [[nodiscard]] std::unique_ptr<ByteLine> open(const LineSettings& settings,
                                               DeviceStatus* status) override;
  [[nodiscard]] std::string name() const override { return "simulated line"; }
  [[nodiscard]] Duration latency_timer() const override;
  [[nodiscard]] bool pass(Duration time) override;

  class World;  // what is between device and host; lives as long as the place or a line of it

 private:
  std::shared_ptr<World> world_;
};

}  // namespace vergence::mock
