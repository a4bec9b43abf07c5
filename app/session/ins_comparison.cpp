#include "app/session/ins_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace vergence::app {

InsComparison::InsComparison(const ComparisonOptions& options, InsSource source, Arena& arena,
                             EventLog& event_log)
    : T_ins_left_(options.T_ins_left),
      comparison_(options, arena),
      event_log_(event_log),
      events_(source, options.scale_stretch_m, event_log) {
  placements_.reserve(kMostPlacements);
}

void InsComparison::add(const InsRecord& reading) noexcept {
  output_->post(reading);
  comparison_.add(reading.sample);
  events_.note(reading.sample, comparison_.counters().jumps,
               comparison_.counters().ins_contradicted > 0);
}

void InsComparison::add(const PoseSample& pose, float decode_ms) noexcept {
  newest_stamp_ = pose.stamp;
  decode_ms_[static_cast<std::size_t>(added_++ % decode_ms_.size())] = decode_ms;
  comparison_.add(pose);
}

void InsComparison::drain() noexcept {
  for (ComparedPose pose; comparison_.next(&pose);) {
    output_->post(FrameReport::of(
        pose, decode_ms_[static_cast<std::size_t>(drained_++ % decode_ms_.size())]));
    if (pose.ins_valid) ++matches_;
    measure_way(pose);
    measure_errors(pose);
    event_log_.note_distance_from_ins(pose.compared ? pose.error_enu.norm() : -1);
    take_placement(pose.pose.stamp);
    if (pose.ins_valid && pose.scale_disagrees) ++scale_disagreements_;
    events_.note(pose, matches_);
  }
}

void InsComparison::finish() noexcept {
  comparison_.finish();
  drain();
  take_placement(newest_stamp_);
}

/// The way is summed across the ground, straight across holes, in steps of four sigmas of a
/// reading: so far apart are two readings at a standstill exp(-4) of the time. A step of length L
/// that errs by e across is e²/2L too long; an MTi-G's place wanders by half a metre in the 1.5 s
/// of a step, which is 0.2 %. A bend of radius R is cut by L²/24R²: at 30 m, by 0.3 % in steps of
/// 8.5 m.
void InsComparison::measure_way(const ComparedPose& pose) noexcept {
  constexpr double kSigmas = 4, kLeast = 0.5, kMost = 20;  // m: longer ones cut corners
  if (!pose.ins_valid) return;
  const Vec2 place = pose.reference.T_enu_left.t.head<2>();
  if (!std::exchange(on_way_, true)) last_place_ = place;
  beyond_ = (place - last_place_).norm();
  if (beyond_ < std::clamp(kSigmas * pose.ins_position_sigma, kLeast, kMost)) return;
  errors_.way_m += std::exchange(beyond_, 0);
  last_place_ = place;
}

void InsComparison::measure_errors(const ComparedPose& pose) noexcept {
  if (!pose.compared) return;
  EarthErrors& e = errors_;
  const double across = pose.error_enu.head<2>().norm(), up = pose.error_enu.z();
  const double turn = -pose.error_yaw * (180.0 / std::numbers::pi);  // a compass counts clockwise
  ++e.poses;
  e.horizontal_rms_m += across * across;
  e.horizontal_most_m = std::max(e.horizontal_most_m, across);
  e.horizontal_end_m = across;
  if (pose.height_known) {
    ++heights_;
    e.up_rms_m += up * up;
    e.up_end_m = up;
  }
  e.heading_rms_deg += turn * turn;
  e.heading_most_deg = std::max(e.heading_most_deg, std::abs(turn));
  e.heading_end_deg = turn;
}

EarthFigures InsComparison::earth(const std::string& mount_source) const {
  EarthFigures figures;
  if (comparison_.has_origin()) figures.origin = comparison_.plane().origin();
  figures.placements.assign(placements_.begin(), placements_.end());
  figures.errors = errors_;
  // The last step is still under way; alone it may be nothing but a standstill's noise.
  if (errors_.way_m > 0) figures.errors.way_m += beyond_;
  const double n = std::max(1.0, static_cast<double>(errors_.poses));
  for (double* squares : {&figures.errors.horizontal_rms_m, &figures.errors.heading_rms_deg})
    *squares = std::sqrt(*squares / n);
  figures.errors.up_rms_m =
      std::sqrt(figures.errors.up_rms_m / std::max(1.0, static_cast<double>(heights_)));
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
          {"ins_contradicted", k.ins_contradicted},
          {"jumps", k.jumps},
          {"compared", k.compared},
          {"without_ins", k.without_ins},
          {"pushed_out", k.pushed_out},
          {"placements", comparison_.placement().revision},
          {"scale_disagrees", scale_disagreements_}};
}

void InsComparison::take_placement(Stamp stamp) noexcept {
  const Placement& p = comparison_.placement();
  if (p.revision == placement_revision_) return;
  placement_revision_ = p.revision;
  if (placements_.size() < kMostPlacements) {
    placements_.push_back({stamp, p});
    if (placements_.size() == kMostPlacements)
      event_log_.log(stamp, "placements_full",
                     "the drive was placed on the earth anew so often that summary.json has no "
                     "further placement; poses.csv has every one",
                     true);
  }
  output_->post(p, comparison_.plane().origin());
  events_.note(p, stamp);
}

}  // namespace vergence::app
