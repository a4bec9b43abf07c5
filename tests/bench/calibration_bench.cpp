// Calibration on recorded drives: results from a nominal, a wrong and no calibration, false alarms,
// and knocks made by turning the right images.
//
//   drives [--only NAME]       every recorded drive: calibration given, wrong, found
//   focal [--only NAME]        wrong focal lengths: contradicted or not
//   stretches [--only NAME]    how far disjoint stretches of a drive agree
//   solves [--only NAME]       a solve of so many frames against the one of the whole drive: the
//                              difference of their depths (root mean over the image, at the depth
//                              that calibrations are judged at) over the sigma that the solve
//                              states, and the inflation of that sigma's square
//
// All take --set KEY=VALUE.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>

#include <fmt/format.h>

#include "app/runtime/background_thread.hpp"
#include "app/session/drive_calibration.hpp"
#include "core/calibration/health.hpp"
#include "core/calibration/segment_solver.hpp"
#include "core/estimator/estimator.hpp"
#include "core/math/so3.hpp"
#include "tests/support/recorded_sequence.hpp"
#include "tests/support/rendered_drive.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::bench {
namespace {

using namespace app;
using namespace calibration;
using namespace test;

void print(const std::string& drive_name, const std::string& what, const DriveOutcome& r) {
  fmt::print(
      "{:12s} {:34s} seg {:6.3f} %  ATE {:7.4f} m, {:7.4f} m after a scale of {:.4f}  ok {:3d} of "
      "{:3d}",
      drive_name, what, r.segments_percent, r.ate_m, r.ate_scaled_m, r.scale, r.ok, r.frames);
  fmt::print("  knocks told {}  verified at {:3d} ({:3.0f} % ok since)", r.knocks, r.verified_at,
             r.since_verified > 0 ? 100.0 * r.ok_since_verified / r.since_verified : 0.0);
  if (r.contradicted_at >= 0)
    fmt::print("  contradicted at {} by {:.1f} %", r.contradicted_at, r.contradicted_percent);
  if (r.reported_at >= 0 || r.recalibrated_at >= 0)
    fmt::print("  detected at {}, recalibrated at {}", r.reported_at, r.recalibrated_at);
  fmt::print("\n");
  std::fflush(stdout);
}

/// Detection of a wrong focal length, and the measured one.
void print_focal_lengths(const RecordedSequence& d, const app::Configuration& c) {
  const StartingCalibration given = app::replayed_calibration(c, d.sequence, false);
  for (const double factor : {1.0, 0.8, 0.9, 0.95, 1.05, 1.1, 1.25}) {
    const StartingCalibration begin = test::with_focal_length(given, factor);
    for (const bool scratch : {false, true}) {
      const DriveOutcome r = drive_recorded(d, d.sequence, c, scratch ? test::blank(begin) : begin);
      fmt::print(
          "{:12s} focal length x {:<4g} {:12s} ok {:3d} of {:3d}, {}: true one measured to "
          "{:+.1f} % (sigma {:.1f} %)\n",
          d.name, factor, scratch ? "from scratch" : "given", r.ok, r.frames,
          r.focal.contradicted ? "contradicted" : "believed",
          100 * (factor * r.focal.measured_px / r.focal.configured_px - 1),
          100 * r.focal.sigma_px / r.focal.measured_px);
      std::fflush(stdout);
    }
  }
}

void run_drive(const RecordedSequence& d, const app::Configuration& c) {
  const StartingCalibration given = app::replayed_calibration(c, d.sequence, false);
  print(d.name, "from scratch, one pass", drive_recorded(d, d.sequence, c, test::blank(given)));
  app::Configuration held = c;
  held.online = 0;
  print(d.name, "own calibration, held", drive_recorded(d, d.sequence, held, given));
  print(d.name, "own calibration, one pass", drive_recorded(d, d.sequence, c, given));
  const app::DriveCalibration found =
      app::calibrate_drive({d.sequence, c, 0, d.sequence.pairs.size()}, given);
  if (!found.rig) {
    fmt::print("{:12s} calibrate first: {}\n", d.name, found.why);
    return;
  }
  StartingCalibration first = given;
  first.file.rig = *found.rig;
  print(d.name, "calibrated first", drive_recorded(d, d.sequence, c, first));
  fmt::print("{:12s}   found from {} frames: depth at {:.1f} m known to {:.2f} %, rms {:.3f} px\n",
             d.name, found.rig->frames, found.depth_m, found.depth_sigma_percent,
             found.rig->reprojection_px);

  // Only undistorted images can be turned by a homography.
  if (d.sequence.calibration.intrinsics[1].has_distortion()) return;
  const test::TemporaryFolder folder;
  int index = 0;
  for (const Vec3& turn : {Vec3(0, 0.3, 0), Vec3(0.3, 0.2, 0.25)}) {
    const StereoSequence s =
        with_right_turned(d, turn, 0, folder / fmt::format("start{}", index++));
    const std::string words =
        fmt::format("turned ({:g}, {:g}, {:g}) deg", turn.x(), turn.y(), turn.z());
    const StartingCalibration wrong = app::replayed_calibration(c, s, false);
    print(d.name, words + ", one pass", drive_recorded(d, s, c, wrong));
    const app::DriveCalibration recalibrated =
        app::calibrate_drive({s, c, 0, s.pairs.size()}, wrong);
    StartingCalibration then = wrong;
    if (recalibrated.rig) then.file.rig = *recalibrated.rig;
    print(d.name, words + ", first", drive_recorded(d, s, c, then));
  }
  const std::size_t at = d.sequence.pairs.size() / 2;
  if (d.sequence.pairs.size() < 100) return;
  for (const Vec3& turn : {Vec3(0.1, 0, 0), Vec3(0, 0, 0.2), Vec3(0, 0.3, 0), Vec3(2, 0, 0)}) {
    const StereoSequence s =
        with_right_turned(d, turn, at, folder / fmt::format("knock{}", index++));
    const DriveOutcome r = drive_recorded(d, s, c, first, at);
    fmt::print(
        "{:12s} knock at {} by ({:g}, {:g}, {:g}) deg: detected after {}, recalibrated after {}, "
        "{} ok before that, {} false before it; seg {:.3f} % ATE {:.4f} m\n",
        d.name, at, turn.x(), turn.y(), turn.z(),
        r.reported_at < 0 ? -1 : r.reported_at - static_cast<int>(at),
        r.recalibrated_at < 0 ? -1 : r.recalibrated_at - static_cast<int>(at),
        r.ok_before_recalibrated, r.knocks, r.segments_percent, r.ate_m);
    std::fflush(stdout);
  }
}

void print_stretches(const std::string& name,
                     const std::vector<calibration::RigSolution>& stretches) {
  fmt::print("{}: {} stretches of some {} frames\n", name, stretches.size(),
             stretches.empty() ? 0 : stretches.front().frames);
  double transform = 0;
  std::array<double, calibration::kHealthDepths.size()> depth{}, percent{};
  std::size_t n = 0;
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    const calibration::RigSolution& s = stretches[i];
    const Vec3 phi = 1e3 * log_so3(s.rig.T_camera_left[1].R), t = 1e3 * s.rig.T_camera_left[1].t;
    const auto& sigma = s.rig.sigma_noise[1];
    fmt::print(
        "  rotation {:8.3f} ({:.3f}) {:8.3f} ({:.3f}) {:8.3f} ({:.3f}) mrad  t_y {:7.3f} ({:.3f}) "
        "t_z {:7.3f} ({:.3f}) mm",
        phi.x(), 1e3 * sigma[0], phi.y(), 1e3 * sigma[1], phi.z(), 1e3 * sigma[2], t.y(),
        1e3 * sigma[4], t.z(), 1e3 * sigma[5]);
    fmt::print("  cx {:.2f} ({:.2f}) cy {:.2f} ({:.2f}) px  {:.0f} ms, inflation {:.1f}\n",
               s.rig.intrinsics[1].cx, s.rig.intrinsics[1].sigma[2], s.rig.intrinsics[1].cy,
               s.rig.intrinsics[1].sigma[3], s.solve_ms, s.rig.inflation);
    if (i == 0) continue;
    RigCalibration a = stretches[i - 1].rig, b = s.rig;
    transform += calibration::agreement(a, b, 1);
    ++n;
    a.covariance = calibration::noise_only(a.covariance);
    b.covariance = calibration::noise_only(b.covariance);
    for (std::size_t k = 0; k < depth.size(); ++k) {
      const double z = calibration::kHealthDepths[k];
      const double off = calibration::depth_error_percent(a, b, 1, z),
                   own = std::hypot(calibration::depth_error_percent(a, 1, z),
                                    calibration::depth_error_percent(b, 1, z));
      percent[k] += off;
      if (own > 0) depth[k] += off * off / (own * own);
    }
  }
  if (n == 0) return;
  const auto by = static_cast<double>(n);
  fmt::print("  NEES a dimension: transform {:.2f}, depth", transform / by);
  for (std::size_t k = 0; k < depth.size(); ++k)
    fmt::print(" {:g} m {:.2f} ({:.2f} %)", calibration::kHealthDepths[k], depth[k] / by,
               percent[k] / by);
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
  EstimatorOptions options{
      .odometry = c.odometry, .calibration = c.calibration, .monitor = c.monitor};
  const auto features = static_cast<std::size_t>(c.odometry.features);
  Arena arena;
  app::ThreadRunner two;
  ImmediateRunner solver;
  Estimator estimator(options, o.rig, o.rig, arena, two, solver);
  calibration::SegmentSolver alone(calibration::SegmentSolver::Kind::alone, o.rig, o.rig, kStretch,
                                   c.calibration, c.monitor, features, arena);
  std::vector<calibration::RigSolution> stretches;
  for (std::uint64_t i = 0; i < kFrames; ++i) {
    (void)estimator.process(rendered.frame(i));
    const auto solved = alone.add(estimator.tracks());
    if (solved && solved->status == calibration::RigSolveStatus::ok) stretches.push_back(*solved);
  }
  print_stretches("mock", stretches);
}

