#include "app/session/drive_calibration.hpp"

#include <iostream>
#include <iterator>
#include <numeric>

#include "app/datasets/frame_decoder.hpp"
#include "app/devices/camera_masks.hpp"
#include "core/calibration/gates.hpp"
#include "core/calibration/health.hpp"
#include "core/calibration/segment_solver.hpp"
#include "core/math/angle.hpp"

namespace vergence::app {
namespace {

// Depth in metres at which independent solutions are compared.
constexpr double kComparedDepth = 20;
// Limits of a calibration pass, which need not keep up with the frame rate.
constexpr int kMoreFeatures = 2, kMaxFeatures = 1000;
// Maximum number of observations in a background solve.
constexpr int kObservations = 240'000;
// Approximate maximum length of an independently solved segment, so that short sequences also have
// two.
constexpr std::size_t kAloneFrames = 40;

calibration::AcceptanceInput make_gate_input(const calibration::RigSolution& s,
                                             const StartingCalibration& given,
                                             const Configuration& c) {
  return {.solution = &s,
          .nominal = &given.nominal,
          .pixel_sigma = c.odometry.pixel_sigma,
          .must_be_better = false};
}

/// As many frames as make the drive's stretches equally long, at most `most`.
std::size_t stretch_length(std::uint64_t frames, std::size_t most) {
  const std::size_t n =
      std::max<std::size_t>(1, (static_cast<std::size_t>(frames) + most - 1) / most);
  return (static_cast<std::size_t>(frames) + n - 1) / n;
}

}  // namespace

std::optional<RigCalibration> drive_once(const DrivePass& pass, const StartingCalibration& begin,
                                         const DriveWatcher& watch) {
  const RigCalibration& rig = begin.file.rig;
  const int width = rig.intrinsics[0].width, height = rig.intrinsics[0].height;
  const CameraMasks masks(pass.configuration, rig);
  const EstimatorOptions options = estimator_options(pass.configuration, begin.trust,
                                                     Adoption::after_fixed_frames, masks.views());
  Arena frames_arena;
  Arena estimator_arena;
  FramePool pool(width, height, FrameDecoder::kSlots, frames_arena);
  const std::unique_ptr<PairRunner> runner = make_runner(pass.configuration.threads);
  BackgroundThread solver;
  Estimator estimator(options, rig, begin.nominal, estimator_arena, *runner, solver);
  FrameDecoder decoder(pass.sequence, pass.start, pass.count, pool);
  std::size_t done = 0;
  bool stopped = false;
  for (DecodedPair pair; decoder.next(&pair);) {
    if (pair.decoded) {
      RigFrame frame{.number = pair.frame, .stamp = pair.stamp, .cameras = 2};
      for (std::size_t k = 0; k < 2; ++k) frame.images[k] = pool.view(pair.slots[k]);
      const PoseSample sample = estimator.process(frame);
      if (watch) watch(estimator, sample);
      decoder.release(pair);
    }
    if (pass.progress && !pass.progress(++done)) {
      decoder.stop();
      stopped = true;
    }
  }
  estimator.finish();
  if (stopped || !estimator.calibrated()) return std::nullopt;
  return estimator.calibration();
}

DriveCalibration calibrate_drive(const DrivePass& drive, const StartingCalibration& given) {
  using calibration::SegmentSolver;
  DriveCalibration result;
  Configuration c = drive.configuration;
  c.odometry.features =
      std::max(c.odometry.features, std::min(kMoreFeatures * c.odometry.features, kMaxFeatures));
  c.calibration.max_observations = std::max(c.calibration.max_observations, kObservations);
  c.online = 1;
  const DrivePass pass{drive.sequence, c, drive.start, drive.count, drive.progress};
  StartingCalibration blank = given;
  apply_use({.length_only = true}, &blank.file.rig);
  blank.trust = CalibrationTrust::none;
  std::uint64_t newest = 0;
  const auto first = drive_once(pass, blank, [&](const Estimator& e, const PoseSample& /*sample*/) {
    const calibration::TrackLog& tracks = e.tracks();
    if (tracks.empty() || tracks.frame(tracks.size() - 1).number <= newest) return;
    newest = tracks.frame(tracks.size() - 1).number;
    ++result.frames;
  });
  result.why =
      "none was found; replay with --from-scratch, and see the reasons in calibrations.csv";
  if (!first) return result;
  StartingCalibration found = given;
  found.file.rig = *first;
  found.trust = CalibrationTrust::given;

  const auto features = static_cast<std::size_t>(c.odometry.features);
  Arena arena;
  SegmentSolver joined(
      SegmentSolver::Kind::joined, blank.file.rig, *first,
      stretch_length(result.frames, static_cast<std::size_t>(c.calibration.max_frames)),
      c.calibration, c.monitor, features, arena);
  SegmentSolver alone(SegmentSolver::Kind::alone, blank.file.rig, *first,
                      stretch_length(result.frames, kAloneFrames), c.calibration, c.monitor,
                      features, arena);
  std::optional<calibration::RigSolution> last;
  const auto keep = [&](const std::optional<calibration::RigSolution>& s) {
    if (!s) return;
    const calibration::Gate gate =
        calibration::check_acceptance(make_gate_input(*s, given, c), c.calibration);
    if (gate == calibration::Gate::open)
      last = s;
    else
      result.why = calibration::reason(gate);
  };
  const auto keep_solution = [&](const std::optional<calibration::RigSolution>& s) {
    if (s && s->status == calibration::RigSolveStatus::ok) result.stretches.push_back(*s);
  };
  const auto second =
      drive_once(pass, found, [&](const Estimator& e, const PoseSample& /*sample*/) {
        keep(joined.add(e.tracks()));
        keep_solution(alone.add(e.tracks()));
      });
  if (!second) return result;
  keep(joined.end());
  keep_solution(alone.end());
  for (std::size_t i = 1; i < result.stretches.size(); ++i) {
    const RigCalibration &a = result.stretches[i - 1].rig, &b = result.stretches[i].rig;
    result.agreements.push_back(calibration::agreement(a, b, 1));
    result.depth_differences.push_back(calibration::depth_error_percent(a, b, 1, kComparedDepth));
  }
  if (!last) return result;
  result.rig = last->rig;
  result.why.clear();
  for (int k = 1; k < result.rig->cameras; ++k) {
    const double depth =
        calibration::reference_depth_m(*result.rig, k, c.calibration, c.odometry.pixel_sigma);
    const double sigma = calibration::depth_error_percent(*result.rig, k, depth);
    if (sigma <= result.depth_sigma_percent) continue;
    result.depth_m = depth;
    result.depth_sigma_percent = sigma;
  }
  result.verified = result.depth_sigma_percent <= c.calibration.max_depth_error_percent;
  return result;
}

DriveCalibration calibrate_with_progress(const DrivePass& pass, const StartingCalibration& given,
                                         const SignalGuard& signals, Progress* progress) {
  constexpr std::size_t kPasses = 2;
  std::size_t before = 0, last = 0;
  DrivePass watched = pass;
  watched.progress = [&](std::size_t done) {
    // A smaller count means that the next pass has begun.
    if (done < last) before += last;
    last = done;
    progress->update({.state = "calibrating from the sequence",
                      .frame = before + done,
                      .frames = kPasses * pass.count});
    return !signals.stop_requested();
  };
  DriveCalibration found = calibrate_drive(watched, given);
  if (!found.rig && signals.stop_requested()) found.why = "interrupted";
  progress->finish();
  return found;
}

std::string describe(const DriveCalibration& found) {
  std::string text;
  const auto out = std::back_inserter(text);
  const RigCalibration& rig = *found.rig;
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k) {
    const Intrinsics& lens = rig.intrinsics[k];
    fmt::format_to(out,
                   "camera {}  fx {:.3f} ± {:.3f}  fy {:.3f} ± {:.3f}  cx {:.3f} ± {:.3f}  cy "
                   "{:.3f} ± {:.3f} px\n",
                   k, lens.fx, lens.sigma[0], lens.fy, lens.sigma[1], lens.cx, lens.sigma[2],
                   lens.cy, lens.sigma[3]);
    fmt::format_to(out, "          distortion");
    for (std::size_t i = 0; i < 4; ++i)
      fmt::format_to(out, " {:.5f} ± {:.5f}", lens.distortion[i], lens.distortion_sigma[i]);
    text += '\n';
    if (k == 0) continue;
    const Vec3 turn = log_so3(rig.T_camera_left[k].R) * kDegreesPerRadian;
    const Vec3& t = rig.T_camera_left[k].t;
    const auto& sigma = rig.sigma_total[k];
    fmt::format_to(out,
                   "          rotation {:.4f} ± {:.4f}, {:.4f} ± {:.4f}, {:.4f} ± {:.4f} deg\n",
                   turn.x(), sigma[0] * kDegreesPerRadian, turn.y(), sigma[1] * kDegreesPerRadian,
                   turn.z(), sigma[2] * kDegreesPerRadian);
    fmt::format_to(out, "          t {:.3f} ± {:.3f}, {:.3f} ± {:.3f}, {:.3f} ± {:.3f} mm\n",
                   1e3 * t.x(), 1e3 * sigma[3], 1e3 * t.y(), 1e3 * sigma[4], 1e3 * t.z(),
                   1e3 * sigma[5]);
  }
  fmt::format_to(out, "depth sigma at {:.1f} m: {:.2f} % (1 sigma), from {} moving frames\n",
                 found.depth_m, found.depth_sigma_percent, rig.frames);
  if (found.agreements.empty()) return text;
  const auto& all = found.agreements;
  const double mean =
      std::accumulate(all.begin(), all.end(), 0.0) / static_cast<double>(all.size());
  fmt::format_to(out,
                 "{} segments solved independently: transforms differ by {:.1f} sigma, depths at "
                 "{:g} m by at most {:.2f} %\n",
                 found.stretches.size(), std::sqrt(mean), kComparedDepth,
                 std::ranges::max(found.depth_differences));
  return text;
}

