#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

/// u-blox UBX: frames and the navigation solution NAV-PVT (u-blox 7 on; protocol version 14 and
/// later). Layout as in the interface descriptions of u-blox M8 and F9. Pure functions over the
/// caller's bytes.
namespace vergence::ubx {

inline constexpr std::uint8_t kSync1 = 0xB5, kSync2 = 0x62;
/// Sync, class, id, length and two bytes of checksum.
inline constexpr std::size_t kOverhead = 8;
/// Longer frames are refused, so that a false length causes no long wait.
inline constexpr std::size_t kMaxPayload = 2048;
/// Size for u-blox 7; 92 from u-blox 8 on.
inline constexpr std::size_t kMinPvt = 84;

struct Frame {
  std::uint8_t message_class = 0, id = 0;
  std::span<const std::uint8_t> payload{};
  [[nodiscard]] bool is_pvt() const noexcept { return message_class == 0x01 && id == 0x07; }
};

enum class FixType : std::uint8_t { none, dead_reckoning, fix_2d, fix_3d, combined, time_only };

/// NAV-PVT. A value is absent if the receiver marks it as invalid.
struct Pvt {
  /// UTC since 1970, with date and time fully resolved.
  std::optional<std::int64_t> utc_ns;
  FixType fix = FixType::none;
  /// True if within the receiver's limits.
  bool fix_ok = false;
  std::uint8_t satellites = 0;
  double latitude_deg = 0, longitude_deg = 0;
  /// Height above the ellipsoid.
  double height_m = 0;
  /// Accuracy estimates of the receiver.
  double horizontal_sigma_m = 0, vertical_sigma_m = 0;
  /// In m/s.
  std::array<double, 3> velocity_ned{};
  /// In m/s.
  double ground_speed = 0, speed_sigma = 0;
  /// Direction of motion, clockwise from true north.
  double course_deg = 0, course_sigma_deg = 0;
  /// Heading of the vehicle (sensor fusion).
  std::optional<double> heading_deg;
  double position_dop = 0;
};

/// Returns false, with *pvt unchanged, if it is too short or a field is invalid.
[[nodiscard]] bool decode_pvt(std::span<const std::uint8_t> payload, Pvt* pvt) noexcept;

/// Writes a frame. Returns its size; 0 if it does not fit.
[[nodiscard]] std::size_t write_frame(std::uint8_t message_class, std::uint8_t id,
                                      std::span<const std::uint8_t> payload,
                                      std::span<std::uint8_t> out) noexcept;

struct StreamCounters {
  std::uint64_t frames = 0;
  std::uint64_t checksum_wrong = 0;
  std::uint64_t length_refused = 0;
  std::uint64_t frame_bytes = 0, garbage_bytes = 0;
};

/// Splits bytes into frames, whatever the sizes of the reads. After a refused frame the search
/// continues at its second byte. One caller. Fixed memory. Errors are counted.
class FrameStream {
 public:
  /// Takes as many bytes as fit and returns their number; all, once next() has returned false.
  [[nodiscard]] std::size_t accept(std::span<const std::uint8_t> bytes) noexcept;
  /// Returns false without a complete frame. The payload is valid until the next accept().
  [[nodiscard]] bool next(Frame* frame) noexcept;
  /// Discards an incomplete frame and continues the search behind its start.
  void abandon() noexcept;
  [[nodiscard]] std::size_t waiting() const noexcept { return end_ - begin_; }
  [[nodiscard]] const StreamCounters& counters() const noexcept { return counters_; }

 private:
  void skip() noexcept;
  std::array<std::uint8_t, 2 * (kMaxPayload + kOverhead)> bytes_{};
  std::size_t begin_ = 0, end_ = 0;
  StreamCounters counters_{};
};

}  // namespace vergence::ubx
