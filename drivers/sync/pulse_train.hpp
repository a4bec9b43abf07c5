#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/sync/clock_mapper.hpp"
#include "drivers/trigger.hpp"

namespace vergence {

/// Recent pulses as reported: the time of each, and gaps without a report.
///
/// Numbers are own ones that grow across a reboot of the source; within a boot they advance as the
/// source's do. A report that contradicts earlier ones (another boot, a number or edge that runs
/// back, an edge far too late) begins a new train. Not thread-safe. Holds the kHeld newest pulses.
/// Constant time per call, at most kHeld steps.
class PulseTrain {
 public:
  /// Two seconds at 30 Hz; no frame is that late.
  static constexpr std::size_t kHeld = 64;
  /// Maximum number of pulses extrapolated beyond the newest report.
  static constexpr std::uint64_t kAhead = 64;
  /// Pulses without a report after which a new train begins: about an hour.
  static constexpr std::uint64_t kLeap = 100'000;

  struct Entry {
    std::uint64_t number = 0;
    /// Cumulative count of earlier numbers that a pause may have omitted, since the train began.
    std::uint64_t skipped = 0;
    DeviceStamp edge{};
    HostStamp host{};
    Duration host_error{};
    bool resumed = false;
    std::array<PulseExposure, kMaxCameras> exposure{};
  };
  /// Position of an instant of the source's clock on the train.
  struct Place {
    std::uint64_t number = 0;
    /// Omitted numbers before it, as in Entry::skipped.
    std::uint64_t skipped = 0;
    /// Omitted numbers as counted by later entries, which include those of a pause at this place.
    std::uint64_t skipped_with = 0;
    /// Null if there is no report of the pulse.
    const Entry* entry = nullptr;
    /// True if some or all of the numbers here were omitted by a pause.
    bool paused = false;
  };
  enum class Step : std::uint8_t {
    accepted,
    /// Reported before.
    known,
    /// Accepted as the first pulse of a new train.
    began,
  };

  explicit PulseTrain(Duration interval) noexcept : nominal_(interval) {}

  /// Adds a pulse. A new train begins at `first_free` or above. Precondition: pulse.mapped.
  Step add(const Pulse& pulse, std::uint64_t first_free) noexcept;

  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  /// Entry i, where 0 is the oldest. Precondition: i < size().
  [[nodiscard]] const Entry& operator[](std::size_t i) const noexcept {
    return entries_[(first_ + i) % kHeld];
  }
  [[nodiscard]] const Entry& newest() const noexcept { return (*this)[count_ - 1]; }
  [[nodiscard]] const Entry* find(std::uint64_t number) const noexcept;
  /// The pulse that was sent `pulses` before that of this number; null if a report between them is
  /// missing.
  [[nodiscard]] const Entry* before(std::uint64_t number, std::uint64_t pulses) const noexcept;
  /// The pulse whose edge is within `gate`, or one that is not reported (yet); none if no pulse was
  /// sent then.
  [[nodiscard]] std::optional<Place> place(DeviceStamp edge, Duration gate) const noexcept;
  /// Maps an edge near or after the held ones to the host's clock. Precondition: size() > 0.
  [[nodiscard]] MappedStamp to_host(DeviceStamp edge) const noexcept;
  /// Number of held pulses above `after` and below `before`.
  [[nodiscard]] std::uint64_t between(std::uint64_t after, std::uint64_t before) const noexcept;
  /// Minimum number of pulses sent after one and up to another; the maximum is the difference of
  /// their numbers.
  [[nodiscard]] static std::uint64_t least(std::uint64_t from, std::uint64_t from_skipped,
                                           std::uint64_t to, std::uint64_t to_skipped) noexcept {
    const std::uint64_t most = to - from,
                        left_out =
                            to_skipped - (from_skipped < to_skipped ? from_skipped : to_skipped);
    // The last pulse was certainly sent.
    return left_out < most ? most - left_out : 1;
  }
  /// Mean interval of the pulses.
  [[nodiscard]] Duration interval() const noexcept;

 private:
  [[nodiscard]] std::optional<Place> unreported(const Entry& before, const Entry* after,
                                                DeviceStamp edge) const noexcept;

  Duration nominal_;
  std::array<Entry, kHeld> entries_{};
  std::size_t first_ = 0, count_ = 0;
  // Own number minus the source's, modulo 2^64.
  std::uint64_t base_ = 0;
  std::uint32_t boot_ = 0;
};

}  // namespace vergence
