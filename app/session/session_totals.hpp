#pragma once
#include <cmath>

#include "app/session/records.hpp"

namespace vergence::app {

/// Distribution of times in fixed memory: exact mean and maximum, percentiles to 0.25 %. Bins grow
/// by the factor 1 + 1/200 from 1 µs on; 4000 of them reach 460 s. Not thread-safe.
class TimeHistogram {
 public:
  void add(double ms) noexcept {
    // Rejects negative values and NaN.
    if (!(ms >= 0)) return;
    ++count_;
    sum_ += ms;
    max_ = std::max(max_, ms);
    const double place = std::log(std::max(ms, kMin) / kMin) / kLogStep;
    ++bins_[std::min(static_cast<std::size_t>(place), kBins - 1)];
  }
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  /// Mean in ms; 0 if empty.
  [[nodiscard]] double mean() const noexcept {
    return count_ == 0 ? 0 : sum_ / static_cast<double>(count_);
  }
  [[nodiscard]] double max() const noexcept { return max_; }
  /// Smallest time that at least the share q of all does not exceed: the middle of its bin, at most
  /// max(). 0 if empty.
  [[nodiscard]] double percentile(double q) const noexcept {
    if (count_ == 0) return 0;
    const auto requested = std::max<std::uint64_t>(
        1, static_cast<std::uint64_t>(std::ceil(q * static_cast<double>(count_))));
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i < kBins; ++i) {
      seen += bins_[i];
      if (seen >= requested)
        return std::min(max_, kMin * std::exp((static_cast<double>(i) + 0.5) * kLogStep));
    }
    return max_;
  }

 private:
  static constexpr std::size_t kBins = 4000;
  // In ms.
  static constexpr double kMin = 1e-3;
  // ln(1.005).
  static constexpr double kLogStep = 0.004987541511038968;
  std::array<std::uint32_t, kBins> bins_{};
  std::uint64_t count_ = 0;
  double sum_ = 0, max_ = 0;
};

/// Attempt to calibrate during the run.
struct CalibrationAttempt {
  Stamp stamp{};
  /// Name of the CalibrationCause, and the reason of a rejection; constants.
  std::string_view cause{}, reason{};
  bool accepted = false;
  int latency_frames = 0, frames = 0;
  double solve_ms = 0;
};

/// Search of a run that began without a calibration.
struct FromScratch {
  /// First accepted attempt.
  std::optional<CalibrationAttempt> found{};
  /// Number of rejected attempts before it.
  std::uint64_t rejected = 0;
};

/// Proof that the calibration in use did not match the rig.
struct Contradiction {
  Stamp stamp{};
  /// Depth error of the contradicted calibration.
  double depth_percent = 0;
};

/// Frames that exceeded their time budget (docs/deployment.md), and the omitted work.
struct BudgetStatistics {
  std::uint64_t frames = 0, points = 0, keyframes = 0, steps = 0, windows = 0;

  void add(const FrameWorkload& effort) noexcept;
};

/// Limit in summary.json; calibrations.csv has all attempts.
inline constexpr std::size_t kMaxAttempts = 1000;

/// Totals of the attempts to calibrate.
struct CalibrationTotals {
  /// The newest kMaxAttempts attempts.
  std::vector<CalibrationAttempt> attempts{};
  /// Numbers of all attempts.
  std::uint64_t accepted = 0, rejected = 0;
  FromScratch from_scratch{};
  /// Newest measurement of the focal length.
  FocalMeasurement focal{};

  /// Adds a decided attempt. Returns true if it was accepted.
  bool add(const CalibrationRecord& calibration);
};

/// Totals of a session, for summary.json.
struct SessionTotals : FrameCounts, CalibrationTotals {
  /// In ms.
  TimeHistogram estimate, decode;
  /// Frames in states other than stereo_odometry and lost, in ms.
  TimeHistogram calibrating;
  std::array<TimeHistogram, kStages> stages;
  /// Stamp at which the calibration in use was first verified.
  std::optional<Stamp> verified{};
  /// Frame of that stamp.
  std::optional<std::uint64_t> verified_frame{};
  /// First contradiction of the calibration in use.
  std::optional<Contradiction> contradicted{};
  /// Poses read back from trajectory.tum, if requested.
  std::vector<StampedPose> trajectory;
  /// Poses read back from reference.tum in its own frame, if requested.
  std::vector<StampedPose> reference;
  /// Records dropped because their ring was full (live only).
  std::uint64_t dropped_records = 0;
  /// INS samples dropped because their ring was full (live only).
  std::uint64_t dropped_readings = 0;
  /// Lines that the disk did not accept.
  std::uint64_t lost_lines = 0;
  BudgetStatistics work_dropped{};
  std::size_t ring_high_water = 0;
  /// A message for each incomplete file.
  std::vector<std::string> faults;

  using CalibrationTotals::add;
  void add(const FrameReport& report);
  void add(const EventRecord& event);

 private:
  /// An event comes before the pose of its frame, or after the last one.
  void match_verified() {
    if (verified == newest_ && !verified_frame && read > 0) verified_frame = newest_frame_;
  }

  Stamp newest_{};
  std::uint64_t newest_frame_ = 0;
};

}  // namespace vergence::app
