#include "app/commands/evaluation.hpp"

#include <cmath>
#include <iostream>
#include <iterator>
#include <system_error>

#include <nlohmann/json.hpp>

#include "app/datasets/text_file.hpp"
#include "app/runtime/terminal_text.hpp"
#include "app/session/ins_comparison.hpp"
#include "core/comparison/geodesy.hpp"
#include "core/comparison/mount.hpp"
#include "core/math/angle.hpp"
#include "core/math/robust.hpp"

namespace vergence::app {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// INS extrinsics used if none are estimated.
struct InsMount {
  Transform T_ins_left{};
  // Where the extrinsics were read.
  std::string source{};
  // True if the extrinsics are unknown: the camera looks along the INS's x axis, at its origin.
  bool axes_only = false;
};

/// The mount between two trajectories' bodies. `nominal` is the nearest of three: the same axes,
/// forward-left-up against a camera's axes, and the reverse. If the status is not `ok`, only the
/// status is set.
struct FoundMount {
  MountStatus status = MountStatus::too_few;
  Mount mount{};
  Mat3 nominal = Mat3::Identity();
  // True if the reference is an INS and the estimate a camera: the result is then what the
  // configuration calls INS-to-camera extrinsics.
  bool of_ins = false;
};

constexpr double kPercent = 100.0;

Json statistics_json(const ErrorStatistics& s, double unit) {
  return {{"rmse", s.rmse * unit},
          {"mean", s.mean * unit},
          {"median", s.median * unit},
          {"max", s.max * unit}};
}

Json heading_json(const HeadingErrors& h) {
  return {{"rms", h.rms * kDegreesPerRadian},
          {"mean", h.mean * kDegreesPerRadian},
          {"max_abs", h.max_abs * kDegreesPerRadian},
          {"last", h.last * kDegreesPerRadian}};
}

Json vector_json(const Vec3& v) { return Json::array({v.x(), v.y(), v.z()}); }

/// A length as people write it: 100, not 100.0.
Json length_json(double length) {
  constexpr double kExactIntegers = 1e15;
  if (length == std::floor(length) && length < kExactIntegers)
    return static_cast<std::int64_t>(length);
  return length;
}

Json segments_json(const SegmentErrors& segments) {
  Json lengths = Json::array(), rows = Json::object();
  for (const LengthError& row : segments.per_length) {
    lengths.push_back(length_json(row.length));
    rows[fmt::format("{}", row.length)] = {{"n", row.count},
                                           {"t_percent", row.translation * kPercent},
                                           {"r_deg_per_m", row.rotation * kDegreesPerRadian}};
  }
  return {{"step", segments.step},
          {"lengths", lengths},
          {"per_length", rows},
          {"n", segments.count},
          {"t_percent", segments.translation * kPercent},
          {"r_deg_per_m", segments.rotation * kDegreesPerRadian}};
}

std::string left_out(const TrajectoryEvaluation& e, const EvaluationOptions& options) {
  const char* inside = options.association == Association::nearest
                           ? "without a near enough reference pose"
                           : "in gaps of the reference";
  return fmt::format("{} before the reference, {} after it, {} {}", e.before, e.after, e.gap,
                     inside);
}

void table_row(std::string* out, const char* name, const std::array<double, 4>& values, double unit,
               const char* symbol) {
  fmt::format_to(std::back_inserter(*out), "  {:<34}{:>11.4f} {:>11.4f} {:>11.4f} {:>11.4f}  {}\n",
                 name, values[0] * unit, values[1] * unit, values[2] * unit, values[3] * unit,
                 symbol);
}

void table_head(std::string* out, const char* what, const std::array<const char*, 4>& columns) {
  fmt::format_to(std::back_inserter(*out), "{:<36}{:>11} {:>11} {:>11} {:>11}\n",
                 fmt::format("  {}", what), columns[0], columns[1], columns[2], columns[3]);
}

std::array<double, 4> values_of(const ErrorStatistics& s) {
  return {s.rmse, s.mean, s.median, s.max};
}

std::array<double, 4> values_of(const HeadingErrors& h) {
  return {h.rms, h.mean, h.max_abs, h.last};
}

void segment_rows(std::string* out, const SegmentErrors& segments) {
  auto at = std::back_inserter(*out);
  fmt::format_to(at, "\n  {:<34}{:>8}   translation    rotation\n",
                 fmt::format("segments, step {}", segments.step), "number");
  const auto row = [&](const std::string& name, std::size_t count, double translation,
                       double rotation) {
    if (count == 0)
      fmt::format_to(at, "  {:<34}{:>8}   the path is too short\n", name, "none");
    else
      fmt::format_to(at, "  {:<34}{:>8} {:>10.4f} %  {:>10.6f} deg/m\n", name, count,
                     translation * kPercent, rotation * kDegreesPerRadian);
  };
  for (const LengthError& length : segments.per_length)
    row(fmt::format("{} m", length.length), length.count, length.translation, length.rotation);
  row("all", segments.count, segments.translation, segments.rotation);
}

/// The mount of a session's summary. Nothing: there is none, as of a drive without an INS or one
/// that was cut off.
std::optional<InsMount> mount_in(const std::filesystem::path& summary) {
  constexpr std::size_t kLargest = std::size_t{1} << 26U;
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(summary, ignored)) return std::nullopt;
  try {
    const Json mount = Json::parse(read_text(summary, kLargest)).at("/enu/mount"_json_pointer);
    const auto arm = mount.at("lever_arm_m").get<std::array<double, 3>>(),
               turn = mount.at("boresight_deg").get<std::array<double, 3>>();
    return InsMount{mount_of(Vec3(arm.data()), Vec3(turn.data()) * kRadiansPerDegree),
                    fmt::format("{}: {}", summary.string(), mount.value("source", "unknown")),
                    false};
  } catch (const Json::exception&) {
    return std::nullopt;
  }
}

