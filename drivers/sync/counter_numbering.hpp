#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/types/calibration.hpp"
#include "core/types/time.hpp"

namespace vergence {

/// Numbers sets by the cameras' counters (SyncMode::frame_counter): each camera's counter plus a
/// constant of that camera.
///
/// The constant is 0 until the camera is aligned by time: its next frame then gets the number
/// nearest in time, computed from the newest number of known time, and the others follow. This
/// happens after a restart, after a counter leap beyond an hour of pulses and, with `align_start`,
/// at the start and after kAmbiguous sets in a row whose stamps disagree. Not thread-safe. Does not
/// allocate. Constant time per call.
class CounterNumbering {
 public:
  /// Disagreeing sets in a row that mean a wrong alignment.
  static constexpr int kAmbiguous = 10;

  /// `interval` is that of the pulses, > 0.
  CounterNumbering(Duration interval, bool align_start) noexcept;

  /// Number of this frame's set. `middle` is that of its exposure.
  [[nodiscard]] std::uint64_t number_of(std::size_t camera, std::uint64_t counter,
                                        HostStamp middle) noexcept;
  /// Number of an exposure without a frame; none if it is unknown.
  [[nodiscard]] std::optional<std::uint64_t> number_of_lost(std::size_t camera,
                                                            std::uint64_t counter) const noexcept;
  /// Aligns this camera by time at its next frame.
  void align(std::size_t camera) noexcept { cameras_[camera].align = true; }
  [[nodiscard]] bool aligning(std::size_t camera) const noexcept { return cameras_[camera].align; }

  /// Records when this number was exposed. `leads` marks the camera whose times are the reference;
  /// another's are used while it has none.
  void record(std::uint64_t number, HostStamp middle, bool leads) noexcept;
  /// Counts a complete set whose stamps agree or not. Returns true if the limit is reached, so that
  /// all cameras but 0 are aligned by time again.
  [[nodiscard]] bool count_agreement(bool agree) noexcept;

 private:
  struct Camera {
    // True if the next frame's number is found by time.
    bool align = false;
    // Number minus counter.
    std::int64_t base = 0;
  };

  Duration interval_;
  bool align_start_;
  std::array<Camera, kMaxCameras> cameras_{};
  // True if a number and its time are known.
  bool timed_ = false;
  std::uint64_t timed_number_ = 0;
  HostStamp timed_middle_{};
  int unproven_run_ = 0;
};

}  // namespace vergence
