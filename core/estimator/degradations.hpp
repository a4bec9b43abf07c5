#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "core/types/pose_sample.hpp"

namespace vergence {

/// Causes of `degraded` poses, strongest first: if several apply, the first one determines the
/// reason.
enum class Degradation : std::uint8_t {
  /// According to the timing, this frame's images were not exposed together.
  pairing,
  /// The map was rebuilt in this frame or shortly before.
  scene,
  /// This frame's images, matches or geometry are weak; see FrameOutcome::reason.
  frame,
  /// A camera's images are from another instant.
  out_of_sync,
  /// A camera may lag by one exposure.
  late_image,
  /// The rig may have changed, or is being recalibrated.
  rig,
  /// The calibration that poses depend on is not verified.
  calibration,
  /// Points of this frame or of recent ones do not move as one rigid scene.
  dynamic_scene,
  /// The window still contains degraded frames, or unusually uncertain motions.
  window,
};
inline constexpr std::size_t kDegradations = static_cast<std::size_t>(Degradation::window) + 1;

/// The degradations that apply, each with its reason and the number of frames of evidence that ends
/// it. A pose is `ok` while there are none, otherwise `degraded` for the strongest
/// reason.
///
///     ledger.enter(Degradation::scene, Reason::map_reset, 10);
///     if (const DegradationLedger::Entry* why = ledger.strongest(true)) use(why->reason);
///     ledger.weaken(Degradation::scene);  // one frame of evidence against it
///
/// Not thread-safe. Does not allocate.
class DegradationLedger {
 public:
  /// Value of `left` for a degradation that only clear() ends.
  static constexpr int kUntilCleared = std::numeric_limits<int>::max();

  struct Entry {
    /// Reason::none if the degradation does not apply.
    Reason reason = Reason::none;
    /// Number of frames of evidence that end the degradation.
    int left = 0;
  };

  /// Enters or renews a degradation.
  void enter(Degradation degradation, Reason reason, int left = kUntilCleared) noexcept {
    at(degradation) = {reason, left};
  }
  void clear(Degradation degradation) noexcept { at(degradation) = {}; }
  /// Enters the degradation if it applies, otherwise ends it.
  void set(Degradation degradation, bool applies, Reason reason) noexcept {
    at(degradation) = applies ? Entry{reason, kUntilCleared} : Entry{};
  }
  /// Counts one frame of evidence against a degradation. Returns true if that ended it.
  bool weaken(Degradation degradation) noexcept {
    Entry& e = at(degradation);
    if (e.reason == Reason::none || e.left == kUntilCleared || --e.left > 0) return false;
    e = {};
    return true;
  }

  [[nodiscard]] const Entry& operator[](Degradation degradation) const noexcept {
    return entries_[static_cast<std::size_t>(degradation)];
  }
  [[nodiscard]] bool active(Degradation degradation) const noexcept {
    return (*this)[degradation].reason != Reason::none;
  }
  /// Returns the strongest degradation that applies, or nullptr. `late_image` does not count while
  /// the rig stands still (`moves` false), because a late image then looks the same.
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