Json value_json(const MountValue& v, double unit) {
  return {{"value", v.observable ? Json(v.value * unit) : Json(nullptr)},
          {"sigma", v.sigma * unit}};
}

std::string row(const char* what, const MountValue& v, double unit, const char* name) {
  if (!v.observable)
    return fmt::format("  {:<34}not_observable (sigma {:.3g} {})\n", what, v.sigma * unit, name);
  return fmt::format("  {:<34}{:>11.4f} ± {:.4f} {}\n", what, v.value * unit, v.sigma * unit, name);
}

/// Value for `ins.boresight_deg`: roll, pitch, yaw. Nullopt: it is no INS's mount, or a part of
/// it does not show.
std::optional<std::array<double, 3>> boresight_deg(const FoundMount& found) {
  const auto& r = found.mount.rotation;
  if (!found.of_ins || !std::ranges::all_of(r, [](const MountValue& v) { return v.observable; }))
    return std::nullopt;
  const Vec3 turn = boresight_of(found.mount.T_ref_est.R) * kDegreesPerRadian;
  return std::array{turn.x(), turn.y(), turn.z()};
}

nlohmann::ordered_json evaluation_json(const TrajectoryEvaluation& e,
                                       const EvaluationOptions& options) {
  Json out;
  out["matched"] = e.matched;
  out["dropped"] = Json::object();
  // For nearest neighbours only the match is defined, not on which side the others lie.
  if (options.association == Association::interpolate)
    out["dropped"] = {{"before", e.before}, {"after", e.after}, {"gap", e.gap}};
  if (e.status != EvaluationStatus::ok) return out;

  out["path_reference_m"] = e.path_reference;
  out["path_estimate_m"] = e.path_estimate;
  out["path_ratio_estimate_over_reference"] = e.path_ratio;
  out["ate_se3_m"] = statistics_json(e.ate_se3, 1.0);
  out["se3_rotation_vector_rad"] = vector_json(log_so3(e.se3.R_reference_estimate));
  out["se3_translation_m"] = vector_json(e.se3.t_reference_estimate);
  out["sim3_scale"] = e.sim3.scale;
  out["ate_sim3_m"] = statistics_json(e.ate_sim3, 1.0);
  out["ate_unaligned_m"] = statistics_json(e.ate_unaligned, 1.0);
  out["heading_error_deg"] = heading_json(e.heading_se3);
  out["heading_error_start_aligned_deg"] = heading_json(e.heading_start_aligned);
  out["rotation_error_deg"] = statistics_json(e.rotation_se3, kDegreesPerRadian);
  out["roll_about_path_unobservable"] = e.se3.roll_unobservable;
  out["end_error_aligned_m"] = e.end_error_se3;
  out["end_error_start_aligned_m"] = e.end_error_start_aligned;
  out["end_error_start_aligned_percent"] = e.end_error_ratio * kPercent;
  out["end_rotation_start_aligned_deg"] = e.end_rotation_start_aligned * kDegreesPerRadian;
  out["segments"] = Json::array();
  for (const SegmentErrors& segments : e.segments)
    out["segments"].push_back(segments_json(segments));
  return out;
}