ExitCode calibrate_from_drive(ReplayRequest r, const std::filesystem::path& out) {
  const Configuration& c = r.configuration;
  // Only intrinsics and baseline length are read: how its cameras sit need not be known.
  r.from_scratch = true;
  const StereoSequence sequence = open_drive(r);
  check_image_sizes(sequence, 0, sequence.pairs.size());
  const StartingCalibration given = replayed_calibration(c, sequence, true);
  const SignalGuard signals;
  Progress progress = Progress::on_stderr(r.session.quiet);
  for (const std::string& message : sequence.remarks) progress.print("vergence: " + message);
  if (!sequence.assumptions.empty())
    progress.print("vergence: assumed: {}", fmt::join(sequence.assumptions, "; "));
  const DriveCalibration found =
      calibrate_with_progress({sequence, c, 0, sequence.pairs.size()}, given, signals, &progress);
  if (!found.rig) {
    progress.print("vergence: {}: no calibration was found, no file is written: {}",
                   r.data.string(), found.why);
    return signals.stop_code().value_or(ExitCode::not_usable);
  }
  CalibrationFile written = given.file;
  written.rig = *found.rig;
  written.source = "drive";
  write_calibration(out, written);
  std::cout << describe(found);
  if (!found.verified)
    progress.print(
        "vergence: the depth is not known well enough: use a longer sequence with turns and near "
        "objects");
  progress.print(out.string() + ": written");
  return found.verified ? ExitCode::done : ExitCode::not_usable;
}

}  // namespace vergence::app
