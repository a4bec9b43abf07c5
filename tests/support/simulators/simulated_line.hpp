#pragma once
#include <deque>

#include "drivers/serial/serial_link.hpp"
#include "tests/support/simulators/device_model.hpp"

namespace vergence::test {

/// The line is unplugged for a while.
struct Outage {
  HostStamp from{}, to{};
  /// False: the device is off, too.
  bool device_powered = true;
};

/// A serial to USB converter of FTDI's kind, from the bytes of its line to complete transfers of
/// the host's controller.
///
/// It gathers 62 bytes to a packet and sends it with the next USB frame (1 ms); when its latency
/// timer has run since the last packet, what is there then goes as a short packet with the next
/// frame. A transfer is complete with a short packet or with eight full ones.
/// Threads  One caller. Time: the caller's, in the order of timer_at() and frame_at(). Errors:
///          none.
class UsbConverter {
 public:
  /// `clock_ppm` of its timer against the host's USB frames; `first_frame` of those.
  UsbConverter(Duration latency_timer, double clock_ppm, HostStamp now,
               HostStamp first_frame) noexcept;

  /// When its timer runs out; none: it has, and waits for a frame.
  [[nodiscard]] std::optional<HostStamp> timer_at() const noexcept;
  [[nodiscard]] HostStamp frame_at() const noexcept { return next_frame_; }

  void receive(std::uint8_t byte) { chip_.push_back(byte); }
  /// Available bytes are sent with the next frame, later ones are not.
  void run_out();
  /// A USB frame: the transfers that are complete by it are appended.
  void frame(HostStamp now, std::vector<std::vector<std::uint8_t>>* transfers);

  /// Nothing is under way in it.
  [[nodiscard]] bool empty() const noexcept {
    return chip_.empty() && short_packet_.empty() && transfer_.empty();
  }
  void discard() noexcept;

 private:
  void packet_went(HostStamp now) noexcept;
  void complete(std::vector<std::vector<std::uint8_t>>* transfers);

  Duration timer_;
  HostStamp next_frame_, last_packet_;
  bool timer_ran_out_ = false;
  /// Received, in no packet yet.
  std::deque<std::uint8_t> chip_;
  /// Waits for a frame.
  std::vector<std::uint8_t> short_packet_;
  /// Gathered by the host's controller.
  std::vector<std::uint8_t> transfer_;
  std::size_t transfer_packets_ = 0;
};

struct SimulatedLineOptions {
  /// A USB converter of FTDI's kind; false: bytes go straight into the host.
  bool converter = true;
  Duration latency_timer = Duration::milliseconds(16);
  /// Most bytes that come at once without a converter; 64: packets of a device's own USB.
  std::size_t fifo = 14;
  /// Error of the converter's timer against the host's USB frames.
  double converter_clock_ppm = 20;
  /// From the USB frame to the reading program at best.
  Duration transfer = Duration::microseconds(125);
  /// Share of the arrivals that the reading program takes late, by an exponential time of mean
  /// `late_mean`.
  double late_fraction = 0.01;
  Duration late_mean = Duration::milliseconds(4);
  /// Share of the host's writes that leave late, by an exponential time of mean `sent_late_mean`.
  double sent_late_fraction = 0;
  Duration sent_late_mean = Duration::milliseconds(4);
  /// Share of the bytes from the device in which one bit flips.
  double corrupt = 0;
  /// In order.
  std::vector<Outage> outages{};
  /// Start of virtual time.
  HostStamp start{};
  std::uint64_t seed = 1;
};

/// A serial line to a simulated device: pacing by the baud rate, and the converter's packets.
///
/// Model  A byte takes ten bits. The converter gathers 62 bytes to a packet and sends it with the
///        next USB frame (1 ms); when its latency timer has run since the last packet, what is
///        there then goes as a short packet with the next frame. The host's transfer is complete
///        with a short packet or with eight full ones (496 bytes); only then do the bytes reach the
///        reading program. So a dense stream with a long timer comes in bursts of 496 bytes.
/// Time   Virtual: reading is what lets it pass. Deterministic by the seed.
/// Threads  As SerialLink says; the place's own calls: one caller, while no line of it is in use.
class SimulatedLinkFactory final : public SerialLinkFactory {
 public:
  SimulatedLinkFactory(std::shared_ptr<DeviceModel> device, const SimulatedLineOptions& options);
  ~SimulatedLinkFactory() override;

  [[nodiscard]] std::unique_ptr<SerialLink> open(const LineSettings& settings,
                                                 DeviceStatus* status) override;
  [[nodiscard]] std::string name() const override { return "simulated line"; }
  [[nodiscard]] Duration latency_timer() const override;
  [[nodiscard]] bool pass(Duration time) override;

  /// State between device and host; lives as long as the place or a line of it.
  class World;

 private:
  std::shared_ptr<World> world_;
};

}  // namespace vergence::test
