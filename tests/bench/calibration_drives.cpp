// Calibration on recorded drives: what comes of a nominal calibration, of a wrong one, of none; whether anything is told that was not
// there; and knocks made on real images by turning the right ones.
#include "tests/bench/calibration_drives.hpp"

#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>
#include <optional>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "app/commands/drive_calibration.hpp"
#include "app/datasets/trajectory_files.hpp"
#include "app/recorder/summary.hpp"
#include "core/comparison/trajectory_metrics.hpp"
#include "core/estimator/estimator.hpp"
#include "core/math/so3.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::bench {
namespace {

using app::StartingCalibration;
using app::StereoSequence;

struct Drive {
  std::string name;
  StereoSequence sequence;
  app::Trajectory truth;
};

std::optional<Drive> open_drive(const std::string& name, bool euroc) {
  const auto folder = test::shared_data("data/" + name);
  if (!folder) return std::nullopt;
  Drive d{name, app::open_sequence(euroc ? app::SequenceFormat::euroc : app::SequenceFormat::kitti, *folder), {}};
  const auto truth = app::find_truth(*folder);
  if (truth && truth->kind != app::TruthFiles::Kind::kitti) {
    d.truth = app::read_truth(*truth);
  } else if (truth) {
    std::vector<Stamp> times;
    for (const app::StereoPair& pair : d.sequence.pairs) times.push_back(pair.stamp);
    d.truth = app::read_kitti(truth->poses, times);
  }
  return d;
}

/// The right camera turned about its centre from a frame on: by a homography, which is exact for a lens without distortion.
StereoSequence turned(const Drive& drive, const Vec3& degrees, std::size_t from, const std::filesystem::path& folder) {
  StereoSequence s = drive.sequence;
  const Intrinsics& lens = s.calibration.intrinsics[1];
  Mat3 K;
  K << lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1;
  const Mat3 H = K * exp_so3(degrees * std::numbers::pi / 180) * K.inverse();
  cv::Mat h(3, 3, CV_64F);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) h.at<double>(r, c) = H(r, c);
  std::filesystem::create_directories(folder);
  for (std::size_t i = from; i < s.pairs.size(); ++i) {
    const cv::Mat image = cv::imread((s.root / s.pairs[i].file[1]).string(), cv::IMREAD_GRAYSCALE);
    cv::Mat out;
    cv::warpPerspective(image, out, h, image.size(), cv::INTER_CUBIC, cv::BORDER_CONSTANT);
    const std::filesystem::path file = folder / fmt::format("{:06d}.png", i);
    cv::imwrite(file.string(), out, {cv::IMWRITE_PNG_COMPRESSION, 1});
    s.pairs[i].file[1] = file.string();
  }
  return s;
}

/// One pass and what came of it.
struct Row {
  int frames = 0, ok = 0, degraded = 0, lost = 0, knocks = 0, ok_since_verified = 0, since_verified = 0;
  int verified_at = -1, contradicted_at = -1, told_at = -1, mended_at = -1, ok_before_mended = 0;
  double contradicted_percent = 0, ate = 0, scale = 1, segments = -1;
  std::optional<RigCalibration> rig;
};

Row drive(const Drive& d, const StereoSequence& sequence, const app::Configuration& c, const StartingCalibration& begin,
          std::size_t knock_at = ~std::size_t{0}) {
  Row row;
  std::vector<StampedPose> poses;
  const app::DrivePass pass{sequence, c, 0, sequence.pairs.size(), {}, {}};
  row.rig = app::drive_once(pass, begin, [&](const Estimator& e, const PoseSample& s) {
    const auto at = static_cast<int>(s.frame);
    const bool knocked = s.frame >= knock_at;
    ++row.frames;
    if (s.status != PoseStatus::lost) poses.push_back({s.stamp, s.T_world_left});
    for (const EstimatorEvent& event : e.events()) {
      using Kind = EstimatorEvent::Kind;
      if (event.kind == Kind::rig_changed) {
        if (knocked && row.told_at < 0) row.told_at = at;
        if (!knocked) ++row.knocks;
      }
      if (event.kind == Kind::calibration_confirmed && row.verified_at < 0) row.verified_at = at;
      if (event.kind == Kind::calibration_contradicted && row.contradicted_at < 0) {
        row.contradicted_at = at;
        row.contradicted_percent = event.value;
      }
    }
    for (const CalibrationDecision& decision : e.calibrations())
      if (knocked && row.told_at >= 0 && decision.accepted && row.mended_at < 0) row.mended_at = at;
    if (knocked && row.mended_at < 0 && s.status == PoseStatus::ok) ++row.ok_before_mended;
    if (row.verified_at >= 0) ++row.since_verified;
    (s.status == PoseStatus::ok ? row.ok : s.status == PoseStatus::degraded ? row.degraded : row.lost)++;
    if (row.verified_at >= 0 && s.status == PoseStatus::ok) ++row.ok_since_verified;
  });
  if (!d.truth.empty() && poses.size() > 3) {
    const TrajectoryEvaluation e = evaluate(poses, d.truth, app::summary_evaluation_options());
    if (e.status == EvaluationStatus::ok) {
      row.ate = e.ate_se3.rmse;
      row.scale = e.sim3.scale;
      if (e.segments[1].count > 0) row.segments = 100 * e.segments[1].translation;
    }
  }
  return row;
}