std::string evaluation_text(const TrajectoryEvaluation& e, const EvaluationOptions& options) {
  std::string out;
  auto at = std::back_inserter(out);
  fmt::format_to(at, "{} poses matched; left out: {}\n", e.matched, left_out(e, options));
  if (e.status != EvaluationStatus::ok) return out;
  fmt::format_to(at, "path: reference {:.3f} m, estimate {:.3f} m, ratio {:.6f}\n",
                 e.path_reference, e.path_estimate, e.path_ratio);
  fmt::format_to(
      at, "scale: {:.6f} (Sim(3): reference = scale * R * estimate + t; reported, not applied)\n\n",
      e.sim3.scale);

  constexpr std::array kStatistics{"rmse", "mean", "median", "max"};
  table_head(&out, "position error", kStatistics);
  table_row(&out, "SE(3)-aligned", values_of(e.ate_se3), 1.0, "m");
  table_row(&out, "Sim(3)-aligned", values_of(e.ate_sim3), 1.0, "m");
  table_row(&out, "not aligned", values_of(e.ate_unaligned), 1.0, "m");
  out += '\n';
  table_head(&out, "heading error", {"rms", "mean", "max", "last"});
  table_row(&out, "start-aligned", values_of(e.heading_start_aligned), kDegreesPerRadian, "deg");
  table_row(&out, "SE(3)-aligned", values_of(e.heading_se3), kDegreesPerRadian, "deg");
  out += '\n';
  table_head(&out, "rotation error", kStatistics);
  table_row(&out, "SE(3)-aligned", values_of(e.rotation_se3), kDegreesPerRadian, "deg");
  if (e.se3.roll_unobservable)
    out +=
        "  The path is nearly straight: positions do not determine the rotation about it. Use the "
        "start-aligned angles.\n";

  fmt::format_to(at, "\n  {:<34}{:>11.4f} m = {:.4f} % of the path, {:.4f} deg\n",
                 "end error, start-aligned", e.end_error_start_aligned,
                 e.end_error_ratio * kPercent, e.end_rotation_start_aligned * kDegreesPerRadian);
  fmt::format_to(at, "  {:<34}{:>11.4f} m\n", "end error, SE(3)-aligned", e.end_error_se3);
  for (const SegmentErrors& segments : e.segments) segment_rows(&out, segments);
  return out;
}

std::string gap_remark(const TrajectoryEvaluation& e, const EvaluationOptions& options,
                       Duration interval) {
  if (e.gap <= e.matched || options.association == Association::nearest) return "";
  // Margin above the median interval, because intervals vary.
  constexpr double kRoom = 1.1;
  // The proposed value is rounded up to multiples of 1/20 s.
  constexpr double kSteps = 20;
  const double seconds = interval.to_seconds();
  return fmt::format(
      "{} poses are in gaps of the reference longer than --max-gap {:g}; the poses of the "
      "reference are {:.3g} s apart (median): use --max-gap {:g}",
      e.gap, options.max_gap.to_seconds(), seconds, std::ceil(kSteps * kRoom * seconds) / kSteps);
}

