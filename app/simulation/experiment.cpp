#include "app/simulation/experiment.hpp"

#include <chrono>
#include <fstream>
#include <iostream>

#include <nlohmann/json.hpp>

#include "app/runtime/progress.hpp"
#include "core/math/robust.hpp"

namespace vergence::app {
namespace {

// Sigma in m of the supplied length with `--length measured`.
constexpr double kMeasuredSigma = 1e-3;
// An RMS above this multiple of what the noise explains is a failed run.
constexpr double kFailedRatio = 1.2;
// Mean reprojection error in px of a failed run without noise.
constexpr double kFailedExact = 1e-6;

/// One figure of a level: of all runs that did not fail.
struct Statistic {
  std::vector<double> values{};

  void add(double v) { values.push_back(v); }
  [[nodiscard]] double mean() const {
    return values.empty()
               ? 0
               : Eigen::Map<const Eigen::ArrayXd>(values.data(), std::ssize(values)).mean();
  }
  [[nodiscard]] double median() const {
    std::vector<double> sorted = values;
    return sorted.empty() ? 0 : vergence::median(std::span(sorted));
  }
};

struct Level {
  double noise = 0;
  int runs = 0, failed = 0;
  Statistic reprojection_px{}, pose_m{}, rotation_rad{}, translation_m{}, ms{}, steps{};
};

/// Solves one problem and books what came out.
void run_once(BundleAdjuster& adjuster, const Experiment& a, const SimulationOptions& s,
              std::uint64_t run, Level* level) {
  // Each run has its own random stream, so the geometry is equal at every noise level.
  Random random(a.seed, run + 1);
  SimulatedRig rig = simulate_rig(s, random);
  BundleOptions options{.configuration = BundleConfiguration::stereo_calibration};
  if (a.length == "measured")
    for (std::size_t k = 1; k < rig.cameras.size(); ++k)
      options.length[k] = {BundleLength::measured,
                           rig.true_cameras[k].t.norm() + kMeasuredSigma * random.normal(),
                           kMeasuredSigma};
  std::vector<float> squared(rig.observations.size());
  BundleProblem problem = rig.problem();
  problem.squared_residuals = squared;

  const auto start = std::chrono::steady_clock::now();
  const BundleResult result = adjuster.solve(problem, options);
  level->ms.add(
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());

  double reprojection = 0;
  for (std::size_t i = 0; i < squared.size(); ++i)
    reprojection += std::sqrt(static_cast<double>(squared[i])) /
                    static_cast<double>(rig.observations[i].inverse_sigma) /
                    static_cast<double>(squared.size());
  const double parameters = 3.0 * s.points + 6.0 * (s.poses - 1) + 5.0 * (s.cameras - 1);
  const double expected =
      s.noise *
      std::sqrt(2.0 *
                std::max(0.0, 1.0 - parameters / (2.0 * static_cast<double>(squared.size()))));
  ++level->runs;
  if (!result.converged() ||
      (s.noise > 0 ? result.rms_px > kFailedRatio * expected : reprojection > kFailedExact)) {
    ++level->failed;
    return;
  }
  double rotation = 0, translation = 0, pose = 0;
  for (std::size_t k = 1; k < rig.cameras.size(); ++k) {
    rotation += rotation_angle(rig.T_camera_left[k].R * rig.true_cameras[k].R.transpose()) /
                (s.cameras - 1);
    translation += (rig.T_camera_left[k].t - rig.true_cameras[k].t).norm() / (s.cameras - 1);
  }
  for (std::size_t i = 1; i < rig.T_left_world.size(); ++i)
    pose += (rig.T_left_world[i].centre() - rig.true_poses[i].centre()).norm() / (s.poses - 1);
  level->reprojection_px.add(reprojection);
  level->pose_m.add(pose);
  level->rotation_rad.add(rotation);
  level->translation_m.add(translation);
  level->steps.add(result.steps);
}

nlohmann::ordered_json levels_json(const std::vector<Level>& levels) {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const Level& l : levels)
    all.push_back({{"pixel_noise", l.noise},
                   {"runs", l.runs},
                   {"failed", l.failed},
                   {"mean_reprojection_px", l.reprojection_px.mean()},
                   {"mean_pose_error_m", l.pose_m.mean()},
                   {"mean_rotation_error_rad", l.rotation_rad.mean()},
                   {"mean_translation_error_m", l.translation_m.mean()},
                   {"median_reprojection_px", l.reprojection_px.median()},
                   {"median_pose_error_m", l.pose_m.median()},
                   {"median_rotation_error_rad", l.rotation_rad.median()},
                   {"median_translation_error_m", l.translation_m.median()},
                   {"median_ms", l.ms.median()},
                   {"mean_steps", l.steps.mean()}});
  return all;
}

void print_table(const Experiment& a, const std::vector<Level>& levels) {
  const SimulationOptions& s = a.simulation;
  std::cout << fmt::format(
      "{} points in a {} of {} m, {} cameras, generator {}, length {} ({} free parameters a "
      "camera), mean | median\n",
      s.points, a.shape, s.radius, s.cameras, a.generator, a.length, a.length == "exact" ? 5 : 6);
  std::cout << fmt::format("{:>8} {:>7} {:>6} {:>19} {:>19} {:>19} {:>19} {:>6} {:>9}\n",
                           "noise px", "runs", "failed", "reprojection px", "pose m",
                           "rotation rad", "translation m", "steps", "ms median");
  const auto pair = [](const Statistic& f) {
    return fmt::format("{:.2e} | {:.2e}", f.mean(), f.median());
  };
  for (const Level& l : levels)
    std::cout << fmt::format("{:>8} {:>7} {:>6} {:>19} {:>19} {:>19} {:>19} {:>6.1f} {:>9.3f}\n",
                             l.noise, l.runs, l.failed, pair(l.reprojection_px), pair(l.pose_m),
                             pair(l.rotation_rad), pair(l.translation_m), l.steps.mean(),
                             l.ms.median());
}

}  // namespace

