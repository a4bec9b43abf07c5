#include "tests/support/recorded_sequence.hpp"

#include <numbers>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "app/session/drive_calibration.hpp"
#include "app/session/summary.hpp"
#include "core/estimator/estimator.hpp"
#include "core/math/so3.hpp"
#include "tests/support/shared_data.hpp"

namespace vergence::test {

using app::StartingCalibration;
using app::StereoSequence;

namespace {

/// The sequence with its right images from a frame on replaced by what `change` makes of them.
StereoSequence with_right_changed(const RecordedSequence& drive, std::size_t from,
                                  const std::filesystem::path& folder,
                                  const std::function<cv::Mat(const cv::Mat&)>& change) {
  StereoSequence s = drive.sequence;
  std::filesystem::create_directories(folder);
  for (std::size_t i = from; i < s.pairs.size(); ++i) {
    const cv::Mat image = cv::imread((s.root / s.pairs[i].file[1]).string(), cv::IMREAD_GRAYSCALE);
    const std::filesystem::path file = folder / fmt::format("{:06d}.png", i);
    cv::imwrite(file.string(), change(image), {cv::IMWRITE_PNG_COMPRESSION, 1});
    s.pairs[i].file[1] = file.string();
  }
  return s;
}

}  // namespace

std::optional<RecordedSequence> open_recorded(const std::string& name) {
  const auto folder = shared_data("data/" + name);
  if (!folder) return std::nullopt;
  RecordedSequence d{name, app::open_sequence(app::find_format(*folder).value(), *folder), {}};
  if (app::find_truth(*folder)) d.truth = app::read_trajectory_file(*folder).poses;
  return d;
}

bool for_recorded(std::span<const char* const> drives, const std::string& only,
                  const std::function<void(RecordedSequence*)>& each) {
  bool any = false;
  for (const char* name : drives) {
    if (only != "all" && only != name) continue;
    auto drive = open_recorded(name);
    if (drive)
      each(&*drive);
    else
      fmt::print(stderr, "{}: VERGENCE_SHARED has no such data\n", name);
    any = any || drive;
  }
  return any;
}

StereoSequence with_right_turned(const RecordedSequence& drive, const Vec3& degrees,
                                 std::size_t from, const std::filesystem::path& folder) {
  const Intrinsics& lens = drive.sequence.calibration.intrinsics[1];
  Mat3 K;
  K << lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1;
  const Mat3 H = K * exp_so3(degrees * std::numbers::pi / 180) * K.inverse();
  cv::Mat h(3, 3, CV_64F);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) h.at<double>(r, c) = H(r, c);
  return with_right_changed(drive, from, folder, [&](const cv::Mat& image) {
    cv::Mat out;
    cv::warpPerspective(image, out, h, image.size(), cv::INTER_CUBIC, cv::BORDER_CONSTANT);
    return out;
  });
}

StereoSequence with_right_mirrored(const RecordedSequence& drive,
                                   const std::filesystem::path& folder) {
  return with_right_changed(drive, 0, folder, [](const cv::Mat& image) {
    cv::Mat out;
    cv::flip(image, out, 1);
    return out;
  });
}

StartingCalibration blank(const StartingCalibration& given) {
  StartingCalibration scratch = given;
  app::apply_use({.length_only = true}, &scratch.file.rig);
  scratch.trust = CalibrationTrust::none;
  return scratch;
}

StartingCalibration with_focal_length(const StartingCalibration& given, double factor) {
  StartingCalibration other = given;
  for (RigCalibration* rig : {&other.file.rig, &other.nominal})
    for (Intrinsics& lens : rig->intrinsics) {
      lens.fx *= factor;
      lens.fy *= factor;
    }
  return other;
}

DriveOutcome drive_recorded(const RecordedSequence& d, const StereoSequence& sequence,
                            const app::Configuration& c, const StartingCalibration& begin,
                            std::size_t knock_at) {
  DriveOutcome row;
  std::vector<StampedPose> poses;
  const app::DrivePass pass{sequence, c, 0, sequence.pairs.size()};
  row.rig = app::drive_once(pass, begin, [&](const Estimator& e, const PoseSample& s) {
    const auto at = static_cast<int>(s.frame);
    const bool knocked = s.frame >= knock_at;
    ++row.frames;
    row.samples.push_back(s);
    if (s.status != PoseStatus::lost) poses.push_back({s.stamp, s.T_world_left});
    for (const EstimatorEvent& event : e.events()) {
      using Kind = EstimatorEvent::Kind;
      if (event.kind == Kind::rig_changed) {
        if (knocked && row.reported_at < 0) row.reported_at = at;
        if (!knocked) ++row.knocks;
      }
      if (event.kind == Kind::rig_not_rigid && !knocked) ++row.knocks;
      if (event.kind == Kind::calibration_applied)
        row.points_kept_percent = std::min(row.points_kept_percent, event.value);
      if (event.kind == Kind::calibration_verified && row.verified_at < 0) row.verified_at = at;
      if (event.kind == Kind::calibration_contradicted && row.contradicted_at < 0) {
        row.contradicted_at = at;
        row.contradicted_percent = event.value;
      }
    }
    for (const CalibrationDecision& decision : e.calibrations()) {
      if (decision.accepted && row.adopted++ == 0) row.adopted_at = at;
      if (knocked && row.reported_at >= 0 && decision.accepted && row.recalibrated_at < 0)
        row.recalibrated_at = at;
      if (decision.focal.measured_px > 0) row.focal = decision.focal;
      if (decision.held_out_after_px > 0) row.held_out_px = decision.held_out_after_px;
    }
    if (row.verified_at < 0 && s.status == PoseStatus::ok) ++row.ok_before_verified;
    if (knocked && row.recalibrated_at < 0 && s.status == PoseStatus::ok)
      ++row.ok_before_recalibrated;
    if (row.verified_at >= 0) ++row.since_verified;
    (s.status == PoseStatus::ok         ? row.ok
     : s.status == PoseStatus::degraded ? row.degraded
                                        : row.lost)++;
    if (row.verified_at >= 0 && s.status == PoseStatus::ok) ++row.ok_since_verified;
  });
  if (!d.truth.empty() && poses.size() > 3) {
    const TrajectoryEvaluation e = evaluate(poses, d.truth, app::summary_evaluation_options());
    if (e.status == EvaluationStatus::ok) {
      row.ate_m = e.ate_se3.rmse;
      row.ate_scaled_m = e.ate_sim3.rmse;
      row.scale = e.sim3.scale;
      if (e.segments[1].count > 0) row.segments_percent = 100 * e.segments[1].translation;
    }
  }
  return row;
}

}  // namespace vergence::test
