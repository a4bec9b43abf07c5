#pragma once
#include <cstdint>

#include "app/session/event_log.hpp"
#include "core/comparison/comparison.hpp"
#include "core/types/ins_sample.hpp"

namespace vergence::app {

enum class InsSource : std::uint8_t { none, device, recording };

/// Events about an INS and its comparison with the poses: each once, where something changes.
/// Threads: the estimator's, sealed.
class InsEvents {
 public:
  /// Without a source nothing is said about its silence. `event_log` outlives this.
  InsEvents(InsSource source, double scale_stretch_m, EventLog& event_log) noexcept
      : source_(source), scale_stretch_m_(scale_stretch_m), event_log_(event_log) {}

  /// A reading, after the comparison has counted `jumps` of the position. `contradicted`: an
  /// attitude did not go with the way driven.
  void note(const InsSample& sample, std::uint64_t jumps, bool contradicted) noexcept;
  /// A pose that has met its readings, the `matches`-th that found any.
  void note(const ComparedPose& pose, std::uint64_t matches) noexcept;
  void note(const Placement& placement, Stamp stamp) noexcept;

 private:
  void note_attitude(const InsSample& sample) noexcept;
  void note_match(const ComparedPose& pose, std::uint64_t matches) noexcept;
  void note_scale(const ComparedPose& pose) noexcept;

  const InsSource source_;
  const double scale_stretch_m_;
  EventLog& event_log_;
  bool attitude_noted_ = false, contradiction_noted_ = false, scale_disagrees_ = false;
  std::uint64_t jumps_ = 0;
  InsMatch last_match_ = InsMatch::ok;
  std::uint64_t match_run_ = 0;  // poses in a row with that
};

}  // namespace vergence::app
