#include "app/commands/drive_calibration.hpp"

#include <algorithm>
#include <memory>

#include "app/commands/camera_masks.hpp"
#include "app/commands/session_files.hpp"
#include "app/datasets/frame_decoder.hpp"
#include "app/runtime/background_thread.hpp"
#include "core/calibration/gates.hpp"
#include "core/calibration/health.hpp"
#include "core/calibration/stretches.hpp"
#include "core/estimator/estimator.hpp"

namespace vergence::app {
namespace {

constexpr std::size_t kAloneFrames = 40;  // of a stretch by itself, at most about: short drives, too, are to have two

calibration::GateQuestion question_of(const calibration::RigSolution& s, const StartingCalibration& told, const Configuration& c) {
  calibration::GateQuestion q;
  q.solution = &s;
  q.nominal = &told.nominal;
  q.lenses = true;
  q.pixel_sigma = c.odometry.pixel_sigma;
  q.must_be_better = false;
  return q;
}

/// As many frames as make the drive's stretches equally long, at most `most`.
std::size_t stretch_length(std::uint64_t frames, std::size_t most) {
  const std::size_t n = std::max<std::size_t>(1, (static_cast<std::size_t>(frames) + most - 1) / most);
  return (static_cast<std::size_t>(frames) + n - 1) / n;
}

}  // namespace

std::optional<RigCalibration> drive_once(const DrivePass& pass, const StartingCalibration& begin, const DriveWatcher& watch) {
  const RigCalibration& rig = begin.file.rig;
  const int width = rig.intrinsics[0].width, height = rig.intrinsics[0].height;
  const CameraMasks masks(pass.configuration, rig);
  const EstimatorOptions options = estimator_options(pass.configuration, begin.trust, Adoption::after_fixed_frames, masks.views());
  Arena frames_arena(arena_size(FramePool::memory_needed(width, height, FrameDecoder::kSlots)));
  Arena estimator_arena(arena_size(Estimator::memory_needed(options, rig)));
  FramePool pool(width, height, FrameDecoder::kSlots, frames_arena);
  const std::unique_ptr<PairRunner> runner = make_runner(pass.configuration.threads);
  BackgroundThread solver;
  Estimator estimator(options, rig, begin.nominal, estimator_arena, *runner, solver);
  FrameDecoder decoder(pass.sequence, pass.start, pass.count, pool);
  std::size_t done = 0;
  for (DecodedPair pair; decoder.next(&pair);) {
    if (pair.decoded) {
      RigFrame frame;
      frame.number = pair.frame;
      frame.stamp = pair.stamp;
      frame.cameras = 2;
      for (std::size_t k = 0; k < 2; ++k) frame.images[k] = pool.view(pair.slots[k]);
      const PoseSample sample = estimator.process(frame);
      if (watch) watch(estimator, sample);
      decoder.release(pair);
    }
    if (pass.progress) pass.progress(++done);
    if (pass.stopped && pass.stopped()) decoder.stop();
  }
  estimator.finish();
  if (!estimator.calibrated()) return std::nullopt;
  return estimator.calibration();
}

DriveCalibration calibrate_drive(const DrivePass& pass, const StartingCalibration& told) {
  using calibration::Stretches;
  DriveCalibration result;
  StartingCalibration blank = told;
  apply_use({.length_only = true}, &blank.file.rig);
  blank.trust = CalibrationTrust::none;
  std::uint64_t newest = 0;
  const auto first = drive_once(pass, blank, [&](const Estimator& e, const PoseSample& /*sample*/) {
    const calibration::TrackLog& tracks = e.tracks();
    if (tracks.empty() || tracks.frame(tracks.size() - 1).number <= newest) return;
    newest = tracks.frame(tracks.size() - 1).number;
    ++result.frames;
  });
  if (!first) {
    result.why = "from scratch no calibration was found: what the drive lacks, a replay with --from-scratch says";
    return result;
  }
  StartingCalibration found = told;
  found.file.rig = *first;
  found.trust = CalibrationTrust::given;

  const Configuration& c = pass.configuration;
  const auto features = static_cast<std::size_t>(c.odometry.features);
  Arena arena(arena_size(2 * Stretches::memory_needed(c.calibration, c.monitor, told.file.rig.cameras, features)));
  Stretches joined(Stretches::Kind::joined, blank.file.rig, *first,
                   stretch_length(result.frames, static_cast<std::size_t>(c.calibration.max_frames)), c.calibration, c.monitor, features,
                   arena);
  Stretches alone(Stretches::Kind::alone, blank.file.rig, *first, stretch_length(result.frames, kAloneFrames), c.calibration, c.monitor,
                  features, arena);
  std::optional<calibration::RigSolution> last;
  const auto keep = [&](const std::optional<calibration::RigSolution>& s) {
    if (!s) return;
    const calibration::Gate gate = calibration::ask_gates(question_of(*s, told, c), c.calibration);
    if (gate == calibration::Gate::open)
      last = s;
    else
      result.why = calibration::reason(gate);
  };
  const auto note = [&](const std::optional<calibration::RigSolution>& s) {
    if (s && s->status == calibration::RigSolveStatus::ok) result.stretches.push_back(*s);
  };
  (void)drive_once(pass, found, [&](const Estimator& e, const PoseSample& /*sample*/) {
    keep(joined.take(e.tracks()));
    note(alone.take(e.tracks()));
  });
  keep(joined.end());
  note(alone.end());
  for (std::size_t i = 1; i < result.stretches.size(); ++i)
    result.agreements.push_back(calibration::agreement(result.stretches[i - 1].rig, result.stretches[i].rig, 1));
  if (!last) return result;
  result.rig = last->rig;
  result.why.clear();
  for (int k = 1; k < result.rig->cameras; ++k) {
    const double depth = calibration::judged_depth_m(*result.rig, k, c.calibration, c.odometry.pixel_sigma);
    const double sigma = calibration::depth_error_percent(*result.rig, k, depth);
    if (sigma <= result.depth_sigma_percent) continue;
    result.depth_m = depth;
    result.depth_sigma_percent = sigma;
  }
  result.verified = result.depth_sigma_percent <= c.calibration.tolerated_depth_percent;
  return result;
}

}  // namespace vergence::app
