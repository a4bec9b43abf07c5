#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

/// NMEA 0183 sentences of a satellite receiver or compass: framing, checksum, and the fields of
/// GGA, RMC, VTG, GST and HDT, from any talker (GP, GN, GL, GA, HE, …). Pure functions over bytes
/// the caller owns.
namespace vergence::nmea {

/// Characters between `$` and the line's end. The standard has 79; receivers with more decimals
/// send more.
inline constexpr std::size_t kMaxCharacters = 120;
inline constexpr std::size_t kMaxFields = 24;

enum class Type : std::uint8_t { other, gga, rmc, vtg, gst, hdt };

/// Content of a sentence; absent: the field is empty or makes no sense. Degrees, m, m/s.
struct Sentence {
  Type type = Type::other;
  std::optional<std::int64_t> time_of_day_ns;  // UTC
  std::optional<std::int32_t> days;            // since 1970-01-01, of RMC
  std::optional<double> latitude_deg, longitude_deg;
  std::optional<double> altitude_m;   // above the geoid (GGA)
  std::optional<double> geoid_m;      // geoid above the ellipsoid (GGA)
  std::optional<double> speed;        // m/s over ground
  std::optional<double> course_deg;   // clockwise from true north, of the motion
  std::optional<double> heading_deg;  // the same, of the body (HDT)
  std::optional<double> hdop;
  std::optional<double> latitude_sigma_m, longitude_sigma_m, altitude_sigma_m;  // GST
  std::uint8_t quality = 0;  // GGA: 0 none, 1 to 5 a fix, 6 dead reckoning, …
  std::uint8_t satellites = 0;
  bool valid = false;  // RMC: status A
};

enum class Status : std::uint8_t { ok, no_checksum, checksum_wrong, malformed };

/// A line without `$` and line end: `GPGGA,…*47`. Another type than those above is ok and `other`.
[[nodiscard]] Status parse(std::string_view line, Sentence* sentence) noexcept;

/// XOR of the characters between `$` and `*`.
[[nodiscard]] std::uint8_t checksum(std::string_view body) noexcept;

struct StreamCounters {
  std::uint64_t sentences = 0;       // with the right checksum
  std::uint64_t checksum_wrong = 0;  // also those without one
  std::uint64_t malformed = 0;       // too long, or cut off by the next one
  std::uint64_t garbage_bytes = 0;   // outside sentences
};

/// Bytes into sentences, byte by byte, in place.
///
/// Threads  One caller. Memory: fixed. Errors: counted.
class SentenceStream {
 public:
  /// True: this byte completed a sentence; `bytes` of it are counted from `$`.
  [[nodiscard]] bool accept(std::uint8_t byte, Sentence* sentence) noexcept;
  /// The apparent start of a sentence was none.
  void abandon() noexcept { inside_ = false; }
  [[nodiscard]] const StreamCounters& counters() const noexcept { return counters_; }
  /// Bytes of the newest sentence, from `$` to its CR LF.
  [[nodiscard]] std::size_t size() const noexcept { return last_size_; }

 private:
  std::array<char, kMaxCharacters> line_{};
  std::size_t count_ = 0, last_size_ = 0;
  bool inside_ = false;
  StreamCounters counters_{};
};

}  // namespace vergence::nmea