constexpr std::array<std::size_t, 5> kStretches = {15, 25, 50, 75, 100};

/// Solutions of all stretches of a drive, by their length.
std::array<std::vector<RigSolution>, kStretches.size()> solve_stretches(
    const RecordedSequence& d, app::Configuration c, const StartingCalibration& given) {
  c.calibration.min_frames = std::min<int>(c.calibration.min_frames, kStretches.front());
  const auto features = static_cast<std::size_t>(c.odometry.features);
  Arena arena;
  std::deque<SegmentSolver> stretches;
  for (const std::size_t n : kStretches)
    stretches.emplace_back(SegmentSolver::Kind::alone, given.file.rig, given.file.rig, n,
                           c.calibration, c.monitor, features, arena);
  std::array<std::vector<RigSolution>, kStretches.size()> solved;
  const app::DrivePass pass{d.sequence, c, 0, d.sequence.pairs.size()};
  (void)app::drive_once(pass, given, [&](const Estimator& e, const PoseSample& /*sample*/) {
    for (std::size_t i = 0; i < kStretches.size(); ++i) {
      const auto s = stretches[i].add(e.tracks());
      if (s && s->status == calibration::RigSolveStatus::ok) solved[i].push_back(*s);
    }
  });
  return solved;
}

void print_solves(const RecordedSequence& d, const app::Configuration& c) {
  const StartingCalibration given = app::replayed_calibration(c, d.sequence, false);
  const app::DrivePass pass{d.sequence, c, 0, d.sequence.pairs.size()};
  const app::DriveCalibration whole = app::calibrate_drive(pass, given);
  if (!whole.rig) return;
  const auto solved = solve_stretches(d, c, given);
  for (std::size_t i = 0; i < kStretches.size(); ++i) {
    double squares = 0, largest = 0, sigma = 0, percent = 0, inflation = 0;
    for (const RigSolution& s : solved[i]) {
      const double depth =
          calibration::reference_depth_m(s.rig, 1, c.calibration, c.odometry.pixel_sigma);
      const double off = calibration::depth_error_percent(*whole.rig, s.rig, 1, depth),
                   own = calibration::depth_error_percent(s.rig, 1, depth), z = off / own;
      squares += z * z;
      largest = std::max(largest, z);
      sigma += own;
      percent += off * off;
      inflation += s.rig.inflation;
    }
    const auto n = static_cast<double>(solved[i].size());
    if (solved[i].empty()) continue;
    fmt::print("| {} | {} | {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.0f} |\n", d.name,
               kStretches[i], solved[i].size(), sigma / n, std::sqrt(percent / n),
               std::sqrt(squares / n), largest, inflation / n);
    std::fflush(stdout);
  }
}

