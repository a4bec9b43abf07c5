// How far the statistics that decisions rest on are from their bounds, over all recorded drives.
//
//   margin_bench [solves] [DRIVE|all] [KEY=VALUE …]
//
// solves   A solve of so many frames against the one of the whole drive: the difference of their
//          depths (root mean over the image, at the depth that calibrations are judged at) over the
//          sigma that the solve states. Honest sigmas give a root mean square of one.
//
// Tables are markdown, for docs/benchmarks.md. Settings apply to every run.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <deque>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "app/session/drive_calibration.hpp"
#include "core/calibration/agreement.hpp"
#include "core/calibration/health.hpp"
#include "core/calibration/stretches.hpp"
#include "core/estimator/estimator.hpp"
#include "tests/support/recorded_sequence.hpp"
#include "tests/support/shared_data.hpp"

namespace vergence::bench {
namespace {

using app::StartingCalibration;
using calibration::RigSolution;
using calibration::Stretches;
using test::RecordedSequence;

constexpr std::array<std::size_t, 5> kFrames = {15, 25, 50, 75, 100};

/// Solutions of all stretches of a drive, by their length.
std::array<std::vector<RigSolution>, kFrames.size()> solve_stretches(
    const RecordedSequence& d, app::Configuration c, const StartingCalibration& given) {
  c.calibration.min_frames = std::min<int>(c.calibration.min_frames, kFrames.front());
  const auto features = static_cast<std::size_t>(c.odometry.features);
  Arena arena(kFrames.size() *
              Stretches::memory_needed(c.calibration, c.monitor, given.file.rig.cameras, features));
  std::deque<Stretches> stretches;
  for (const std::size_t n : kFrames)
    stretches.emplace_back(Stretches::Kind::alone, given.file.rig, given.file.rig, n, c.calibration,
                           c.monitor, features, arena);
  std::array<std::vector<RigSolution>, kFrames.size()> solved;
  const app::DrivePass pass{d.sequence, c, 0, d.sequence.pairs.size(), {}, {}};
  (void)app::drive_once(pass, given, [&](const Estimator& e, const PoseSample& /*sample*/) {
    for (std::size_t i = 0; i < kFrames.size(); ++i) {
      const auto s = stretches[i].take(e.tracks());
      if (s && s->status == calibration::RigSolveStatus::ok) solved[i].push_back(*s);
    }
  });
  return solved;
}

void solves(const RecordedSequence& d, const app::Configuration& c) {
  const StartingCalibration given = app::replayed_calibration(c, d.sequence, false);
  const app::DrivePass pass{d.sequence, c, 0, d.sequence.pairs.size(), {}, {}};
  const app::DriveCalibration whole = app::calibrate_drive(pass, given);
  if (!whole.rig) return;
  const auto solved = solve_stretches(d, c, given);
  for (std::size_t i = 0; i < kFrames.size(); ++i) {
    double squares = 0, largest = 0, sigma = 0, percent = 0;
    for (const RigSolution& s : solved[i]) {
      const double depth =
          calibration::judged_depth_m(s.rig, 1, c.calibration, c.odometry.pixel_sigma);
      const double off = calibration::depth_difference_percent(*whole.rig, s.rig, 1, depth),
                   own = calibration::depth_error_percent(s.rig, 1, depth), z = off / own;
      squares += z * z;
      largest = std::max(largest, z);
      sigma += own;
      percent += off * off;
    }
    const auto n = static_cast<double>(solved[i].size());
    if (solved[i].empty()) continue;
    fmt::print("| {} | {} | {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} |\n", d.name, kFrames[i],
               solved[i].size(), sigma / n, std::sqrt(percent / n), std::sqrt(squares / n),
               largest);
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace vergence::bench

int main(int argc, char** argv) {
  using namespace vergence;
  const std::string what = argc > 1 ? argv[1] : "all", only = argc > 2 ? argv[2] : "all";
  const std::vector<std::string> set(argv + std::min(argc, 3), argv + argc);
  const app::Configuration c = app::load_configuration(std::nullopt, set);
  std::vector<test::RecordedSequence> drives;
  for (const char* name : test::kRecordedDrives)
    if (only == "all" || only == name)
      if (auto d = test::open_recorded(name)) drives.push_back(std::move(*d));
  if (drives.empty()) {
    fmt::print("VERGENCE_SHARED has no such drive\n");
    return 2;
  }
  if (what == "all" || what == "solves") {
    fmt::print(
        "| drive | frames | solves | sigma % | off % | off over sigma, rms | largest "
        "|\n|---|---|---|---|---|---|---|\n");
    for (const test::RecordedSequence& d : drives) bench::solves(d, c);
  }
  return EXIT_SUCCESS;
}
