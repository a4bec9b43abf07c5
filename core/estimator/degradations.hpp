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
  window,         // the window still holds frames that were doubted
  motion,         // this motion is less certain than the drive's others
};
inline constexpr std::size_t kDegradations = static_cast<std::size_t>(Degradation::motion) + 1;

/// The doubts that stand, each with its reason, the frame since when, and how many frames of
/// evidence against it end it. A pose is `ok` while the ledger is empty; else it is
/// `degraded` for the strongest reason.
///
///     ledger.enter(Doubt::scene, Reason::map_reset, frame.number, 10);
///     if (const DegradationLedger::Entry* why = ledger.strongest(true)) use(why->reason);
///     ledger.weaken(Doubt::scene);  // a frame that speaks against it
///
/// Threads  One. Memory: none of the heap.
class DegradationLedger {
 public:
  /// Value of `left` for a doubt that only strike() ends.
  static constexpr int kUntilStruck = std::numeric_limits<int>::max();

  struct Entry {
    Reason reason = Reason::none;  // none: it does not stand
    std::uint64_t since = 0;       // frame number
    int left = 0;                  // frames of evidence that end it
  };

  /// Enters a doubt, or renews it: one that stands already keeps the frame that it began in.
  void enter(Degradation degradation, Reason reason, std::uint64_t frame,
             int left = kUntilStruck) noexcept {
    Entry& e = at(degradation);
    e = {reason, e.reason == Reason::none ? frame : e.since, left};
  }
  void strike(Degradation degradation) noexcept { at(degradation) = {}; }
  /// Enters the doubt if `so`, else ends it: for doubts that stand exactly while a condition holds.
  void hold(Degradation degradation, bool so, Reason reason, std::uint64_t frame) noexcept {
    if (so)
      enter(degradation, reason, frame);
    else
      strike(degradation);
  }
  /// Counts one frame of evidence against a doubt. Returns true if that ended it.
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
  /// The strongest doubt that stands; nullptr if none does. `late_image` does not count while the
  /// rig stands (`moves` false): an image that is an exposure late shows the same then.
  [[nodiscard]] const Entry* strongest(bool moves) const noexcept {
    for (std::size_t i = 0; i < kDegradations; ++i)
      if (entries_[i].reason != Reason::none &&
          (moves || static_cast<Degradation>(i) != Degradation::late_image))
        return &entries_[i];
    return nullptr;
  }
  /// Returns true if `last` or a stronger doubt stands.
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
