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
#include "app/runtime/thread_runner.hpp"
#include "core/calibration/stretches.hpp"
#include "core/comparison/trajectory_metrics.hpp"
#include "core/estimator/estimator.hpp"
#include "core/math/so3.hpp"
#include "tests/support/rendered_drive.hpp"
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
  const std::size_t at = d.sequence.pairs.size() / 2;
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

void print_stretches(const std::string& name, const std::vector<calibration::RigSolution>& stretches) {
  fmt::print("{}: {} stretches of some {} frames\n", name, stretches.size(), stretches.empty() ? 0 : stretches.front().frames);
  calibration::Agreement mean;
  std::size_t n = 0;
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    const calibration::RigSolution& s = stretches[i];
    const Vec3 phi = 1e3 * log_so3(s.rig.T_camera_left[1].R), t = 1e3 * s.rig.T_camera_left[1].t;
    const auto& sigma = s.rig.sigma_noise[1];
    fmt::print("  rotation {:8.3f} ({:.3f}) {:8.3f} ({:.3f}) {:8.3f} ({:.3f}) mrad  t_y {:7.3f} ({:.3f}) t_z {:7.3f} ({:.3f}) mm", phi.x(),
               1e3 * sigma[0], phi.y(), 1e3 * sigma[1], phi.z(), 1e3 * sigma[2], t.y(), 1e3 * sigma[4], t.z(), 1e3 * sigma[5]);
    fmt::print("  cx {:.2f} ({:.2f}) cy {:.2f} ({:.2f}) px  {:.0f} ms, inflation {:.1f}\n", s.rig.intrinsics[1].cx,
               s.rig.intrinsics[1].sigma[2], s.rig.intrinsics[1].cy, s.rig.intrinsics[1].sigma[3], s.solve_ms, s.rig.inflation);
    if (i == 0) continue;
    const calibration::Agreement a = calibration::agreement(stretches[i - 1].rig, s.rig, 1);
    ++n;
    mean.transform += a.transform;
    mean.intrinsics += a.intrinsics;
    for (std::size_t k = 0; k < a.depth.size(); ++k) mean.depth[k] += a.depth[k], mean.depth_percent[k] += a.depth_percent[k];
  }
  if (n == 0) return;
  const auto by = static_cast<double>(n);
  fmt::print("  NEES a dimension: transform {:.2f}, intrinsics {:.2f}, depth", mean.transform / by, mean.intrinsics / by);
  for (std::size_t k = 0; k < mean.depth.size(); ++k)
    fmt::print(" {:g} m {:.2f} ({:.2f} %)", calibration::Agreement::depth_m[k], mean.depth[k] / by, mean.depth_percent[k] / by);
  fmt::print("\n");
  std::fflush(stdout);
}

/// The paper's rig on the mock's streets, its true calibration in use.
void rendered_stretches(const app::Configuration& c) {
  constexpr std::uint64_t kFrames = 240;
  constexpr std::size_t kStretch = 40;
  test::RenderedDriveOptions o;
  o.from_s = 20;
  test::RenderedDrive rendered(o);
  EstimatorOptions options;
  options.odometry = c.odometry;
  options.calibration = c.calibration;
  options.monitor = c.monitor;
  const auto features = static_cast<std::size_t>(c.odometry.features);
  Arena arena(Estimator::memory_needed(options, o.rig) + calibration::Stretches::memory_needed(c.calibration, c.monitor, 2, features));
  app::ThreadRunner two;
  ImmediateRunner solver;
  Estimator estimator(options, o.rig, o.rig, arena, two, solver);
  calibration::Stretches alone(calibration::Stretches::Kind::alone, o.rig, o.rig, kStretch, c.calibration, c.monitor, features, arena);
  std::vector<calibration::RigSolution> stretches;
  for (std::uint64_t i = 0; i < kFrames; ++i) {
    (void)estimator.process(rendered.frame(i));
    const auto solved = alone.take(estimator.tracks());
    if (solved && solved->status == calibration::RigSolveStatus::ok) stretches.push_back(*solved);
  }
  print_stretches("mock", stretches);
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

int run_learning(const std::vector<std::string>& set, int times) {
  const app::Configuration c = app::load_configuration(std::nullopt, set);
  const auto d = open_drive("kitti00_151", false);
  if (!d) {
    fmt::print(stderr, "calibration_bench: no recorded drives; set VERGENCE_SHARED to the folder that holds data/\n");
    return 2;
  }
  // To and fro over the same road: the speed changes its sign at the ends, the rig stays what it is.
  StereoSequence s = d->sequence;
  const std::size_t n = d->sequence.pairs.size();
  const Duration step = d->sequence.pairs[1].stamp - d->sequence.pairs[0].stamp;
  s.pairs.clear();
  for (int time = 0; time < times; ++time)
    for (std::size_t i = time == 0 ? 0 : 1; i < n; ++i) {
      app::StereoPair pair = d->sequence.pairs[time % 2 == 0 ? i : n - 1 - i];
      pair.stamp = s.pairs.empty() ? d->sequence.pairs[0].stamp : s.pairs.back().stamp + step;
      s.pairs.push_back(pair);
    }
  StartingCalibration scratch = app::replayed_calibration(c, s, false);
  app::apply_use({.length_only = true}, &scratch.file.rig);
  scratch.trust = CalibrationTrust::none;
  int knocks = 0;
  const auto rig = app::drive_once({s, c, 0, s.pairs.size(), {}, {}}, scratch, [&](const Estimator& e, const PoseSample& sample) {
    for (const EstimatorEvent& event : e.events()) knocks += event.kind == EstimatorEvent::Kind::rig_changed ? 1 : 0;
    for (const CalibrationDecision& decision : e.calibrations()) {
      const RigCalibration& r = decision.calibration;
      const Vec3 phi = 1e3 * log_so3(r.T_camera_left[1].R), t = 1e3 * r.T_camera_left[1].t;
      fmt::print(
          "frame {:5d} {:8s} {:4d} frames  yaw {:.3f} ({:.3f}) mrad  t_y {:.2f} t_z {:.2f} mm  cx {:.2f} ({:.2f})  depth ± {:.2f} %  held "
          "out {:.4f} px  {:.0f} ms\n",
          sample.frame,
          decision.accepted ? "adopted"
          : decision.learnt ? "kept"
                            : "rejected",
          r.frames, phi.y(), 1e3 * r.sigma_noise[1][1], t.y(), t.z(), r.intrinsics[1].cx, r.intrinsics[1].sigma[2],
          decision.depth_sigma_percent, decision.held_out_after_px, decision.solve_ms);
      std::fflush(stdout);
    }
  });
  fmt::print("{} knocks told\n", knocks);
  if (!rig) return 1;
  StartingCalibration learnt = app::replayed_calibration(c, d->sequence, false);
  learnt.file.rig = *rig;
  print(d->name, "with what was learnt", drive(*d, d->sequence, c, learnt));
  return 0;
}

int run_stretches(const std::vector<std::string>& set, const std::string& only) {
  const int recorded = for_drives(set, only, [](const Drive& d, const app::Configuration& c) {
    const StartingCalibration given = app::replayed_calibration(c, d.sequence, false);
    const app::DriveCalibration found = app::calibrate_drive({d.sequence, c, 0, d.sequence.pairs.size(), {}, {}}, given);
    print_stretches(d.name, found.stretches);
  });
  if (only.empty() || only == "mock") {
    rendered_stretches(app::load_configuration(std::nullopt, set));
    return 0;
  }
  return recorded;
}

}  // namespace vergence::bench
