#include "app/session/ins_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>

namespace vergence::app {

InsComparison::InsComparison(const ComparisonOptions& options, Source source, Arena& arena,
                             EventLog& journal)
    : T_ins_left_(options.T_ins_left),
      scale_stretch_m_(options.scale_stretch_m),
      source_(source),
      comparison_(options, arena),
      journal_(journal) {}

void InsComparison::add(const InsRecord& reading) noexcept {
  output_->post(reading);
  comparison_.add(reading.sample);
  note_attitude(reading.sample);
  note_jump(reading.sample.stamp);
}

void InsComparison::add(const PoseSample& pose, float decode_ms) noexcept {
  newest_stamp_ = pose.stamp;
  decode_ms_[static_cast<std::size_t>(added_++ % decode_ms_.size())] = decode_ms;
  comparison_.add(pose);
}

void InsComparison::drain() noexcept {
  for (ComparedPose pose; comparison_.next(&pose);) {
    output_->post(
        PoseRecord::of(pose, decode_ms_[static_cast<std::size_t>(drained_++ % decode_ms_.size())]));
    if (pose.ins_valid) ++matches_;
    measure(pose);
    journal_.note_distance_from_ins(pose.compared ? pose.error_enu.norm() : -1);
    note_placement(pose.pose.stamp);
    if (source_ != Source::none) note_ins(pose);
    note_scale(pose);
  }
}

void InsComparison::finish() noexcept {
  comparison_.finish();
  drain();
  note_placement(newest_stamp_);
}

/// The way is summed in steps that are none of the receiver's noise at a standstill, straight
/// across holes.
void InsComparison::measure(const ComparedPose& pose) noexcept {
  constexpr double kLeastStep = 0.5;  // m
  if (pose.ins_valid) {
    const Vec3& place = pose.reference.T_enu_left.t;
    const double step = on_way_ ? (place - last_place_).norm() : 0;
    if (step >= kLeastStep) errors_.way_m += step;
    if (!on_way_ || step >= kLeastStep) last_place_ = place;
    on_way_ = true;
  }
  if (!pose.compared) return;
  EarthErrors& e = errors_;
  const double across = pose.error_enu.head<2>().norm(), up = pose.error_enu.z();
  const double turn = -pose.error_yaw * (180.0 / std::numbers::pi);  // a compass counts clockwise
  ++e.poses;
  e.horizontal_rms_m += across * across;
  e.horizontal_most_m = std::max(e.horizontal_most_m, across);
  e.horizontal_end_m = across;
  e.up_rms_m += up * up;
  e.up_end_m = up;
  e.heading_rms_deg += turn * turn;
  e.heading_most_deg = std::max(e.heading_most_deg, std::abs(turn));
  e.heading_end_deg = turn;
}

EarthFigures InsComparison::earth(const std::string& mount_source) const {
  EarthFigures figures;
  if (comparison_.has_origin()) figures.origin = comparison_.plane().origin();
  figures.placements.assign(placements_.begin(), placements_.end());
  figures.errors = errors_;
  const double n = std::max(1.0, static_cast<double>(errors_.poses));
  for (double* squares : {&figures.errors.horizontal_rms_m, &figures.errors.up_rms_m,
                          &figures.errors.heading_rms_deg})
    *squares = std::sqrt(*squares / n);
  figures.T_ins_left = T_ins_left_;
  figures.mount_source = mount_source;
  return figures;
}

std::vector<std::pair<std::string, std::uint64_t>> InsComparison::counters() const {
  const ComparisonCounters& k = comparison_.counters();
  return {{"ins_samples", k.ins_samples},
          {"ins_refused", k.ins_refused},
          {"ins_restarts", k.ins_restarts},
          {"ins_without_attitude", k.ins_without_attitude},
          {"jumps", k.jumps},
          {"compared", k.compared},
          {"without_ins", k.without_ins},
          {"pushed_out", k.pushed_out},
          {"placements", comparison_.placement().revision},
          {"scale_disagrees", scale_disagreements_}};
}

void InsComparison::note_placement(Stamp stamp) noexcept {
  const Placement& p = comparison_.placement();
  if (p.revision == placement_revision_) return;
  placement_revision_ = p.revision;
  (void)placements_.push({stamp, p});  // full: the count goes on
  output_->post(p, comparison_.plane().origin());
  std::array<char, 160> text{};
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  (void)std::snprintf(text.data(), text.size(),
                      "placed on the earth after %.1f m: heading to %.2f deg, residual %.2f m",
                      p.distance, p.rotation_sigma.z() * kDegrees, p.residual);
  journal_.tell(stamp, "placement", text.data(), false);
}

/// Once a drive: a receiver never has one, an INS has it after it has aligned.
void InsComparison::note_attitude(const InsSample& sample) noexcept {
  if (sample.attitude_valid || sample.heading_source == HeadingSource::none ||
      std::exchange(attitude_noted_, true))
    return;
  const bool heading = sample.heading_source == HeadingSource::heading;
  journal_.tell(sample.stamp, "ins_without_attitude",
                heading ? "the INS gives no roll and pitch: taken as level; position and measured "
                          "heading are compared"
                        : "the INS gives no attitude: taken as level; position and course are "
                          "compared",
                false);
}

void InsComparison::note_ins(const ComparedPose& pose) noexcept {
  constexpr std::uint64_t kSettled = 3;  // poses: one missed reading is no event
  match_run_ = pose.ins == last_match_ ? match_run_ + 1 : 1;
  last_match_ = pose.ins;
  if (match_run_ != kSettled) return;
  const bool recorded = source_ == Source::recording;
  switch (pose.ins) {
    case InsMatch::ok:
      if (matches_ > kSettled)
        journal_.tell(pose.pose.stamp, "ins_ok",
                      "the INS has a position again; the comparison goes on", false);
      break;
    case InsMatch::none:
      journal_.tell(
          pose.pose.stamp, "ins_silent",
          recorded
              ? "the recording has no reading of the INS here: these poses are not compared"
              : "the INS is silent: the drive goes on without it; check its cable and its rate",
          true);
      break;
    case InsMatch::gap:
      journal_.tell(pose.pose.stamp, "ins_gap",
                    "readings of the INS are missing: these poses are not compared", true);
      break;
    case InsMatch::no_fix:
      journal_.tell(pose.pose.stamp, "ins_no_fix",
                    recorded ? "the INS had no position: the comparison pauses"
                             : "the INS has no position: the comparison pauses; check its antenna",
                    true);
      break;
    case InsMatch::jump:  // told with the reading: it may fall between two frames
      break;
  }
}

void InsComparison::note_jump(Stamp stamp) noexcept {
  const std::uint64_t jumps = comparison_.counters().jumps;
  if (jumps == jumps_) return;
  jumps_ = jumps;
  journal_.tell(
      stamp, "ins_jump",
      "the INS's position leapt: not interpolated across, errors from here on contain the leap",
      true);
}

void InsComparison::note_scale(const ComparedPose& pose) noexcept {
  if (pose.scale_disagrees) ++scale_disagreements_;
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
  journal_.tell(pose.pose.stamp, scale_disagrees_ ? "scale_disagrees" : "scale_agrees", text.data(),
                scale_disagrees_);
}

}  // namespace vergence::app
