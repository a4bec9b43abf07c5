#include "app/session/ins_comparison.hpp"

#include <cmath>

#include <nlohmann/json.hpp>

#include "app/runtime/transform_rows.hpp"
#include "core/math/angle.hpp"

namespace vergence::app {

namespace {

using Json = nlohmann::ordered_json;

}  // namespace

Json ins_mount_json(const Transform& T_ins_left, const std::string& source) {
  const Vec3 turn = boresight_of(T_ins_left.R) * kDegreesPerRadian;
  const Vec3& arm = T_ins_left.t;
  return {{"lever_arm_m", {arm.x(), arm.y(), arm.z()}},
          {"boresight_deg", {turn.x(), turn.y(), turn.z()}},
          {"source", source}};
}

InsComparison::InsComparison(const ComparisonOptions& options, InsSource source, Arena& arena,
                             EventLog& event_log)
    : T_ins_left_(options.T_ins_left),
      scale_stretch_m_(options.scale_stretch_m),
      source_(source),
      comparison_(options, arena),
      event_log_(event_log) {
  alignments_.reserve(kMaxPlacements);
}

void InsComparison::add(const InsRecord& reading) noexcept {
  output_->post(&SessionObserver::on_reading, reading);
  comparison_.add(reading.sample);
  record_sample(reading.sample);
}

void InsComparison::add(const FrameReport& report) noexcept {
  newest_stamp_ = report.pose.stamp;
  pending_[static_cast<std::size_t>(added_++ % pending_.size())] = report;
  comparison_.add(report.pose);
}

void InsComparison::drain() noexcept {
  for (ComparedPose pose; comparison_.next(&pose);) {
    FrameReport& report = pending_[static_cast<std::size_t>(drained_++ % pending_.size())];
    report.set_comparison(pose);
    output_->post(&SessionObserver::on_report, report);
    event_log_.collect(report);
    if (pose.ins_valid) ++matches_;
    measure_way(pose);
    measure_errors(pose);
    apply_enu_alignment(pose.pose.stamp);
    if (pose.ins_valid && pose.scale_disagrees) ++scale_disagreements_;
    record_match(pose);
    record_scale(pose);
  }
}

void InsComparison::finish() noexcept {
  comparison_.finish();
  drain();
  apply_enu_alignment(newest_stamp_);
}

/// The way is summed across the ground, straight across holes, in steps of four sigmas of a
/// reading: so far apart are two readings at a standstill exp(-4) of the time. A step of length L
/// that errs by e across is e²/2L too long; an MTi-G's place wanders by half a metre in the 1.5 s
/// of a step, which is 0.2 %. A bend of radius R is cut by L²/24R²: at 30 m, by 0.3 % in steps of
/// 8.5 m.
void InsComparison::measure_way(const ComparedPose& pose) noexcept {
  // Limits in sigmas and in m; longer sections would cut corners.
  constexpr double kSigmas = 4, kMin = 0.5, kMax = 20;
  if (!pose.ins_valid) return;
  const Vec2 place = pose.reference.T_enu_left.t.head<2>();
  if (!std::exchange(on_way_, true)) last_place_ = place;
  beyond_ = (place - last_place_).norm();
  if (beyond_ < std::clamp(kSigmas * pose.ins_position_sigma, kMin, kMax)) return;
  ins_path_m_ += std::exchange(beyond_, 0);
  last_place_ = place;
}

void InsComparison::measure_errors(const ComparedPose& pose) noexcept {
  if (!pose.compared) return;
  auto& e = errors_;
  const double across = pose.error_enu.head<2>().norm(), up = pose.error_enu.z();
  // A compass heading increases clockwise.
  const double turn = -pose.error_yaw * kDegreesPerRadian;
  ++e.poses;
  e.horizontal_m2 += across * across;
  e.horizontal_max_m = std::max(e.horizontal_max_m, across);
  e.horizontal_end_m = across;
  if (pose.height_known) {
    ++e.heights;
    e.up_m2 += up * up;
    e.up_end_m = up;
  }
  e.heading_deg2 += turn * turn;
  e.heading_max_deg = std::max(e.heading_max_deg, std::abs(turn));
  e.heading_end_deg = turn;
}

Json InsComparison::enu_json(const std::string& mount_source) const {
  if (!comparison_.has_origin()) return nullptr;
  const Geodetic& origin = comparison_.plane().origin();
  Json alignments = Json::array();
  for (const auto& [stamp, p] : alignments_)
    alignments.push_back({{"stamp_ns", stamp.ns()},
                          {"T_enu_world", rows_of(p.T_enu_world)},
                          {"fitted_over_m", p.distance},
                          {"residual_m", p.residual},
                          {"heading_sigma_deg", p.rotation_sigma.z() * kDegreesPerRadian}});
  // The last step is still under way; alone it may be nothing but a standstill's noise.
  const double path = ins_path_m_ > 0 ? ins_path_m_ + beyond_ : 0;
  const auto& e = errors_;
  const auto rms = [](double squares, std::uint64_t n) {
    return std::sqrt(squares / std::max(1.0, static_cast<double>(n)));
  };
  Json errors;
  if (e.poses > 0)
    errors = {{"poses", e.poses},
              {"horizontal_rms_m", rms(e.horizontal_m2, e.poses)},
              {"horizontal_max_m", e.horizontal_max_m},
              {"horizontal_end_m", e.horizontal_end_m},
              {"horizontal_end_percent", path > 0 ? Json(100 * e.horizontal_end_m / path) : Json()},
              {"up_rms_m", rms(e.up_m2, e.heights)},
              {"up_end_m", e.up_end_m},
              {"heading_rms_deg", rms(e.heading_deg2, e.poses)},
              {"heading_max_deg", e.heading_max_deg},
              {"heading_end_deg", e.heading_end_deg}};
  return {{"origin",
           {{"latitude_deg", origin.latitude_deg},
            {"longitude_deg", origin.longitude_deg},
            {"height_m", origin.height_m}}},
          {"mount", ins_mount_json(T_ins_left_, mount_source)},
          {"alignments", alignments},
          {"ins_path_m", path},
          {"errors", errors}};
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
          {"alignments", comparison_.alignment().revision},
          {"scale_disagrees", scale_disagreements_}};
}

