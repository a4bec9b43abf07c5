#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "core/types/pose_sample.hpp"

namespace vergence {

/// Reasons for which poses are `degraded`, strongest first: where several stand, the first of them
/// names the reason.
enum class Degradation : std::uint8_t {
  pairing,        // this frame's images are contradicted to have been exposed together
  scene,          // the map was rebuilt
  frame,          // this frame's images, matches or geometry: FrameOutcome::reason
  out_of_sync,    // a camera's images are of another instant
  late_image,     // a camera may be an exposure behind
  rig,            // something is wrong with the rig, or it is being recalibrated
  calibration,    // the calibration that poses depend on is not verified
  dynamic_scene,  // points of this frame or the last ones do not move as one rigid scene
  window,         // the window still holds degraded frames
  motion,         // this motion is less certain than the drive's others
};
inline constexpr std::size_t kDegradations = static_cast<std::size_t>(Degradation::motion) + 1;

/// The degradations that apply, each with its reason, its first frame, and the number of frames of
/// evidence that ends it. A pose is `ok` while the ledger is empty; else it is
/// `degraded` for the strongest reason.
///
///     ledger.enter(Degradation::scene, Reason::map_reset, frame.number, 10);
///     if (const DegradationLedger::Entry* why = ledger.strongest(true)) use(why->reason);
///     ledger.weaken(Degradation::scene);  // a frame that speaks against it
///
/// Threads  One. Memory: none of the heap.
class DegradationLedger {
 public:
  /// Value of `left` for a degradation that only strike() ends.
  static constexpr int kUntilStruck = std::numeric_limits<int>::max();

  struct Entry {
    Reason reason = Reason::none;  // none: it does not stand
    std::uint64_t since = 0;       // frame number
    int left = 0;                  // frames of evidence that end it
  };

  /// Enters a degradation, or renews it and keeps its first frame.
  void enter(Degradation degradation, Reason reason, std::uint64_t frame,
             int left = kUntilStruck) noexcept {
    Entry& e = at(degradation);
    e = {reason, e.reason == Reason::none ? frame : e.since, left};
  }
  void strike(Degradation degradation) noexcept { at(degradation) = {}; }
  /// Enters the degradation if `so`, else ends it.
  void hold(Degradation degradation, bool so, Reason reason, std::uint64_t frame) noexcept {
    if (so)
      enter(degradation, reason, frame);
    else
      strike(degradation);
  }
  /// Counts one frame of evidence against a degradation. Returns true if that ended it.
  bool weaken(Degradation degradation) noexcept {
    Entry& e = at(degradation);
    if (e.reason == Reason::none || e.left == kUntilStruck || --e.left > 0) return false;
    e = {};
    return true;
  }

  [[nodiscard]] const Entry& operator[](Degradation degradation) const noexcept {
    return entries_[static_cast<std::size_t>(degradation)];
  }
  [[nodiscard]] bool stands(Degradation degradation) const noexcept {
    return (*this)[degradation].reason != Reason::none;
  }
  /// The strongest degradation that applies; nullptr if none does. `late_image` does not count
  /// while the rig stands (`moves` false): an image that is an exposure late shows the same then.
  [[nodiscard]] const Entry* strongest(bool moves) const noexcept {
    for (std::size_t i = 0; i < kDegradations; ++i)
      if (entries_[i].reason != Reason::none &&
          (moves || static_cast<Degradation>(i) != Degradation::late_image))
        return &entries_[i];
    return nullptr;
  }
  /// Returns true if `last` or a stronger degradation applies.
  [[nodiscard]] bool any_up_to(Degradation last) const noexcept {
    for (std::size_t i = 0; i <= static_cast<std::size_t>(last); ++i)
      if (entries_[i].reason != Reason::none) return true;
    return false;
  }

 private:
  [[nodiscard]] Entry& at(Degradation degradation) noexcept {
    return entries_[static_cast<std::size_t>(degradation)];
  }

  std::array<Entry, kDegradations> entries_{};
};

}  // namespace vergence
