#include "app/session/replayed_ins.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "app/devices/rig_settings.hpp"
#include "core/comparison/attitude_check.hpp"

namespace vergence::app {
namespace {

constexpr Duration kAround =
    Duration::seconds(1);  // readings before the first frame and after the last that are kept
constexpr double kPublishedHeading =
    0.3 * std::numbers::pi /
    180;  // a mount from a calibration of three sensors, a lens whose centre is 5 px off
constexpr double kMostOfInterval =
    1.5;  // one reading late by half an interval is no hole, one that is missing is

bool says_mount(const InsSettings& ins) {
  const auto zero = [](double v) { return v == 0; };
  return !std::all_of(ins.lever_arm_m.begin(), ins.lever_arm_m.end(), zero) ||
         !std::all_of(ins.boresight_deg.begin(), ins.boresight_deg.end(), zero);
}

Duration usual_interval(const std::vector<RecordedReading>& readings) {
  std::vector<std::int64_t> ns;
  for (std::size_t i = 1; i < readings.size(); ++i)
    ns.push_back((readings[i].sample.stamp - readings[i - 1].sample.stamp).ns());
  if (ns.empty()) return {};
  const auto middle = ns.begin() + static_cast<std::ptrdiff_t>(ns.size() / 2);
  std::nth_element(ns.begin(), middle, ns.end());
  return Duration::nanoseconds(*middle);
}

/// False: none is left.
bool keep_around(const StereoSequence& sequence, std::size_t first, std::size_t count,
                 std::vector<RecordedReading>* readings) {
  Stamp begin = sequence.pairs[first].stamp, end = begin;
  for (std::size_t i = first; i < first + count; ++i) {
    begin = std::min(begin, sequence.pairs[i].stamp);
    end = std::max(end, sequence.pairs[i].stamp);
  }
  std::erase_if(*readings, [&](const RecordedReading& r) {
    return r.sample.stamp < begin - kAround || r.sample.stamp > end + kAround;
  });
  return !readings->empty();
}

/// Of a recording the whole way is known before the first frame: an attitude that contradicts most
/// of it is taken out from the beginning, and its heading is the course over ground. → how many
/// readings
std::size_t drop_contradicted(const ComparisonOptions& options,
                              std::vector<RecordedReading>* readings) {
  AttitudeCheck check;
  std::optional<LocalTangentPlane> plane;
  std::vector<std::optional<double>> courses;
  bool contradicted = false;
  for (const RecordedReading& r : *readings) {
    const InsSample& s = r.sample;
    const bool fixed = s.fix == FixStatus::fix_2d || s.fix == FixStatus::fix_3d;
    if (fixed && s.attitude_valid && s.position.plausible()) {
      if (!plane) plane.emplace(s.position);
      const auto& [x, y, z, w] = s.q_enu_ins;
      const Vec3 view = Eigen::Quaterniond(w, x, y, z).normalized() * options.T_ins_left.R.col(2);
      check.add(plane->to_enu(s.position).head<2>(),
                s.position_sigma > 0 ? s.position_sigma : options.position_sigma_m,
                std::atan2(view.y(), view.x()));
    }
    contradicted = contradicted || check.contradicted();
    courses.push_back(check.course());
  }
  if (!contradicted || !check.mostly_off()) return 0;
  const auto first =
      std::find_if(courses.begin(), courses.end(), [](const auto& c) { return c.has_value(); });
  std::size_t dropped = 0;
  for (std::size_t i = 0; i < readings->size(); ++i) {
    InsSample& s = (*readings)[i].sample;
    if (!s.attitude_valid) continue;
    s.attitude_valid = false;
    s.heading_source = HeadingSource::course;
    s.yaw_enu = courses[i].value_or(first->value_or(0));
    ++dropped;
  }
  return dropped;
}

std::string mount_sentence(const Transform& T_ins_left, const std::string& source) {
  const Vec3 turn = boresight_of(T_ins_left.R) * (180 / std::numbers::pi);
  const Vec3& arm = T_ins_left.t;
  return fmt::format(
      "the left camera sits at [{:.3f}, {:.3f}, {:.3f}] m in the INS's body, turned by [{:.3f}, "
      "{:.3f}, {:.3f}] deg, by {}",
      arm.x(), arm.y(), arm.z(), turn.x(), turn.y(), turn.z(), source);
}

}  // namespace

ReplayedIns replayed_ins(const ReplayRequest& request, const StereoSequence& sequence) {
  const Configuration& c = request.configuration;
  ReplayedIns out;
  out.options = comparison_options(c);
  RecordedIns recorded =
      sequence.ins ? *sequence.ins
                   : read_recorded_ins(request.format, request.data,
                                       {c.kitti_raw.left, c.kitti_raw.right}, !says_mount(c.ins));
  out.remarks = std::move(recorded.remarks);
  if (recorded.readings.empty()) return out;
  out.readings = std::move(recorded.readings);
  const std::size_t count = std::min(request.frames.value_or(sequence.pairs.size()),
                                     sequence.pairs.size() - request.start);
  if (!keep_around(sequence, request.start, count, &out.readings)) {
    out.remarks.push_back(
        "the INS has no reading of the time of these frames; nothing can be compared");
    return out;
  }
  const Duration usual = usual_interval(out.readings);
  const Duration rarely = Duration::seconds(kMostOfInterval * usual.to_seconds());
  out.options.max_gap = std::max(out.options.max_gap, rarely);
  out.options.max_wait = std::max(out.options.max_wait, rarely);
  out.mount_source = says_mount(c.ins) ? "the configuration"
                                       : "nobody: ins.lever_arm_m and ins.boresight_deg are zero";
  if (recorded.T_ins_left) {
    out.options.T_ins_left = *recorded.T_ins_left;
    if (out.options.heading_sigma_rad == 0) out.options.heading_sigma_rad = kPublishedHeading;
    out.mount_source = recorded.mount_source;
  }
  if (const std::size_t dropped = drop_contradicted(out.options, &out.readings); dropped > 0)
    out.remarks.push_back(
        fmt::format("the INS's attitude is not used, {} readings: it is more than 30 degrees off "
                    "the course over "
                    "ground for 50 m or more; heading is the course",
                    dropped));
  out.remarks.push_back(mount_sentence(out.options.T_ins_left, out.mount_source));
  return out;
}

}  // namespace vergence::app