ExitCode run_experiment(const Experiment& given) {
  Experiment a = given;
  a.simulation.shape = a.shape == "shell" ? SimulationShape::shell : SimulationShape::ball;
  a.simulation.generator =
      a.generator == "tight" ? SimulationGenerator::tight : SimulationGenerator::ring;
  if (a.simulation.generator == SimulationGenerator::tight)
    // A negative value means that the start points are triangulated.
    a.simulation.start_points = -1;
  std::ofstream json;
  // The file is opened before the work, so that a bad path fails early.
  if (!a.json.empty()) {
    json.open(a.json);
    if (!json)
      throw InputError("--json: " + a.json +
                       " cannot be written; check that its directory exists and is writable");
  }
  Arena arena;
  BundleAdjuster adjuster(capacities_for(a.simulation), arena);
  Progress progress = Progress::on_stderr(a.quiet);
  std::vector<Level> levels;
  ProgressState state{.state = "simulate",
                      .frames = a.noise.size() * static_cast<std::uint64_t>(a.runs)};
  for (const double n : a.noise) {
    SimulationOptions s = a.simulation;
    s.noise = n;
    Level level{.noise = n};
    for (int i = 0; i < a.runs; ++i) {
      try {
        run_once(adjuster, a, s, static_cast<std::uint64_t>(i), &level);
      } catch (const std::runtime_error& impossible) {
        throw InputError(impossible.what());
      }
      ++state.frame;
      progress.update(state);
    }
    levels.push_back(std::move(level));
  }
  progress.finish();
  print_table(a, levels);
  if (json.is_open()) {
    json << levels_json(levels).dump(1) << '\n';
    json.close();
    if (!json) throw InputError("--json: " + a.json + " is incomplete; check the free space");
  }
  return ExitCode::done;
}

}  // namespace vergence::app