void print(const std::string& drive_name, const std::string& what, const Row& r) {
  fmt::print("{:12s} {:34s} seg {:6.3f} %  ATE {:7.4f} m  scale {:.4f}  ok {:3d} of {:3d}", drive_name, what, r.segments, r.ate, r.scale,
             r.ok, r.frames);
  fmt::print("  knocks told {}  verified at {:3d} ({:3.0f} % ok since)", r.knocks, r.verified_at,
             r.since_verified > 0 ? 100.0 * r.ok_since_verified / r.since_verified : 0.0);
  if (r.contradicted_at >= 0) fmt::print("  contradicted at {} by {:.1f} %", r.contradicted_at, r.contradicted_percent);
  if (r.told_at >= 0 || r.mended_at >= 0) fmt::print("  told at {} mended at {}", r.told_at, r.mended_at);
  fmt::print("\n");
  std::fflush(stdout);
}

void run_drive(const Drive& d, const app::Configuration& c) {
  const StartingCalibration given = app::replayed_calibration(c, d.sequence, false);
  StartingCalibration scratch = given;
  app::apply_use({.length_only = true}, &scratch.file.rig);
  scratch.trust = CalibrationTrust::none;
  print(d.name, "from scratch, one pass", drive(d, d.sequence, c, scratch));
  print(d.name, "own calibration, one pass", drive(d, d.sequence, c, given));
  const app::DriveCalibration found = app::calibrate_drive({d.sequence, c, 0, d.sequence.pairs.size(), {}, {}}, given);
  if (!found.rig) {
    fmt::print("{:12s} calibrate first: {}\n", d.name, found.why);
    return;
  }
  StartingCalibration first = given;
  first.file.rig = *found.rig;
  print(d.name, "calibrated first", drive(d, d.sequence, c, first));
  fmt::print("{:12s}   found from {} frames: depth at {:.1f} m known to {:.2f} %, rms {:.3f} px\n", d.name, found.rig->frames,
             found.depth_m, found.depth_sigma_percent, found.rig->reprojection_px);

  // Turned images are not the raw ones: a homography knows no distortion.
  if (d.sequence.calibration.intrinsics[1].has_distortion()) return;
  const test::TemporaryFolder folder;
  int index = 0;
  for (const Vec3& turn : {Vec3(0, 0.3, 0), Vec3(0.3, 0.2, 0.25)}) {
    const StereoSequence s = turned(d, turn, 0, folder / fmt::format("start{}", index++));
    const std::string words = fmt::format("turned ({:g}, {:g}, {:g}) deg", turn.x(), turn.y(), turn.z());
    const StartingCalibration wrong = app::replayed_calibration(c, s, false);
    print(d.name, words + ", one pass", drive(d, s, c, wrong));
    const app::DriveCalibration mended = app::calibrate_drive({s, c, 0, s.pairs.size(), {}, {}}, wrong);
    StartingCalibration then = wrong;
    if (mended.rig) then.file.rig = *mended.rig;
    print(d.name, words + ", first", drive(d, s, c, then));
  }
  const std::size_t at = d.sequence.pairs.size() / 2 + 20;
  if (d.sequence.pairs.size() < 100) return;
  for (const Vec3& turn : {Vec3(0.1, 0, 0), Vec3(0, 0, 0.2), Vec3(0, 0.3, 0), Vec3(2, 0, 0)}) {
    const StereoSequence s = turned(d, turn, at, folder / fmt::format("knock{}", index++));
    const Row r = drive(d, s, c, first, at);
    fmt::print("{:12s} knock at {} by ({:g}, {:g}, {:g}) deg: told after {}, mended after {}, {} ok before that, {} false before it\n",
               d.name, at, turn.x(), turn.y(), turn.z(), r.told_at < 0 ? -1 : r.told_at - static_cast<int>(at),
               r.mended_at < 0 ? -1 : r.mended_at - static_cast<int>(at), r.ok_before_mended, r.knocks);
    std::fflush(stdout);
  }
}

