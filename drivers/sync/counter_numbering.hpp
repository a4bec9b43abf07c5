#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/types/calibration.hpp"
#include "core/types/time.hpp"

namespace vergence {

/// The numbers of sets from the cameras' counters: each camera's counter and a constant of its own,
/// for the mode counter.
///
/// Constant  0 until it is told to be found by time: then the camera's next frame gets the number
///           whose time is nearest, reckoned from the newest number that a time is known of, and
///           the others follow. So after a restart, after a counter that leaps over an hour of
///           pulses, and, with `align_start`, at the start and after kAmbiguous sets in a row whose
///           stamps did not agree.
/// Threads   One caller. Memory: in place. Time: constant a call.
/// Errors    None.
class CounterNumbering {
 public:
  static constexpr int kAmbiguous = 10;  // in a row: the pulses were not found rightly

  /// `interval`: between two pulses, > 0.
  CounterNumbering(Duration interval, bool align_start) noexcept;

  /// The number of this frame's set. `middle`: of its exposure.
  [[nodiscard]] std::uint64_t number_of(std::size_t camera, std::uint64_t counter,
                                        HostStamp middle) noexcept;
  /// The number of an exposure that gave no frame; none where it is not known.
  [[nodiscard]] std::optional<std::uint64_t> number_of_lost(std::size_t camera,
                                                            std::uint64_t counter) const noexcept;
  /// This camera's next frame gets its number by time.
  void align(std::size_t camera) noexcept { cameras_[camera].align = true; }
  [[nodiscard]] bool aligning(std::size_t camera) const noexcept { return cameras_[camera].align; }

  /// This number was exposed then. `leads`: by the camera that times are reckoned from; another's
  /// is used while there is none of it.
  void record(std::uint64_t number, HostStamp middle, bool leads) noexcept;
  /// A set of several images has gone out, and their stamps agree, or not. True: for the last time
  /// that was borne, all but camera 0 get their numbers by time again.
  [[nodiscard]] bool count_agreement(bool agree) noexcept;

 private:
  struct Camera {
    bool align = false;     // the next frame's number is found by time
    std::int64_t base = 0;  // number − counter
  };

  Duration interval_;
  bool align_start_;
  std::array<Camera, kMaxCameras> cameras_{};
  bool timed_ = false;  // a number and its time
  std::uint64_t timed_number_ = 0;
  HostStamp timed_middle_{};
  int unproven_run_ = 0;
};

}  // namespace vergence
