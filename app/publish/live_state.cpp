#include "app/publish/live_state.hpp"

#include "app/report/assessment.hpp"
#include "app/runtime/transform_rows.hpp"
#include "core/math/angle.hpp"
#include "core/math/so3.hpp"

namespace vergence::app {
namespace {

using nlohmann::json;

/// Rounds to the digits that a page needs; null if the number is not finite.
json rounded(double value, double digits) {
  if (!std::isfinite(value)) return nullptr;
  const double scale = std::pow(10.0, digits);
  return std::round(value * scale) / scale;
}

json event_json(const EventRecord& event, Stamp first) {
  return {{"s", rounded((event.stamp - first).to_seconds(), 1)},
          {"kind", event.kind},
          {"message", event.message.data()}};
}

json camera_json(const RigCalibration& rig, std::size_t k) {
  const Transform& T = rig.T_camera_left[k];
  const Vec3 turn = log_so3(T.R) * kDegreesPerRadian;
  json parameters = json::array();
  const auto& sigma = rig.sigma_total[k];
  for (std::size_t i = 0; i < 6; ++i) {
    const double unit = i < 3 ? kDegreesPerRadian : 1e3;
    const auto axis = static_cast<Eigen::Index>(i % 3);
    parameters.push_back({rounded(i < 3 ? turn[axis] : T.t[axis] * unit, i < 3 ? 4 : 2),
                          sigma[i] > 0 ? rounded(2 * sigma[i] * unit, i < 3 ? 4 : 2) : nullptr});
  }
  return {{"parameters", parameters}};
}

// A status is old after this time without a frame, or after this many intervals between frames.
constexpr double kSilenceSeconds = 1, kMaxIntervals = 3;
// In frames.
constexpr double kSmoothing = 8;

/// The rows of east and north.
json enu_alignment_json(const PublishedEnuAlignment& alignment) {
  const auto rows = rows_of(alignment.alignment.T_enu_world);
  return std::vector(rows.begin(), rows.begin() + 8);
}

// In m. With longer steps a map no longer shows the path.
constexpr float kMaxStep = 16;

float distance(const std::array<float, 3>& a, const std::array<float, 3>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

}  // namespace

/// A gap counts at most as twice the interval, so that one outage does not hide the next one.
void LiveState::add_interval(HostStamp estimated) noexcept {
  const double gap = (estimated - newest_->estimated).to_seconds();
  if (interval_s_ <= 0) interval_s_ = gap;
  interval_s_ += (std::min(gap, 2 * interval_s_) - interval_s_) / kSmoothing;
}

void LiveState::add(const PosedFrame& posed) {
  const FrameReport& report = posed.report;
  if (newest_) add_interval(report.estimated);
  newest_ = report;
  estimate_.add(static_cast<double>(report.pose.estimate_ms));
}

void LiveState::add(const FrameReport& report) {
  newest_report_ = report;
  const PoseStatus status = report.pose.status;
  if (status == PoseStatus::lost && !report.ins_valid) return;
  LiveTrail::Place place;
  const auto number = [](double v) { return static_cast<float>(v); };
  const Vec3& t = report.pose.T_world_left.t;
  place.world = {number(t.x()), number(t.y()), number(t.z())};
  place.status = static_cast<std::uint8_t>(status);
  if (status == PoseStatus::lost && !trail_.places().empty())
    place.world = trail_.places().back().world;
  const Vec3& ins = report.reference.T_enu_left.t;
  if (report.ins_valid) place.ins = {number(ins.x()), number(ins.y())};
  place.version = ++version_;
  trail_.add(place);
}

void LiveState::add(const EventRecord& event) {
  if (events_.size() == kEvents) events_.pop_front();
  events_.emplace_back(++version_, event);
  const std::string_view kind = event.kind;
  const bool verified = kind == "calibration_verified";
  if (verified || kind == "calibration_contradicted" || kind == "rig_changed") {
    verified_ = verified;
    calibration_version_ = version_;
  }
}

void LiveState::add(const CalibrationRecord& calibration) {
  if (calibrations_.size() == kCalibrations) calibrations_.pop_front();
  calibrations_.push_back(calibration);
  calibration_version_ = ++version_;
  if (calibration.is_refinement) measured_ = calibration;
  if (!calibration.accepted) return;
  measured_.reset();
  if (calibration.decided) verified_ = calibration.verified;
  in_use_ = calibration;
}

void LiveState::add(const PublishedEnuAlignment& alignment) {
  alignment_ = alignment;
  alignment_version_ = ++version_;
}

json LiveState::frame_json(HostStamp now) const {
  const FrameReport& f = *newest_;
  const FrameCounts& n = f.counts;
  const double silence = (now - f.estimated).to_seconds();
  const PoseSample& p = f.pose;
  const std::string_view reason = to_string(p.reason);
  json out{
      {"frame", p.frame},
      {"s", rounded((p.stamp - start_.first).to_seconds(), 2)},
      // Time since the frame arrived.
      {"since_s", rounded(silence, 1)},
      {"silent", silence > std::max(kSilenceSeconds, kMaxIntervals * interval_s_)},
      {"state", to_string(p.state)},
      {"status", to_string(p.status)},
      {"reason", reason},
      {"advice", p.status == PoseStatus::ok ? "" : report::advice_for(p.reason)},
      {"inliers", p.inliers},
      {"stereo_inliers", p.stereo_inliers},
      {"reprojection_px", rounded(p.reprojection_px, 3)},
      {"estimate_ms", rounded(p.estimate_ms, 2)},
      {"estimate_p50_ms", rounded(estimate_.percentile(0.5), 2)},
      {"estimate_p99_ms", rounded(estimate_.percentile(0.99), 2)},
      {"read", n.read},
      {"ok", n.ok},
      {"degraded", n.degraded},
      {"lost", n.lost},
      {"missing", n.missing},
      {"path_m", rounded(n.path_m, 2)},
      {"stamp_error_us", rounded(static_cast<double>(f.stamp_error.ns()) * 1e-3, 1)},
      {"spread_us", rounded(static_cast<double>(f.spread.ns()) * 1e-3, 1)},
      {"pairing", pairing_name(f.pairing)},
      {"age_ms", start_.tie
                     ? rounded((start_.tie->stamp_at(f.estimated) - p.stamp).to_seconds() * 1e3, 2)
                     : json(nullptr)}};
  if (p.status != PoseStatus::lost)
    for (const double v : p.T_world_left.t) out["position_m"].push_back(rounded(v, 3));
  if (newest_report_ && newest_report_->compared) {
    const auto e = newest_report_->error();
    out["ins"] = {{"across_m", rounded(std::hypot(e[0], e[1]), 2)},
                  {"up_m", rounded(e[2], 2)},
                  {"heading_deg", rounded(e[3], 2)}};
  }
  if (newest_report_ && newest_report_->placed) {
    const EnuPose& estimate = newest_report_->estimate;
    out["enu"] = {{"latitude_deg", rounded(estimate.position.latitude_deg, 7)},
                  {"longitude_deg", rounded(estimate.position.longitude_deg, 7)},
                  {"height_m", rounded(estimate.position.height_m, 2)},
                  {"heading_deg", rounded(compass_heading_deg(estimate.yaw), 1)}};
  }
  return out;
}

json LiveState::calibration_json() const {
  json out{{"cameras", json::array()}, {"history", json::array()}};
  for (const auto& [key, record] : {std::pair("cameras", &in_use_), {"measured", &measured_}})
    if (*record)
      for (int k = 0; k < (*record)->calibration.cameras; ++k)
        out[key].push_back(camera_json((*record)->calibration, static_cast<std::size_t>(k)));
  out["verified"] = verified_;
  if (in_use_) {
    out["cause"] = in_use_->cause_name();
    out["frames"] = in_use_->calibration.frames;
    const CalibrationRecord& known = measured_ ? *measured_ : *in_use_;
    out["depth"] = known.depth_sigma_percent > 0
                       ? json({{"at_m", rounded(known.reference_depth_m, 1)},
                               {"sigma_percent", rounded(known.depth_sigma_percent, 2)}})
                       : json(nullptr);
  }
  for (const CalibrationRecord& c : calibrations_)
    out["history"].push_back({{"s", rounded((c.stamp - start_.first).to_seconds(), 1)},
                              {"what", c.accepted        ? "in use"
                                       : c.is_refinement ? "unchanged"
                                                         : "rejected"},
                              {"cause", c.cause_name()},
                              {"reason", c.why()}});
  return out;
}

json LiveState::place_json(const LiveTrail::Place& p) {
  json out{rounded(static_cast<double>(p.world[0]), 2), rounded(static_cast<double>(p.world[1]), 2),
           rounded(static_cast<double>(p.world[2]), 2), p.status};
  if (p.ins)
    for (const float v : *p.ins) out.push_back(rounded(static_cast<double>(v), 2));
  return out;
}

json LiveState::since(std::uint64_t version, HostStamp now) const {
  json out{{"version", version_},           {"session", start_.name},
           {"frames", start_.frames},       {"can_recalibrate", start_.can_recalibrate},
           {"recording", start_.recording}, {"ended", ended_}};
  if (newest_) out["now"] = frame_json(now);
  const std::size_t first = trail_.first_after(version);
  out["trail_from"] = first;
  json& trail = out["trail"] = json::array();
  const std::vector<LiveTrail::Place>& places = trail_.places();
  for (std::size_t i = first; i < places.size(); ++i) trail.push_back(place_json(places[i]));
  json& events = out["events"] = json::array();
  for (const auto& [event_version, event] : events_)
    if (event_version > version) events.push_back(event_json(event, start_.first));
  if (calibration_version_ > version) out["calibration"] = calibration_json();
  if (alignment_version_ > version) out["enu_alignment"] = enu_alignment_json(*alignment_);
  return out;
}

void LiveTrail::add(const Place& place) {
  if (places_.size() == kMax) thin(place.version);
  if (places_.empty() || distance(place.world, places_.back().world) >= min_step_m_)
    return places_.push_back(place);
  // A rig that stands still for weeks uses no further points, regardless of its status.
  Place& last = places_.back();
  if (place.status <= last.status) return;
  last.status = place.status;
  last.version = place.version;
}

std::size_t LiveTrail::first_after(std::uint64_t version) const noexcept {
  const auto first = std::partition_point(
      places_.begin(), places_.end(), [version](const Place& p) { return p.version <= version; });
  return static_cast<std::size_t>(first - places_.begin());
}

void LiveTrail::thin(std::uint64_t version) {
  if (min_step_m_ >= kMaxStep) {
    places_.erase(places_.begin(), places_.begin() + kMax / 2);
  } else {
    min_step_m_ *= 2;
    for (std::size_t i = 0; i < places_.size(); i += 2) {
      places_[i].status = std::max(places_[i].status, places_[i + 1].status);
      places_[i / 2] = places_[i];
    }
    places_.resize(kMax / 2);
  }
  for (Place& p : places_) p.version = version;
}

}  // namespace vergence::app
