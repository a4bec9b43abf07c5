#pragma once
#include <compare>
#include <cstdint>

namespace vergence {

/// Signed duration in nanoseconds. An integer stays exact over ten years.
class Duration {
 public:
  constexpr Duration() noexcept = default;
  [[nodiscard]] static constexpr Duration nanoseconds(std::int64_t ns) noexcept {
    return Duration(ns);
  }
  [[nodiscard]] static constexpr Duration microseconds(std::int64_t us) noexcept {
    return Duration(us * 1'000);
  }
  [[nodiscard]] static constexpr Duration milliseconds(std::int64_t ms) noexcept {
    return Duration(ms * 1'000'000);
  }
  /// Rounds to the nearest nanosecond; precondition |s| < 9.2e9.
  [[nodiscard]] static constexpr Duration seconds(double s) noexcept {
    return Duration(static_cast<std::int64_t>(s * 1e9 + (s < 0 ? -0.5 : 0.5)));
  }

  [[nodiscard]] constexpr std::int64_t ns() const noexcept { return ns_; }
  /// For arithmetic with short durations and for printing; never convert the result back to a
  /// stamp.
  [[nodiscard]] constexpr double to_seconds() const noexcept {
    return static_cast<double>(ns_) * 1e-9;
  }

  constexpr auto operator<=>(const Duration&) const noexcept = default;
  constexpr Duration operator-() const noexcept { return Duration(-ns_); }
  constexpr Duration operator+(Duration o) const noexcept { return Duration(ns_ + o.ns_); }
  constexpr Duration operator-(Duration o) const noexcept { return Duration(ns_ - o.ns_); }
  constexpr Duration operator*(std::int64_t k) const noexcept { return Duration(ns_ * k); }
  constexpr Duration operator/(std::int64_t k) const noexcept { return Duration(ns_ / k); }

 private:
  explicit constexpr Duration(std::int64_t ns) noexcept : ns_(ns) {}
  std::int64_t ns_ = 0;
};

/// A point in time on one clock; the tag keeps clocks apart. Nanoseconds since that clock's origin.
template <class Clock>
class Instant {
 public:
  constexpr Instant() noexcept = default;
  explicit constexpr Instant(std::int64_t ns) noexcept : ns_(ns) {}
  [[nodiscard]] constexpr std::int64_t ns() const noexcept { return ns_; }
  constexpr auto operator<=>(const Instant&) const noexcept = default;
  constexpr Duration operator-(Instant o) const noexcept {
    return Duration::nanoseconds(ns_ - o.ns_);
  }
  constexpr Instant operator+(Duration d) const noexcept { return Instant(ns_ + d.ns()); }
  constexpr Instant operator-(Duration d) const noexcept { return Instant(ns_ - d.ns()); }

 private:
  std::int64_t ns_ = 0;
};

/// Nanoseconds since the Unix epoch, as used in files and poses.
using Stamp = Instant<struct UnixEpoch>;
/// Nanoseconds of CLOCK_MONOTONIC, as used by drivers and the synchroniser.
using HostStamp = Instant<struct Monotonic>;

}  // namespace vergence