int for_drives(const std::vector<std::string>& set, const std::string& only,
               const std::function<void(const Drive&, const app::Configuration&)>& each) {
  const app::Configuration c = app::load_configuration(std::nullopt, set);
  int n = 0;
  for (const char* name : {"kitti06_51", "kitti01_51", "kitti00_151", "euroc_mh01"}) {
    if (!only.empty() && only != name) continue;
    if (const auto d = open_drive(name, std::string(name) == "euroc_mh01")) {
      each(*d, c);
      ++n;
    }
  }
  if (n > 0) return 0;
  fmt::print(stderr, "calibration_bench: no recorded drives; set VERGENCE_SHARED to the folder that holds data/\n");
  return 2;
}

}  // namespace

int run_drives(const std::vector<std::string>& set, const std::string& only) { return for_drives(set, only, run_drive); }

int run_stretches(const std::vector<std::string>& set, const std::string& only) {
  return for_drives(set, only, [](const Drive& d, const app::Configuration& c) {
    const StartingCalibration given = app::replayed_calibration(c, d.sequence, false);
    const app::DriveCalibration found = app::calibrate_drive({d.sequence, c, 0, d.sequence.pairs.size(), {}, {}}, given);
    fmt::print("{}: {} stretches of some {} frames\n", d.name, found.stretches.size(),
               found.stretches.empty() ? 0 : found.stretches.front().frames);
    for (const calibration::RigSolution& s : found.stretches) {
      const Vec3 phi = 1e3 * log_so3(s.rig.T_camera_left[1].R);
      const Vec3 t = 1e3 * s.rig.T_camera_left[1].t;
      const auto& n = s.rig.sigma_noise[1];
      fmt::print(
          "  rotation {:8.3f} ({:.3f}) {:8.3f} ({:.3f}) {:8.3f} ({:.3f}) mrad  t_y {:7.3f} ({:.3f}) t_z {:7.3f} ({:.3f}) mm  cx {:.2f} "
          "({:.2f}) cy {:.2f} ({:.2f}) px  {:.0f} ms inflation {:.1f} lag {:.4f}\n",
          phi.x(), 1e3 * n[0], phi.y(), 1e3 * n[1], phi.z(), 1e3 * n[2], t.y(), 1e3 * n[4], t.z(), 1e3 * n[5], s.rig.intrinsics[1].cx,
          s.rig.intrinsics[1].sigma[2], s.rig.intrinsics[1].cy, s.rig.intrinsics[1].sigma[3], s.solve_ms, s.rig.inflation, s.lag_frames);
    }
    double transform = 0, intrinsics = 0;
    std::array<double, calibration::Agreement::kDepths> depth{}, percent{};
    const double n = static_cast<double>(found.agreements.size());
    for (const calibration::Agreement& a : found.agreements) {
      transform += a.transform / n;
      intrinsics += a.intrinsics / n;
      for (std::size_t i = 0; i < depth.size(); ++i) depth[i] += a.depth[i] / n, percent[i] += a.depth_percent[i] / n;
    }
    fmt::print("  NEES a dimension: transform {:.2f}, intrinsics {:.2f}, depth", transform, intrinsics);
    for (std::size_t i = 0; i < depth.size(); ++i)
      fmt::print(" {:g} m {:.2f} ({:.2f} %)", calibration::Agreement::depth_m[i], depth[i], percent[i]);
    fmt::print("\n");
    std::fflush(stdout);
  });
}

}  // namespace vergence::bench
