// Calibration from nothing but the baseline's length: error of the transform found and its sigmas.
//
//   mock [--starts N] [--first K] [--from SECONDS] [--frames N]   a rendered rig, many places
//   drives [--only NAME]                every recorded drive: calibration given, wrong, found
//   focal [--only NAME]                 focal lengths that are off: told or not
//   stretches [--only NAME]             how far disjoint stretches of a drive agree
//   jumps [--only NAME]                 how far disparities jump on rigs that nobody touched
//   learning [--starts N]               a recorded drive N times to and fro: what each solve knows
//   learning --only mock [--frames N]   the same on the mock's streets, against the truth
//
// All take --set KEY=VALUE. One line a calibration, then the largest errors and their root means.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "app/config/configuration.hpp"
#include "app/runtime/thread_runner.hpp"
#include "core/estimator/estimator.hpp"
#include "core/math/random.hpp"
#include "core/math/so3.hpp"
#include "tests/bench/calibration_drives.hpp"
#include "tests/bench/calibration_learning.hpp"
#include "tests/support/rendered_drive.hpp"

namespace {

using namespace vergence;

struct Arguments {
  std::string what, only;
  int starts = 20, first = 0, frames = 400;
  double from = -1;
  bool wrong_intrinsics = false;
  std::vector<std::string> set;
};

struct Found {
  bool accepted = false;
  RigCalibration rig;
  int at_frame = 0;
  double solve_ms = 0;
};

using FrameSource = std::function<const RigFrame*(int)>;

RigCalibration nominal_of(const RigCalibration& rig) {
  RigCalibration n = rig;
  for (int k = 1; k < rig.cameras; ++k) {
    const auto c = static_cast<std::size_t>(k);
    n.T_camera_left[c] = {Mat3::Identity(), Vec3(-rig.T_camera_left[c].t.norm(), 0, 0)};
  }
  return n;
}

Found calibrate(const Arguments& a, const RigCalibration& rig, const FrameSource& source) {
  const app::Configuration configuration = app::load_configuration(std::nullopt, a.set);
  EstimatorOptions options;
  options.odometry = configuration.odometry;
  options.calibration = configuration.calibration;
  options.trust = CalibrationTrust::none;
  RigCalibration blank = rig;
  for (Transform& T : blank.T_camera_left) T = {};
  Arena arena(Estimator::memory_needed(options, blank));
  app::ThreadRunner two;
  ImmediateRunner solver;
  Estimator estimator(options, blank, nominal_of(rig), arena, two, solver);
  Found f;
  const auto note = [&](int i) {
    for (const CalibrationDecision& d : estimator.calibrations()) {
      if (!d.accepted)
        fmt::print(
            "       decision {} {} frames {} rms {:.3f} px held out {:.2f} -> {:.2f} px solve "
            "{:.0f} ms\n",
            d.accepted ? "yes" : "no", d.reason, d.calibration.frames,
            d.calibration.reprojection_px, d.held_out_before_px, d.held_out_after_px, d.solve_ms);
      f.solve_ms = d.solve_ms;
      f.rig = d.calibration;
      f.at_frame = i;
      f.accepted = d.accepted;
    }
  };
  for (int i = 0; i < a.frames; ++i) {
    const RigFrame* frame = source(i);
    if (frame == nullptr) break;
    (void)estimator.process(*frame);
    note(i);
    if (f.accepted) break;
  }
  if (!f.accepted) {
    estimator.finish();
    note(a.frames);
  }
  return f;
}
/// Errors of camera 1 about the axes (mrad) and of t (mm); sigma_noise and sigma_wide beside them.
struct Errors {
  std::array<double, 6> value{}, noise{}, wide{};
};

Errors errors_of(const RigCalibration& found, const Transform& truth) {
  Errors e;
  const Vec3 turn = 1e3 * log_so3(found.T_camera_left[1].R * truth.R.transpose());
  const Vec3 shift = 1e3 * (found.T_camera_left[1].t - truth.t);
  for (int i = 0; i < 3; ++i) {
    e.value[static_cast<std::size_t>(i)] = turn[i];
    e.value[static_cast<std::size_t>(i + 3)] = shift[i];
  }
  for (std::size_t i = 0; i < 6; ++i) {
    e.noise[i] = 1e3 * found.sigma_noise[1][i];
    e.wide[i] = 1e3 * found.sigma_wide[1][i];
  }
  return e;
}

void print(const std::string& name, const Found& f, const Errors& e) {
  fmt::print("{:10s} {} frame {:3d}  {:3d} frames {:.3f} px ", name, f.accepted ? "ok" : "NO",
             f.at_frame, f.rig.frames, f.rig.reprojection_px);
  for (std::size_t i = 0; i < 6; ++i) fmt::print(" {:+8.4f}({:.3f})", e.value[i], e.noise[i]);
  fmt::print("  f {:.2f} {:.2f} px  scale {:.2f} %  {:.0f} ms\n", f.rig.intrinsics[1].fx,
             f.rig.intrinsics[1].fy, 100 * f.rig.scale_sigma, f.solve_ms);
}

int run_mock(const Arguments& a) {
  mock::DriveOptions drive;
  std::vector<double> starts = a.from >= 0 ? std::vector<double>{a.from}
                                           : test::RenderedDrive::starts(drive, a.starts, 3.0, 5.0);
  std::array<double, 6> largest{}, squares{}, nees{};
  int n = 0, within = 0;
  for (std::size_t i = static_cast<std::size_t>(a.first); i < starts.size(); ++i) {
    test::RenderedDriveOptions o;
    o.drive = drive;
    o.from_s = starts[i];
    test::RenderedDrive rendered(o);
    RigCalibration given = o.rig;
    if (a.wrong_intrinsics) {
      Random random(1000 + i);
      for (std::size_t k = 0; k < 2; ++k) {
        const double focal = 1 + 0.001 * random.normal();
        given.intrinsics[k].fx *= focal;
        given.intrinsics[k].fy *= focal;
        given.intrinsics[k].cx += 0.5 * random.normal();
        given.intrinsics[k].cy += 0.5 * random.normal();
      }
    }
    const Found f =
        calibrate(a, given, [&](int k) { return &rendered.frame(static_cast<std::uint64_t>(k)); });
    const Errors e = errors_of(f.rig, o.rig.T_camera_left[1]);
    print(fmt::format("{:.2f} s", starts[i]), f, e);
    std::fflush(stdout);
    if (!f.accepted) continue;
    ++n;
    for (std::size_t k = 0; k < 6; ++k) {
      largest[k] = std::max(largest[k], std::abs(e.value[k]));
      squares[k] += e.value[k] * e.value[k];
      const double sigma = a.wrong_intrinsics ? e.wide[k] : e.noise[k];
      nees[k] += e.value[k] * e.value[k] / (sigma * sigma);
      within += k != 3 && std::abs(e.value[k]) <= 2 * sigma ? 1 : 0;
    }
  }
  fmt::print(
      "{} calibrated of {}; mrad and mm; {} of {} single errors within two {} sigmas (t_x follows "
      "from the length)\n",
      n, starts.size() - static_cast<std::size_t>(a.first), within, 5 * n,
      a.wrong_intrinsics ? "wide" : "noise");
  for (const auto& [name, row] :
       {std::pair("largest", &largest), std::pair("rms", &squares), std::pair("z rms", &nees)}) {
    fmt::print("{:10s}", name);
    for (const double v : *row)
      fmt::print(" {:8.4f}", name == std::string("largest") ? v : std::sqrt(v / std::max(1, n)));
    fmt::print("\n");
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments a;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto next = [&]() -> std::string { return i + 1 < argc ? argv[++i] : ""; };
    if (word == "--starts")
      a.starts = std::stoi(next());
    else if (word == "--first")
      a.first = std::stoi(next());
    else if (word == "--from")
      a.from = std::stod(next());
    else if (word == "--frames")
      a.frames = std::stoi(next());
    else if (word == "--set")
      a.set.push_back(next());
    else if (word == "--only")
      a.only = next();
    else if (word == "--wrong-intrinsics")
      a.wrong_intrinsics = true;
    else
      a.what = word;
  }
  try {
    if (a.what == "mock") return run_mock(a);
    if (a.what == "drives") return bench::run_drives(a.set, a.only);
    if (a.what == "learning" && a.only == "mock") return bench::run_mock_learning(a.set, a.frames);
    if (a.what == "learning") return bench::run_learning(a.set, a.starts);
    if (a.what == "focal") return bench::run_focal_lengths(a.set, a.only);
    if (a.what == "jumps") return bench::run_jumps(a.set, a.only);
    if (a.what == "stretches") return bench::run_stretches(a.set, a.only);
  } catch (const std::exception& e) {
    fmt::print(stderr, "calibration_bench: {}\n", e.what());
    return 2;
  }
  fmt::print(stderr,
             "calibration_bench: drives, focal, stretches, jumps, learning or mock is wanted\n");
  return 2;
}