std::string evaluation_problem(const TrajectoryEvaluation& e, const EvaluationOptions& options,
                               Duration interval) {
  std::string holes = gap_remark(e, options, interval);
  if (e.status == EvaluationStatus::no_motion)
    return "one of the two trajectories does not move, so they cannot be aligned; use a part with "
           "motion";
  if (e.status == EvaluationStatus::too_few)
    return fmt::format("only {} poses matched, an alignment needs three ({}){}{}", e.matched,
                       left_out(e, options), holes.empty() ? "" : "; ", holes);
  if (!holes.empty()) return holes;
  return fmt::format(
      "no pose of the estimate has a reference at its time ({}); check that both files use the "
      "same clock and time unit (--time-unit)",
      left_out(e, options));
}

InsMount load_ins_mount(const std::filesystem::path& estimate,
                        const std::filesystem::path& readings) {
  std::error_code ignored;
  for (const std::filesystem::path& path : {estimate, readings}) {
    const bool folder = std::filesystem::is_directory(path, ignored);
    if (auto mount = mount_in((folder ? path : path.parent_path()) / "summary.json")) return *mount;
  }
  return {mount_of(Vec3::Zero(), Vec3::Zero()), "the axes only", true};
}

std::string ins_mount_text(const InsMount& mount) {
  if (mount.axes_only)
    return "the data set has no INS-to-camera extrinsics: the camera is assumed at the INS, "
           "looking along its x axis; --estimate-ins-extrinsics estimates both\n";
  return fmt::format("the INS is transformed to the left camera with {}\n", mount.source);
}

const char* mount_problem(MountStatus status) {
  constexpr std::array kProblems{
      "ok",
      "fewer than 20 stamps in common; use a longer sequence, or check that both have the same "
      "clock",
      "nothing moved: INS extrinsics can only be estimated in motion",
      "no fit: check that both trajectories are of the same run, that their clocks differ by less "
      "than 0.3 s and their attitudes by less than 15°"};
  return kProblems.at(static_cast<std::size_t>(status));
}

std::vector<MountReference> ins_moments(std::span<const InsRecord> readings) {
  const auto placed = [](const InsRecord& r) {
    return r.sample.attitude_valid &&
           (r.sample.fix == FixStatus::fix_2d || r.sample.fix == FixStatus::fix_3d);
  };
  std::vector<MountReference> moments;
  const auto first = std::ranges::find_if(readings, placed);
  if (first == readings.end()) return moments;
  const LocalTangentPlane plane(first->sample.position);
  moments.reserve(readings.size());
  for (const InsRecord& r : readings) {
    if (!placed(r)) continue;
    const InsSample& s = r.sample;
    const auto& [x, y, z, w] = s.q_enu_ins;
    const Mat3 R_enu_local = plane.rotation_from(s.position);
    const Transform T_enu_ins{
        R_enu_local * Eigen::Quaterniond(w, x, y, z).normalized().toRotationMatrix(),
        plane.to_enu(s.position)};
    const auto& [east, north, up] = s.velocity_enu;
    moments.push_back({s.stamp, T_enu_ins, R_enu_local * Vec3(east, north, up), s.velocity_valid});
  }
  return moments;
}

FoundMount find_ins_mount(const Trajectory& estimate, std::span<const MountReference> moments) {
  FoundMount found{.nominal = mount_of(Vec3::Zero(), Vec3::Zero()).R, .of_ins = true};
  found.status = estimate_ins_extrinsics(estimate, moments, found.nominal, {}, &found.mount);
  return found;
}

FoundMount find_mount(const Trajectory& estimate, const Trajectory& reference) {
  std::vector<MountReference> readings;
  readings.reserve(reference.size());
  for (const StampedPose& pose : reference)
    readings.push_back({pose.stamp, pose.T_world_body, Vec3::Zero(), false});
  const Mat3 R_flu_camera = mount_of(Vec3::Zero(), Vec3::Zero()).R;
  FoundMount best;
  double least = 1e9;
  for (const Mat3& nominal :
       {Mat3(Mat3::Identity()), R_flu_camera, Mat3(R_flu_camera.transpose())}) {
    FoundMount found{.nominal = nominal};
    found.status = estimate_ins_extrinsics(estimate, readings, nominal, {}, &found.mount);
    if (found.status != MountStatus::ok) {
      if (best.status != MountStatus::ok) best.status = found.status;
      continue;
    }
    const auto& r = found.mount.rotation;
    const double turn = Vec3(r[0].value, r[1].value, r[2].value).norm();
    if (turn >= least) continue;
    least = turn;
    best = found;
  }
  return best;
}

