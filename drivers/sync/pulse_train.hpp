#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/sync/clock_mapper.hpp"
#include "drivers/trigger.hpp"

namespace vergence {

/// The pulses of late, as reported: when each went out, and which went out without a report.
///
/// Numbers  Its own, which grow over a reboot of the source; within one they advance as the
///          source's do.
/// Not thread-safe. Memory: fixed, the kHeld newest. Time: constant a call, at most kHeld
///          steps.
/// Errors   None. A report that contradicts those before it (another boot, a number or an edge that
///          runs back, an edge far too late) begins a new train.
class PulseTrain {
 public:
  static constexpr std::size_t kHeld = 64;  // two seconds at 30 Hz: no frame is that late
  static constexpr std::uint64_t kAhead =
      64;  // pulses that may be reckoned beyond the newest report
  static constexpr std::uint64_t kLeap =
      100'000;  // an hour of pulses without a report: nothing can be said across

  struct Entry {
    std::uint64_t number = 0;
    std::uint64_t skipped = 0;  // numbers before it that no pulse may have had, since the train
                                // began: left out by a pause
    DeviceStamp edge{};
    HostStamp host{};
    Duration host_error{};
    bool resumed = false;
    std::array<PulseExposure, kMaxCameras> exposure{};
  };
  /// Where on the train an instant of the source's clock is.
  struct Place {
    std::uint64_t number = 0;
    std::uint64_t skipped = 0;  // of the numbers before it, as Entry::skipped
    std::uint64_t skipped_with =
        0;  // the same as entries after it have it, which count its own where a pause was
    const Entry* entry = nullptr;  // null: no report of it is here
    bool paused = false;  // and the numbers there were left out by a pause, or some of them
  };
  enum class Step : std::uint8_t {
    taken,
    known,  // reported before
    began,  // taken, as the first of a new train
  };

  explicit PulseTrain(Duration interval) noexcept : nominal_(interval) {}

  /// `first_free`: no number of a new train is below it. Precondition: pulse.mapped.
  Step add(const Pulse& pulse, std::uint64_t first_free) noexcept;

  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  /// 0 is the oldest. Precondition: i < size().
  [[nodiscard]] const Entry& operator[](std::size_t i) const noexcept {
    return entries_[(first_ + i) % kHeld];
  }
  [[nodiscard]] const Entry& newest() const noexcept { return (*this)[count_ - 1]; }
  [[nodiscard]] const Entry* find(std::uint64_t number) const noexcept;
  /// The pulse that went out `pulses` before that of this number, where every report between is
  /// here; else null.
  [[nodiscard]] const Entry* before(std::uint64_t number, std::uint64_t pulses) const noexcept;
  /// The pulse whose edge is within `gate`, or one whose report is missing or still to come; none:
  /// no pulse went out then.
  [[nodiscard]] std::optional<Place> place(DeviceStamp edge, Duration gate) const noexcept;
  /// The host's time of an edge near or after those held. Precondition: size() > 0.
  [[nodiscard]] MappedStamp to_host(DeviceStamp edge) const noexcept;
  /// Pulses held with a number above `after` and below `before`.
  [[nodiscard]] std::uint64_t between(std::uint64_t after, std::uint64_t before) const noexcept;
  /// The pulses that went out after one and up to another, at least; at most the difference of the
  /// numbers.
  [[nodiscard]] static std::uint64_t least(std::uint64_t from, std::uint64_t from_skipped,
                                           std::uint64_t to, std::uint64_t to_skipped) noexcept {
    const std::uint64_t most = to - from,
                        left_out =
                            to_skipped - (from_skipped < to_skipped ? from_skipped : to_skipped);
    return left_out < most ? most - left_out : 1;  // the last went out
  }
  /// Mean time between two numbers.
  [[nodiscard]] Duration interval() const noexcept;

 private:
  [[nodiscard]] std::optional<Place> unreported(const Entry& before, const Entry* after,
                                                DeviceStamp edge) const noexcept;

  Duration nominal_;
  std::array<Entry, kHeld> entries_{};
  std::size_t first_ = 0, count_ = 0;
  std::uint64_t base_ = 0;  // own number less the source's, modulo 2^64
  std::uint32_t boot_ = 0;
};

}  // namespace vergence