void InsComparison::apply_enu_alignment(Stamp stamp) noexcept {
  const EnuAlignment& p = comparison_.alignment();
  if (p.revision == alignment_revision_) return;
  alignment_revision_ = p.revision;
  if (alignments_.size() < kMaxPlacements) {
    alignments_.push_back({stamp, p});
    if (alignments_.size() == kMaxPlacements)
      event_log_.log({stamp, "enu_alignment_limit",
                      "too many ENU alignments for summary.json; poses.csv has all of them"});
  }
  output_->post(&SessionObserver::on_enu_alignment, p, comparison_.plane().origin());
  event_log_.log({stamp, "enu_alignment",
                  "aligned with ENU after {:.1f} m: heading sigma {:.2f} deg, residual {:.2f} m",
                  p.distance, p.rotation_sigma.z() * kDegreesPerRadian, p.residual},
                 false);
}

/// That the INS sends no attitude is reported once a run: a receiver never has one, an INS has it
/// after it has aligned.
void InsComparison::record_sample(const InsSample& sample) noexcept {
  const ComparisonCounters& counters = comparison_.counters();
  if (!sample.attitude_valid && sample.heading_source != HeadingSource::none &&
      !std::exchange(attitude_reported_, true))
    event_log_.log(
        {sample.stamp, "ins_without_attitude",
         sample.heading_source == HeadingSource::heading
             ? "the INS sends no roll and pitch (assumed level): position and heading are "
               "compared"
             : "the INS sends no attitude (assumed level): position and course are compared"},
        false);
  if (counters.ins_contradicted > 0 && !std::exchange(contradiction_reported_, true))
    event_log_.log({sample.stamp, "ins_attitude",
                    "the INS heading differs from the direction of travel by more than 30 deg and "
                    "is not used until it agrees: check its filter and ins.boresight_deg"});
  if (std::exchange(jumps_, counters.jumps) != counters.jumps)
    event_log_.log({sample.stamp, "ins_jump",
                    "the INS position jumped: errors from here on include the jump"});
}

void InsComparison::record_match(const ComparedPose& pose) noexcept {
  // Number of consecutive poses before a change is reported, so that one missed sample is not.
  constexpr std::uint64_t kSettled = 3;
  match_run_ = pose.ins == last_match_ ? match_run_ + 1 : 1;
  last_match_ = pose.ins;
  if (match_run_ != kSettled) return;
  const bool recorded = source_ == InsSource::recording;
  const auto log = [&](const char* kind, const char* message, bool to_user) {
    event_log_.log({pose.pose.stamp, kind, message}, to_user);
  };
  if (pose.ins == InsMatch::ok && matches_ > kSettled)
    log("ins_recovered", "the INS has a position again; the comparison continues", false);
  if (pose.ins == InsMatch::none)
    log("ins_timeout",
        recorded ? "no INS samples in the recording here: these poses are not compared"
                 : "the INS sends nothing; the run continues without it: check its cable and rate",
        true);
  if (pose.ins == InsMatch::gap)
    log("ins_gap", "INS samples are missing: these poses are not compared", true);
  if (pose.ins == InsMatch::no_fix)
    log("ins_no_fix",
        recorded ? "the INS had no position: the comparison pauses"
                 : "the INS has no position: the comparison pauses; check its antenna",
        true);
  // A jump is reported with its sample, because it may fall between two frames.
}

void InsComparison::record_scale(const ComparedPose& pose) noexcept {
  if (pose.scale_disagrees == scale_disagrees_) return;
  scale_disagrees_ = pose.scale_disagrees;
  const Stamp stamp = pose.pose.stamp;
  if (!scale_disagrees_)
    return event_log_.log(
        {stamp, "scale_agrees", "the distance travelled agrees with the INS again"}, false);
  event_log_.log({stamp, "scale_disagrees",
                  "the distance travelled is {:.1f} % {} than the INS's over {:.0f} m: measure the "
                  "baseline again",
                  100 * std::abs(pose.path_ratio - 1), pose.path_ratio > 1 ? "longer" : "shorter",
                  scale_stretch_m_});
}

}  // namespace vergence::app