int for_drives(const std::vector<std::string>& set, const std::string& only,
               const std::function<void(const RecordedSequence&, const app::Configuration&)>& each,
               std::span<const char* const> drives = test::kRecordedSequences) {
  const app::Configuration c = app::load_configuration(std::nullopt, set);
  return test::for_recorded(drives, only, [&](RecordedSequence* d) { each(*d, c); }) ? 0 : 2;
}

int run_stretches(const std::vector<std::string>& set, const std::string& only) {
  const int recorded =
      for_drives(set, only, [](const RecordedSequence& d, const app::Configuration& c) {
        const StartingCalibration given = app::replayed_calibration(c, d.sequence, false);
        const app::DriveCalibration found =
            app::calibrate_drive({d.sequence, c, 0, d.sequence.pairs.size()}, given);
        print_stretches(d.name, found.stretches);
      });
  if (only == "all" || only == "mock") {
    rendered_stretches(app::load_configuration(std::nullopt, set));
    return 0;
  }
  return recorded;
}

}  // namespace
}  // namespace vergence::bench

int main(int argc, char** argv) {
  using namespace vergence::bench;
  std::string what, only = "all";
  std::vector<std::string> set;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto next = [&]() -> std::string { return i + 1 < argc ? argv[++i] : ""; };
    if (word == "--set")
      set.push_back(next());
    else if (word == "--only")
      only = next();
    else
      what = word;
  }
  try {
    if (what == "drives") return for_drives(set, only, run_drive);
    if (what == "focal") return for_drives(set, only, print_focal_lengths);
    if (what == "stretches") return run_stretches(set, only);
    if (what == "solves") {
      fmt::print(
          "| drive | frames | solves | sigma % | off % | off over sigma, rms | largest | "
          "inflation |\n|---|---|---|---|---|---|---|---|\n");
      return for_drives(set, only, print_solves, vergence::test::kRecordedDrives);
    }
  } catch (const std::exception& e) {
    fmt::print(stderr, "calibration_bench: {}\n", e.what());
    return 2;
  }
  fmt::print(stderr, "calibration_bench: drives, focal, stretches or solves is wanted\n");
  return 2;
}