Json mount_json(const FoundMount& found) {
  Json out;
  out["status"] = mount_problem(found.status);
  if (found.status != MountStatus::ok) return out;
  const Mount& m = found.mount;
  constexpr std::array<const char*, 3> kAxes{"x", "y", "z"};
  for (std::size_t k = 0; k < 3; ++k) {
    out["rotation_deg"][kAxes[k]] = value_json(m.rotation[k], kDegreesPerRadian);
    out["lever_arm_m"][kAxes[k]] = value_json(m.lever_arm[k], 1);
  }
  out["clock_offset_s"] = value_json(m.clock_offset, 1);
  if (const auto boresight = boresight_deg(found)) out["boresight_deg"] = *boresight;
  out["moments"] = m.moments;
  out["residual_rotation_deg"] = m.residual_rotation * kDegreesPerRadian;
  out["residual_position_m"] = m.residual_position;
  return out;
}

std::string mount_text(const FoundMount& found) {
  const Mount& m = found.mount;
  std::string out = fmt::format(
      "extrinsics of the {}, from {} instants (residuals {:.3f} deg, {:.3f} m)\n",
      found.of_ins ? "left camera in the INS's body" : "estimate's body in the reference's",
      m.moments, m.residual_rotation * kDegreesPerRadian, m.residual_position);
  out += row("rotation about the reference's x", m.rotation[0], kDegreesPerRadian, "deg");
  out += row("rotation about its y", m.rotation[1], kDegreesPerRadian, "deg");
  out += row("rotation about its z", m.rotation[2], kDegreesPerRadian, "deg");
  out += row("lever arm along x", m.lever_arm[0], 1, "m");
  out += row("lever arm along y", m.lever_arm[1], 1, "m");
  out += row("lever arm along z", m.lever_arm[2], 1, "m");
  out += row("reference's stamps are late by", m.clock_offset, 1e3, "ms (reported, not applied)");
  if (const auto b = boresight_deg(found))
    out += fmt::format("  for the configuration: ins.boresight_deg: [{:.2f}, {:.2f}, {:.2f}]\n",
                       (*b)[0], (*b)[1], (*b)[2]);
  return out + "\n";
}

void warn(const std::string& message) {
  if (!message.empty()) std::cerr << "vergence: " << harmless(message) << '\n';
}

TrajectoryFile read(const fs::path& path, std::optional<TimeUnit> unit,
                    std::optional<QuaternionOrder> quaternion, std::string_view unit_option) {
  TrajectoryFile file = read_trajectory_file(path, {unit, quaternion, unit_option});
  if (!file.remarks.empty())
    warn(fmt::format("{}: {}", path.string(), fmt::join(file.remarks, "; ")));
  return file;
}

Duration usual_interval(const Trajectory& poses) {
  std::vector<std::int64_t> ns;
  for (std::size_t i = 1; i < poses.size(); ++i)
    ns.push_back(poses[i].stamp.ns() / 2 - poses[i - 1].stamp.ns() / 2);
  if (ns.empty()) return {};
  return Duration::nanoseconds(
      2 * std::min(median(std::span(ns)), std::numeric_limits<std::int64_t>::max() / 2));
}

/// Stamps of 0 s, 1 s, 2 s … are most often numbers of frames.
bool counts_frames(const Trajectory& poses) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (poses[i].stamp.ns() != poses[0].stamp.ns() + static_cast<std::int64_t>(i) * kSecond ||
        poses[0].stamp.ns() % kSecond != 0 || std::abs(poses[0].stamp.ns()) > kSecond)
      return false;
  return poses.size() > 1;
}

/// One call of `vergence evaluate`.
class Evaluation {
 public:
  explicit Evaluation(const EvaluationRequest& request) : a_(request), options_(request.options) {
    find_reference();
    estimate_ = read(a_.estimate, a_.units[0], a_.quaternions[0], "--time-unit s, ms, us or ns");
    if (!is_ins_) reference_ = read_reference();
    pair_rows();
    bring_reference();
  }

