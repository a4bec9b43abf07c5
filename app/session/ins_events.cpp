#include "app/session/ins_events.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include "core/math/angle.hpp"

namespace vergence::app {

void InsEvents::note(const InsSample& sample, std::uint64_t jumps, bool contradicted) noexcept {
  note_attitude(sample);
  if (contradicted && !std::exchange(contradiction_noted_, true))
    event_log_.log(
        sample.stamp, "ins_attitude",
        "the INS's attitude is more than 30 degrees off the way that is driven: it is not "
        "used while it is; check its filter, and ins.boresight_deg",
        true);
  if (jumps == jumps_) return;
  jumps_ = jumps;
  event_log_.log(
      sample.stamp, "ins_jump",
      "the INS's position leapt: not interpolated across, errors from here on contain the leap",
      true);
}

void InsEvents::note(const ComparedPose& pose, std::uint64_t matches) noexcept {
  if (source_ != InsSource::none) note_match(pose, matches);
  note_scale(pose);
}

void InsEvents::note(const Placement& p, Stamp stamp) noexcept {
  std::array<char, 160> text{};
  (void)std::snprintf(text.data(), text.size(),
                      "placed on the earth after %.1f m: heading to %.2f deg, residual %.2f m",
                      p.distance, p.rotation_sigma.z() * kDegreesPerRadian, p.residual);
  event_log_.log(stamp, "placement", text.data(), false);
}

/// Once a drive: a receiver never has one, an INS has it after it has aligned.
void InsEvents::note_attitude(const InsSample& sample) noexcept {
  if (sample.attitude_valid || sample.heading_source == HeadingSource::none ||
      std::exchange(attitude_noted_, true))
    return;
  const bool heading = sample.heading_source == HeadingSource::heading;
  event_log_.log(sample.stamp, "ins_without_attitude",
                 heading ? "the INS gives no roll and pitch: taken as level; position and measured "
                           "heading are compared"
                         : "the INS gives no attitude: taken as level; position and course are "
                           "compared",
                 false);
}

void InsEvents::note_match(const ComparedPose& pose, std::uint64_t matches) noexcept {
  constexpr std::uint64_t kSettled = 3;  // poses: one missed reading is no event
  match_run_ = pose.ins == last_match_ ? match_run_ + 1 : 1;
  last_match_ = pose.ins;
  if (match_run_ != kSettled) return;
  const bool recorded = source_ == InsSource::recording;
  switch (pose.ins) {
    case InsMatch::ok:
      if (matches > kSettled)
        event_log_.log(pose.pose.stamp, "ins_ok",
                       "the INS has a position again; the comparison goes on", false);
      break;
    case InsMatch::none:
      event_log_.log(
          pose.pose.stamp, "ins_silent",
          recorded
              ? "the recording has no reading of the INS here: these poses are not compared"
              : "the INS is silent: the drive goes on without it; check its cable and its rate",
          true);
      break;
    case InsMatch::gap:
      event_log_.log(pose.pose.stamp, "ins_gap",
                     "readings of the INS are missing: these poses are not compared", true);
      break;
    case InsMatch::no_fix:
      event_log_.log(pose.pose.stamp, "ins_no_fix",
                     recorded ? "the INS had no position: the comparison pauses"
                              : "the INS has no position: the comparison pauses; check its antenna",
                     true);
      break;
    case InsMatch::jump:  // told with the reading: it may fall between two frames
      break;
  }
}

void InsEvents::note_scale(const ComparedPose& pose) noexcept {
  if (pose.scale_disagrees == scale_disagrees_) return;
  scale_disagrees_ = pose.scale_disagrees;
  std::array<char, 200> text{};
  if (scale_disagrees_)
    (void)std::snprintf(
        text.data(), text.size(),
        "the distance travelled comes out %.1f %% %s than the INS's over %.0f m: images cannot "
        "tell, measure the baseline again",
        100 * std::abs(pose.path_ratio - 1), pose.path_ratio > 1 ? "longer" : "shorter",
        scale_stretch_m_);
  else
    (void)std::snprintf(text.data(), text.size(),
                        "the distance travelled agrees with the INS again");
  event_log_.log(pose.pose.stamp, scale_disagrees_ ? "scale_disagrees" : "scale_agrees",
                 text.data(), scale_disagrees_);
}

}  // namespace vergence::app
