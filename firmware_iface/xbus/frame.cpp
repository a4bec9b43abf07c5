#include "firmware_iface/xbus/frame.hpp"

#include <algorithm>
#include <cassert>
#include <cstring>

#include "firmware_iface/xbus/bytes.hpp"

namespace vergence::xbus {
namespace {

// FA, bus, id and length.
constexpr std::size_t kShortHeader = 4;
// Adds two bytes of length.
constexpr std::size_t kExtendedHeader = 6;
constexpr std::size_t kLongestShortPayload = 254;

std::uint8_t sum(std::span<const std::uint8_t> bytes) noexcept {
  unsigned total = 0;
  for (const std::uint8_t b : bytes) total += b;
  return static_cast<std::uint8_t>(total);
}

}  // namespace

ParsedFrame parse_frame(std::span<const std::uint8_t> bytes) noexcept {
  const auto refused = [](FrameStatus why) { return ParsedFrame{why, 0, {}}; };
  if (bytes.empty()) return refused(FrameStatus::incomplete);
  if (bytes[0] != kPreamble) return refused(FrameStatus::no_preamble);
  // Each byte is judged as soon as it is there: a false preamble shall not hold up the stream.
  if (bytes.size() > 1 && bytes[1] != kBusMaster && bytes[1] != kBusFirst)
    return refused(FrameStatus::bus_refused);
  if (bytes.size() < kShortHeader) return refused(FrameStatus::incomplete);
  std::size_t header = kShortHeader, length = bytes[3];
  if (bytes[3] == kLengthExtended) {
    if (bytes.size() < kExtendedHeader) return refused(FrameStatus::incomplete);
    header = kExtendedHeader;
    length = read_u16(bytes.subspan(4));
    if (length > kMaxPayload) return refused(FrameStatus::length_refused);
  }
  const std::size_t size = header + length + 1;
  if (bytes.size() < size) return refused(FrameStatus::incomplete);
  if (sum(bytes.subspan(1, size - 1)) != 0) return refused(FrameStatus::checksum_wrong);
  return {FrameStatus::ok, size, {bytes[1], bytes[2], bytes.subspan(header, length)}};
}

WrittenFrame write_frame(const Message& message, std::span<std::uint8_t> out) noexcept {
  const std::size_t length = message.payload.size();
  if (length > kMaxPayload) return {WriteStatus::payload_too_long, 0};
  const bool extended = length > kLongestShortPayload;
  const std::size_t header = extended ? kExtendedHeader : kShortHeader, size = header + length + 1;
  if (out.size() < size) return {WriteStatus::no_room, 0};
  out[0] = kPreamble;
  out[1] = message.bus;
  out[2] = message.id;
  out[3] = extended ? kLengthExtended : static_cast<std::uint8_t>(length);
  if (extended) {
    out[4] = static_cast<std::uint8_t>(length >> 8U);
    out[5] = static_cast<std::uint8_t>(length);
  }
  if (length > 0) std::memmove(&out[header], message.payload.data(), length);
  out[size - 1] = static_cast<std::uint8_t>(0U - sum(out.subspan(1, size - 2)));
  return {WriteStatus::ok, size};
}

std::size_t FrameStream::accept(std::span<const std::uint8_t> bytes) noexcept {
  if (begin_ == end_) begin_ = end_ = 0;
  if (bytes.size() > buffer_.size() - end_ && begin_ > 0) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
  }
  const std::size_t n = std::min(bytes.size(), buffer_.size() - end_);
  if (n > 0) std::memcpy(buffer_.data() + end_, bytes.data(), n);
  end_ += n;
  return n;
}

bool FrameStream::next(Message* message) noexcept {
  // Every round returns or skips at least a byte.
  while (begin_ < end_) {
    const ParsedFrame frame = parse_frame({buffer_.data() + begin_, end_ - begin_});
    switch (frame.status) {
      case FrameStatus::ok:
        begin_ += frame.size;
        ++counters_.messages;
        counters_.message_bytes += frame.size;
        *message = frame.message;
        return true;
      case FrameStatus::incomplete:
        return false;
      case FrameStatus::no_preamble: {
        const void* preamble = std::memchr(buffer_.data() + begin_, kPreamble, end_ - begin_);
        skip(preamble == nullptr
                 ? end_ - begin_
                 : static_cast<std::size_t>(static_cast<const std::uint8_t*>(preamble) -
                                            (buffer_.data() + begin_)));
        continue;
      }
      case FrameStatus::bus_refused:
        ++counters_.bus_refused;
        break;
      case FrameStatus::length_refused:
        ++counters_.length_refused;
        break;
      case FrameStatus::checksum_wrong:
        ++counters_.checksum_wrong;
        break;
    }
    skip(1);
  }
  return false;
}

void FrameStream::abandon() noexcept {
  if (begin_ == end_) return;
  ++counters_.abandoned;
  skip(1);
}

void FrameStream::reset() noexcept { skip(end_ - begin_); }

void FrameStream::skip(std::size_t n) noexcept {
  assert(n <= end_ - begin_);
  begin_ += n;
  counters_.garbage_bytes += n;
}

}  // namespace vergence::xbus