  ExitCode run() {
    if (a_.estimate_ins_extrinsics && found_.status != MountStatus::ok) return report_no_mount();
    TrajectoryEvaluation evaluation = evaluate(estimate_.poses, reference_.poses, options_);
    if (a_.usual_lengths) keep_longest(&evaluation);
    print(evaluation);
    const Duration interval = usual_interval(reference_.poses);
    if (evaluation.status == EvaluationStatus::ok) {
      warn(gap_remark(evaluation, options_, interval));
      warn(rotation_remark(evaluation));
      return ExitCode::done;
    }
    warn(a_.estimate.string() + " against " + path_.string() + ": " +
         evaluation_problem(evaluation, options_, interval));
    if (const bool counts = counts_frames(estimate_.poses);
        counts != counts_frames(reference_.poses))
      warn((counts ? a_.estimate : path_).string() +
           ": its first column has frame numbers instead of times; write the times of the frames "
           "there");
    return ExitCode::not_usable;
  }

 private:
  void find_reference() {
    if (a_.reference.empty() && !a_.estimate_ins_extrinsics)
      throw InputError(
          "REFERENCE is missing; pass a trajectory file, or with --estimate-ins-extrinsics a "
          "session directory with ins.csv");
    // A session folder stands for its poses, but where a mount is asked for: that is the INS's.
    path_ = a_.reference.empty() ? a_.estimate : a_.reference;
    std::error_code ignored;
    const bool poses = !a_.estimate_ins_extrinsics && fs::is_directory(path_, ignored);
    const fs::path ins = poses ? fs::path{} : find_ins_file(path_);
    is_ins_ = !ins.empty();
    if (is_ins_)
      path_ = ins;
    else if (a_.reference.empty())
      throw InputError(a_.estimate.string() +
                       ": is not a session directory with ins.csv; pass a REFERENCE");
  }
  /// A single stamp unit applies to the estimate, and to the reference if its own is not known.
  [[nodiscard]] TrajectoryFile read_reference() const {
    constexpr std::string_view kOption =
        "--time-unit ,s (or ,ms ,us ,ns: the reference's follows the comma)";
    if (a_.units[1] || !a_.units[0]) return read(path_, a_.units[1], a_.quaternions[1], kOption);
    try {
      return read(path_, std::nullopt, a_.quaternions[1], kOption);
    } catch (const InputError&) {
      return read(path_, a_.units[0], a_.quaternions[1], kOption);
    }
  }
  /// Rows of a file without times belong to the rows of the other one, with its times if it has
  /// some.
  void pair_rows() {
    TrajectoryFile &e = estimate_, &r = reference_;
    if (e.timed && (r.timed || is_ins_)) return;
    const std::string help = "put the sequence's times.txt next to it";
    if (is_ins_) throw InputError(a_.estimate.string() + ": has no times; " + help);
    if (e.rows != r.rows)
      throw InputError(
          "{}: has {} poses and {} has {}: {}, so poses are matched row by row and both files need "
          "the same number of rows; {}",
          a_.estimate.string(), e.rows, path_.string(), r.rows,
          e.timed   ? "the reference has no times"
          : r.timed ? "the estimate has no times"
                    : "neither has times",
          help);
    warn(std::string(e.timed == r.timed ? "neither file has times"
                                        : "one of the files has no times") +
         ": poses are matched row by row");
    if (e.timed == r.timed) return;
    TrajectoryFile& without = e.timed ? r : e;
    const TrajectoryFile& with = e.timed ? e : r;
    if (without.poses.size() != with.poses.size())
      throw InputError(
          "one file has no times, and rows with NaN are skipped in one of the files; " + help);
    for (std::size_t i = 0; i < with.poses.size(); ++i)
      without.poses[i].stamp = with.poses[i].stamp;
  }
  /// Brings the reference to the estimate's body. Stamps stay: a clock offset is reported, not
  /// applied.
  void bring_reference() {
    Transform T_ref_est;
    if (is_ins_) {
      const std::vector<MountReference> moments = ins_moments(read_ins_file(path_));
      if (moments.empty())
        throw InputError(
            path_.string() +
            ": has no sample with an attitude and a satellite fix; record the INS with both");
      for (const MountReference& m : moments) reference_.poses.push_back({m.stamp, m.T_enu_ref});
      // With axes other than the camera's both bodies are forward, left, up.
      if (a_.estimate_ins_extrinsics)
        found_ = find_ins_mount(estimate_.poses, moments);
      else if (options_.axes == BodyAxes::camera)
        T_ref_est = known_.emplace(load_ins_mount(a_.estimate, path_)).T_ins_left;
    } else if (a_.estimate_ins_extrinsics) {
      found_ = find_mount(estimate_.poses, reference_.poses);
    }
    if (found_.status == MountStatus::ok) T_ref_est = found_.mount.T_ref_est;
    for (StampedPose& pose : reference_.poses) pose.T_world_body = pose.T_world_body * T_ref_est;
  }
  /// Keeps the longest of the usual lengths that fit the path; the shortest if none fits.
  void keep_longest(TrajectoryEvaluation* e) {
    if (e->segments.size() < 2) return;
    std::size_t kept = 0;
    for (std::size_t i = e->segments.size(); i-- > 0;)
      if (e->segments[i].count > 0) kept = i;
    e->segments = {e->segments[kept]};
    options_.segments = {options_.segments[kept]};
  }
  /// Without a mount nothing can be compared.
  [[nodiscard]] ExitCode report_no_mount() const {
    if (a_.json) std::cout << Json{{"mount", mount_json(found_)}}.dump(1) << '\n';
    std::cerr << "vergence: no INS extrinsics between " << a_.estimate.string() << " and "
              << path_.string() << ": " << mount_problem(found_.status) << '\n';
    return ExitCode::not_usable;
  }
  /// Returns the advice where positions agree and rotations do not; empty if both agree.
  [[nodiscard]] std::string rotation_remark(const TrajectoryEvaluation& e) const {
    constexpr double kRotationsDiffer = 20 * kRadiansPerDegree;
    // Relative to the path length.
    constexpr double kPositionsAgree = 0.05;
    if (e.se3.roll_unobservable || e.ate_se3.rmse >= kPositionsAgree * e.path_reference ||
        e.rotation_se3.median <= kRotationsDiffer)
      return "";
    const auto other = [](const TrajectoryFile& file) {
      return file.order == QuaternionOrder::xyzw ? "wxyz" : "xyzw";
    };
    return fmt::format(
        "positions agree, but rotations differ by {:.0f}° (median); check the order of the "
        "quaternions (--quaternion {}, for the reference --quaternion ,{}), that rotations are "
        "from body to world, and the axes of both bodies (--estimate-ins-extrinsics estimates a "
        "constant rotation)",
        e.rotation_se3.median * kDegreesPerRadian, other(estimate_), other(reference_));
  }
  void print(const TrajectoryEvaluation& evaluation) const {
    if (a_.json) {
      Json out = evaluation_json(evaluation, options_);
      if (a_.estimate_ins_extrinsics) out["mount"] = mount_json(found_);
      if (known_) out["ins_mount"] = ins_mount_json(known_->T_ins_left, known_->source);
      std::cout << out.dump(1) << '\n';
      return;
    }
    if (a_.estimate_ins_extrinsics) std::cout << mount_text(found_);
    if (known_) std::cout << ins_mount_text(*known_) << '\n';
    std::cout << evaluation_text(evaluation, options_);
  }

  const EvaluationRequest& a_;
  EvaluationOptions options_;
  // File of the reference.
  fs::path path_;
  // True if it contains INS samples, false if it contains poses.
  bool is_ins_ = false;
  TrajectoryFile estimate_{}, reference_{};
  // Extrinsics if they are to be estimated, and those of INS samples if they are not.
  FoundMount found_{};
  std::optional<InsMount> known_{};
};

}  // namespace

ExitCode run_evaluation(const EvaluationRequest& request) { return Evaluation(request).run(); }

}  // namespace vergence::app
