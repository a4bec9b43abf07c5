#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

/// NMEA 0183 sentences of a satellite receiver or compass: framing, checksum, and the fields of
/// GGA, RMC, VTG, GST and HDT from any talker (GP, GN, GL, GA, HE, …). Pure functions over the
/// caller's bytes.
namespace vergence::nmea {

/// Maximum number of characters between `$` and the line's end. The standard has 79; receivers with
/// more decimals send more.
inline constexpr std::size_t kMaxCharacters = 120;
inline constexpr std::size_t kMaxFields = 24;

enum class Type : std::uint8_t { other, gga, rmc, vtg, gst, hdt };

/// Content of a sentence. A field is absent if it is empty or invalid.
struct Sentence {
  Type type = Type::other;
  /// UTC.
  std::optional<std::int64_t> time_of_day_ns;
  /// Days since 1970-01-01, of RMC.
  std::optional<std::int32_t> days;
  std::optional<double> latitude_deg, longitude_deg;
  /// Altitude above the geoid (GGA).
  std::optional<double> altitude_m;
  /// Height of the geoid above the ellipsoid (GGA).
  std::optional<double> geoid_m;
  /// Speed over ground in m/s.
  std::optional<double> speed;
  /// Direction of motion, clockwise from true north.
  std::optional<double> course_deg;
  /// Heading of the body, clockwise from true north (HDT).
  std::optional<double> heading_deg;
  std::optional<double> hdop;
  /// Standard deviations (GST).
  std::optional<double> latitude_sigma_m, longitude_sigma_m, altitude_sigma_m;
  /// Fix quality (GGA): 0 none, 1 to 5 a fix, 6 dead reckoning, …
  std::uint8_t quality = 0;
  std::uint8_t satellites = 0;
  /// True for status A of RMC.
  bool valid = false;
};

enum class Status : std::uint8_t { ok, no_checksum, checksum_wrong, malformed };

/// Parses a line without `$` and line end: `GPGGA,…*47`. Other types are ok and `other`.
[[nodiscard]] Status parse(std::string_view line, Sentence* sentence) noexcept;

/// XOR of the characters between `$` and `*`.
[[nodiscard]] std::uint8_t checksum(std::string_view body) noexcept;

struct StreamCounters {
  /// Sentences with a correct checksum.
  std::uint64_t sentences = 0;
  /// Includes sentences without a checksum.
  std::uint64_t checksum_wrong = 0;
  /// Sentences that are too long or cut off by the next one.
  std::uint64_t malformed = 0;
  /// Bytes outside sentences.
  std::uint64_t garbage_bytes = 0;
};

/// Splits bytes into sentences, in place. One caller. Fixed memory. Errors are counted.
class SentenceStream {
 public:
  /// Returns true if this byte completes a sentence.
  [[nodiscard]] bool accept(std::uint8_t byte, Sentence* sentence) noexcept;
  /// Discards an incomplete sentence.
  void abandon() noexcept { inside_ = false; }
  [[nodiscard]] const StreamCounters& counters() const noexcept { return counters_; }
  /// Size of the newest sentence in bytes, from `$` to CR LF.
  [[nodiscard]] std::size_t size() const noexcept { return last_size_; }

 private:
  std::array<char, kMaxCharacters> line_{};
  std::size_t count_ = 0, last_size_ = 0;
  bool inside_ = false;
  StreamCounters counters_{};
};

}  // namespace vergence::nmea
