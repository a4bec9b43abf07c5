#include "firmware_iface/ubx/ubx.hpp"

#include <algorithm>

namespace vergence::ubx {
namespace {

using Bytes = std::span<const std::uint8_t>;

std::uint16_t read_u16(Bytes b, std::size_t at) noexcept {
  return static_cast<std::uint16_t>(b[at] | b[at + 1] << 8U);
}
std::uint32_t read_u32(Bytes b, std::size_t at) noexcept {
  return read_u16(b, at) | static_cast<std::uint32_t>(read_u16(b, at + 2)) << 16U;
}
std::int32_t read_i32(Bytes b, std::size_t at) noexcept {
  return static_cast<std::int32_t>(read_u32(b, at));
}

/// Fletcher's sum, modulo 256, from the class to the payload's end.
std::array<std::uint8_t, 2> checksum(Bytes b) noexcept {
  std::uint8_t first = 0, second = 0;
  for (const std::uint8_t v : b) {
    first = static_cast<std::uint8_t>(first + v);
    second = static_cast<std::uint8_t>(second + first);
  }
  return {first, second};
}

std::int64_t days_since_1970(int year, int month, int day) noexcept {
  // Counts from March, so that a leap day is a year's last.
  const int shifted = (month + 9) % 12;
  if (month <= 2) --year;
  return 365LL * year + year / 4 - year / 100 + year / 400 + (153 * shifted + 2) / 5 + day - 1 -
         719468;
}

std::optional<std::int64_t> utc(Bytes p) noexcept {
  constexpr unsigned kDate = 1, kTime = 2, kResolved = 4;
  if ((p[11] & (kDate | kTime | kResolved)) != (kDate | kTime | kResolved)) return std::nullopt;
  const int year = read_u16(p, 4), month = p[6], day = p[7];
  const std::int32_t nano = read_i32(p, 16);
  if (year < 1980 || year > 2200 || month < 1 || month > 12 || day < 1 || day > 31 || p[8] > 23 ||
      p[9] > 59 || p[10] > 60 || nano < -1'000'000'000 || nano > 1'000'000'000)
    return std::nullopt;
  const std::int64_t hour = p[8], minute = p[9], second = p[10];
  const std::int64_t seconds =
      days_since_1970(year, month, day) * 86400 + hour * 3600 + minute * 60 + second;
  return seconds * 1'000'000'000 + nano;
}

}  // namespace

bool decode_pvt(Bytes p, Pvt* pvt) noexcept {
  if (p.size() < kMinPvt || p.size() > kMaxPayload) return false;
  Pvt v;
  if (p[20] > static_cast<std::uint8_t>(FixType::time_only)) return false;
  v.utc_ns = utc(p);
  v.fix = static_cast<FixType>(p[20]);
  v.fix_ok = (p[21] & 1U) != 0;
  v.satellites = p[23];
  v.longitude_deg = 1e-7 * read_i32(p, 24);
  v.latitude_deg = 1e-7 * read_i32(p, 28);
  if (v.longitude_deg < -180 || v.longitude_deg > 180 || v.latitude_deg < -90 ||
      v.latitude_deg > 90)
    return false;
  v.height_m = 1e-3 * read_i32(p, 32);
  v.horizontal_sigma_m = 1e-3 * read_u32(p, 40);
  v.vertical_sigma_m = 1e-3 * read_u32(p, 44);
  for (std::size_t i = 0; i < 3; ++i) v.velocity_ned[i] = 1e-3 * read_i32(p, 48 + 4 * i);
  v.ground_speed = 1e-3 * read_i32(p, 60);
  v.course_deg = 1e-5 * read_i32(p, 64);
  v.speed_sigma = 1e-3 * read_u32(p, 68);
  v.course_sigma_deg = 1e-5 * read_u32(p, 72);
  v.position_dop = 0.01 * read_u16(p, 76);
  constexpr std::size_t kWithHeading = 92;
  constexpr unsigned kHeadingValid = 1U << 5U;
  if (p.size() >= kWithHeading && (p[21] & kHeadingValid) != 0)
    v.heading_deg = 1e-5 * read_i32(p, 84);
  *pvt = v;
  return true;
}

std::size_t write_frame(std::uint8_t message_class, std::uint8_t id, Bytes payload,
                        std::span<std::uint8_t> out) noexcept {
  const std::size_t size = payload.size() + kOverhead;
  if (payload.size() > kMaxPayload || out.size() < size) return 0;
  const auto n = static_cast<std::uint16_t>(payload.size());
  const std::array<std::uint8_t, 6> head{kSync1,
                                         kSync2,
                                         message_class,
                                         id,
                                         static_cast<std::uint8_t>(n),
                                         static_cast<std::uint8_t>(n >> 8U)};
  std::copy(head.begin(), head.end(), out.begin());
  std::copy(payload.begin(), payload.end(), out.begin() + head.size());
  const auto sum = checksum(out.subspan(2, payload.size() + 4));
  std::copy(sum.begin(), sum.end(), out.begin() + static_cast<std::ptrdiff_t>(size - 2));
  return size;
}

std::size_t FrameStream::accept(Bytes bytes) noexcept {
  if (bytes_.size() - end_ < bytes.size() && begin_ > 0) {
    std::copy(bytes_.begin() + static_cast<std::ptrdiff_t>(begin_),
              bytes_.begin() + static_cast<std::ptrdiff_t>(end_), bytes_.begin());
    end_ -= begin_;
    begin_ = 0;
  }
  const std::size_t n = std::min(bytes.size(), bytes_.size() - end_);
  std::copy_n(bytes.begin(), n, bytes_.begin() + static_cast<std::ptrdiff_t>(end_));
  end_ += n;
  return n;
}

void FrameStream::skip() noexcept {
  ++begin_;
  ++counters_.garbage_bytes;
}

void FrameStream::abandon() noexcept {
  if (begin_ < end_) skip();
}

bool FrameStream::next(Frame* frame) noexcept {
  for (; begin_ < end_; skip()) {
    const Bytes rest(bytes_.data() + begin_, end_ - begin_);
    if (rest[0] != kSync1) continue;
    if (rest.size() < 2) return false;
    if (rest[1] != kSync2) continue;
    if (rest.size() < 6) return false;
    const std::size_t length = read_u16(rest, 4);
    if (length > kMaxPayload) {
      ++counters_.length_refused;
      continue;
    }
    if (rest.size() < length + kOverhead) return false;
    const auto sum = checksum(rest.subspan(2, length + 4));
    if (sum[0] != rest[length + 6] || sum[1] != rest[length + 7]) {
      ++counters_.checksum_wrong;
      continue;
    }
    *frame = {rest[2], rest[3], rest.subspan(6, length)};
    begin_ += length + kOverhead;
    ++counters_.frames;
    counters_.frame_bytes += length + kOverhead;
    return true;
  }
  begin_ = end_ = 0;
  return false;
}

}  // namespace vergence::ubx
