#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

/// u-blox UBX: frames and the navigation solution NAV-PVT (u-blox 7 on; protocol version 14 and
/// later). Layout as in the interface descriptions of u-blox M8 and F9. Pure functions over bytes
/// the caller owns.
namespace vergence::ubx {

inline constexpr std::uint8_t kSync1 = 0xB5, kSync2 = 0x62;
inline constexpr std::size_t kOverhead = 8;       // sync, class, id, length, two of checksum
inline constexpr std::size_t kMaxPayload = 2048;  // longer ones are refused: no length to wait for
inline constexpr std::size_t kMinPvt = 84;        // u-blox 7; 92 from u-blox 8 on

struct Frame {
  std::uint8_t message_class = 0, id = 0;
  std::span<const std::uint8_t> payload{};
  [[nodiscard]] bool is_pvt() const noexcept { return message_class == 0x01 && id == 0x07; }
};

enum class FixType : std::uint8_t { none, dead_reckoning, fix_2d, fix_3d, combined, time_only };

/// NAV-PVT. Absent: the receiver says that it is not valid.
struct Pvt {
  std::optional<std::int64_t> utc_ns;  // since 1970, date and time fully resolved
  FixType fix = FixType::none;
  bool fix_ok = false;  // within the receiver's limits
  std::uint8_t satellites = 0;
  double latitude_deg = 0, longitude_deg = 0;
  double height_m = 0;                                  // above the ellipsoid
  double horizontal_sigma_m = 0, vertical_sigma_m = 0;  // the receiver's accuracy estimates
  std::array<double, 3> velocity_ned{};                 // m/s
  double ground_speed = 0, speed_sigma = 0;             // m/s
  double course_deg = 0, course_sigma_deg = 0;          // of the motion, clockwise from true north
  std::optional<double> heading_deg;                    // of the vehicle (sensor fusion)
  double position_dop = 0;
};

/// False: too short, or a field that cannot be; *pvt untouched.
[[nodiscard]] bool decode_pvt(std::span<const std::uint8_t> payload, Pvt* pvt) noexcept;

/// Writes a frame. → its size; 0: it does not fit
[[nodiscard]] std::size_t write_frame(std::uint8_t message_class, std::uint8_t id,
                                      std::span<const std::uint8_t> payload,
                                      std::span<std::uint8_t> out) noexcept;

struct StreamCounters {
  std::uint64_t frames = 0;
  std::uint64_t checksum_wrong = 0;
  std::uint64_t length_refused = 0;
  std::uint64_t frame_bytes = 0, garbage_bytes = 0;
};

/// Bytes into frames, however they are cut. After a refused frame the search goes on at its second
/// byte.
///
/// Threads  One caller. Memory: in place. Errors: counted.
class FrameStream {
 public:
  /// Takes as many bytes as there is room for. → how many; all, once next() has said false
  [[nodiscard]] std::size_t accept(std::span<const std::uint8_t> bytes) noexcept;
  /// The payload lives until the next call of accept(). False: no whole frame.
  [[nodiscard]] bool next(Frame* frame) noexcept;
  /// The apparent start of a frame was none: the search goes on behind it.
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
