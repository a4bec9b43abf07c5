#include "firmware_iface/xbus/line_budget.hpp"

#include <algorithm>
#include <array>

#include "firmware_iface/xbus/mtdata2.hpp"

namespace vergence::xbus {
namespace {

constexpr double kBitsPerByte = 10;
constexpr std::size_t kPacketHeader = 3;
constexpr std::array<std::uint32_t, 10> kBauds{4800,   9600,   19200,  38400,  57600,
                                               115200, 230400, 460800, 921600, 2000000};

/// `fixed`: bytes a second that do not grow with the samples' rate.
LineBudget budget(double bytes_per_sample, double rate_hz, double fixed,
                  std::uint32_t baud) noexcept {
  LineBudget b;
  b.bytes_per_second = bytes_per_sample * rate_hz + fixed;
  b.load = b.bytes_per_second * kBitsPerByte / baud;
  b.greatest_rate =
      bytes_per_sample > 0
          ? std::max(0.0, (kMaxLineLoad * baud / kBitsPerByte - fixed) / bytes_per_sample)
          : 0;
  for (const std::uint32_t candidate : kBauds)
    if (b.baud_needed == 0 && b.bytes_per_second * kBitsPerByte <= kMaxLineLoad * candidate)
      b.baud_needed = candidate;
  return b;
}

bool of_receiver(std::uint16_t id) noexcept { return (id & 0xF000U) == 0x7000U; }

/// A satellite list of the length that is seen under open sky stands for those of unknown length.
std::size_t bytes_of(std::uint16_t id) noexcept {
  constexpr std::size_t kSkyfull = 8 + 4 * 30;
  return kPacketHeader + packet_size(id).value_or(kSkyfull);
}

}  // namespace

LineBudget line_budget(const MtdataLayout& layout, double rate_hz, std::uint32_t baud) noexcept {
  return budget(static_cast<double>(frame_size(layout.payload_size().value_or(0))), rate_hz, 0,
                baud);
}

LineBudget line_budget(const OutputConfiguration& outputs, std::uint32_t baud) noexcept {
  std::uint16_t rate = 0;
  std::size_t with_every = 0, with_samples = 0;
  for (const OutputEntry& e : outputs.items()) {
    if (e.rate_hz == kEveryMessage)
      with_every += bytes_of(e.id);
    else if (!of_receiver(e.id))
      rate = std::max(rate, e.rate_hz);
  }
  double receiver = 0;
  for (const OutputEntry& e : outputs.items()) {
    if (e.rate_hz == kEveryMessage) continue;
    if (of_receiver(e.id))
      receiver += static_cast<double>(frame_size(bytes_of(e.id) + with_every)) * e.rate_hz;
    else  // slower ones as if they came with every sample: a bound
      with_samples += bytes_of(e.id);
  }
  return budget(static_cast<double>(frame_size(with_samples + with_every)), rate, receiver, baud);
}

}  // namespace vergence::xbus
