// Calibration from nothing but the baseline's length: error of the transform found and its sigmas.
//
//   mock [--starts N] [--first K] [--from SECONDS] [--frames N]   a rendered rig, many places
//   knock                               that rig knocked at frame 60
//   euroc, kitti                        recorded excerpts, as they are
//   drives [--only NAME]                every recorded drive: calibration given, wrong, found
//   focal [--only NAME]                 focal lengths that are off: told or not
//   stretches [--only NAME]             how far disjoint stretches of a drive agree
//   jumps [--only NAME]                 how far disparities jump on rigs that nobody touched
//   learning [--starts N]               a recorded drive N times to and fro: what each solve knows
//   learning --only mock [--frames N]   the same on the mock's streets, against the truth
//
// All take --set KEY=VALUE. One line a calibration, then the largest errors and their root means.
// `--verbose`: every event and the poses' status.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "app/config/configuration.hpp"
#include "app/datasets/image_file.hpp"
#include "app/datasets/stereo_sequence.hpp"
#include "app/runtime/thread_runner.hpp"
#include "core/calibration/health.hpp"
#include "core/estimator/estimator.hpp"
#include "core/math/random.hpp"
#include "core/math/so3.hpp"
#include "tests/bench/calibration_drives.hpp"
#include "tests/bench/calibration_learning.hpp"
#include "tests/support/rendered_drive.hpp"
#include "tests/support/shared_data.hpp"

namespace {

using namespace vergence;

struct Arguments {
  std::string what, only;
  int starts = 20, first = 0, frames = 400;
  double from = -1;
  bool verbose = false;
  bool wrong_intrinsics = false;
  std::vector<std::string> set;
};

struct Found {
  bool accepted = false;
  RigCalibration rig;
  int at_frame = 0;
  double solve_ms = 0;
  double slowest_ms = 0;  // frame while calibrating
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
      if (a.verbose || !d.accepted)
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
    const PoseSample s = estimator.process(*frame);
    if (a.verbose) {
      const Vec3& t = s.T_world_left.t;
      fmt::print("  {:4d} {} {} {} {} inl {} st {} {:.2f} px {:.1f} ms  {:.3f} {:.3f} {:.3f}\n", i,
                 to_string(s.state), to_string(s.status), to_string(s.reason),
                 s.keyframe ? "K" : " ", s.inliers, s.stereo_inliers, s.reprojection_px,
                 s.estimate_ms, t.x(), t.y(), t.z());
      for (const EstimatorEvent& e : estimator.events())
        fmt::print("       {} {:.3g}\n", e.why, e.value);
    }
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

struct Knock {
  const char* name;
  Vec3 turn_deg, shift_mm;
  double lag = 0;  // frames that the right camera is late
};

/// A rig that knows its calibration is knocked at frame kKnockAt.
int run_knocks(const Arguments& a) {
  constexpr std::uint64_t kKnockAt = 60;
  const std::array knocks = {Knock{"none", {0, 0, 0}, {0, 0, 0}},
                             Knock{"pitch 0.2 deg", {0.2, 0, 0}, {0, 0, 0}},
                             Knock{"pitch 0.05 deg", {0.05, 0, 0}, {0, 0, 0}},
                             Knock{"roll 0.1 deg", {0, 0, 0.1}, {0, 0, 0}},
                             Knock{"yaw 0.3 deg", {0, 0.3, 0}, {0, 0, 0}},
                             Knock{"t_y 4 mm", {0, 0, 0}, {0, 4, 0}},
                             Knock{"t_z 10 mm", {0, 0, 0}, {0, 0, 10}},
                             Knock{"pitch 2 deg", {2, 0, 0}, {0, 0, 0}}};
  for (std::size_t index = static_cast<std::size_t>(a.first);
       index < knocks.size() && static_cast<int>(index) < a.first + a.starts; ++index) {
    const Knock& knock = knocks[index];
    test::RenderedDriveOptions o;
    o.from_s = a.from >= 0 ? a.from : 20;
    const Transform before = o.rig.T_camera_left[1];
    Transform after{exp_so3(knock.turn_deg * std::numbers::pi / 180) * before.R,
                    before.t + 1e-3 * knock.shift_mm};
    after.t *= before.t.norm() / after.t.norm();
    o.placed = [&](int, std::uint64_t i) { return i < kKnockAt ? before : after; };
    test::RenderedDrive rendered(o);

    const app::Configuration configuration = app::load_configuration(std::nullopt, a.set);
    EstimatorOptions options;
    options.odometry = configuration.odometry;
    options.calibration = configuration.calibration;
    options.monitor = configuration.monitor;
    Arena arena(Estimator::memory_needed(options, o.rig));
    app::ThreadRunner two;
    ImmediateRunner solver;
    Estimator estimator(options, o.rig, nominal_of(o.rig), arena, two, solver);
    int noticed = -1, mended = -1, lost = 0, wrong_ok = 0;
    Transform T_enu_world{};
    double drift = 0;
    fmt::print("{}\n", knock.name);
    for (int i = 0; i < a.frames; ++i) {
      const auto n = static_cast<std::uint64_t>(i);
      const PoseSample s = estimator.process(rendered.frame(n));
      if (i == 0) T_enu_world = rendered.T_enu_left(0);
      const Transform truth = T_enu_world.inverse() * rendered.T_enu_left(n);
      drift = (s.T_world_left.t - truth.t).norm();
      if (s.status == PoseStatus::lost) ++lost;
      if (a.verbose)
        fmt::print("  {:4d} {} {} {} inl {} st {} {:.2f} px {:.1f} ms  off {:.3f} m {:.2f} mrad\n",
                   i, to_string(s.state), to_string(s.status), to_string(s.reason), s.inliers,
                   s.stereo_inliers, s.reprojection_px, s.estimate_ms, drift,
                   1e3 * log_so3(s.T_world_left.R * truth.R.transpose()).norm());
      if (n >= kKnockAt && mended < 0 && s.status == PoseStatus::ok) ++wrong_ok;
      for (const EstimatorEvent& e : estimator.events()) {
        fmt::print("    frame {}: {} {:.3g}\n", i, e.why, e.value);
        if (e.kind == EstimatorEvent::Kind::rig_changed && noticed < 0) noticed = i;
      }
      for (const CalibrationDecision& d : estimator.calibrations()) {
        fmt::print("    decision {} frames {} held out {:.2f} -> {:.2f} px\n", d.reason,
                   d.calibration.frames, d.held_out_before_px, d.held_out_after_px);
        if (d.accepted) {
          if (mended < 0 && n >= kKnockAt) mended = i;
          Found f{true, d.calibration, i, d.solve_ms, 0};
          print("    found", f, errors_of(d.calibration, after));
        }
      }
    }
    fmt::print(
        "  noticed after {} frames, mended {} frames later, {} lost, {} ok between, {:.3f} m off "
        "at the end\n",
        noticed < 0 ? -1 : noticed - static_cast<int>(kKnockAt), mended < 0 ? -1 : mended - noticed,
        lost, wrong_ok, drift);
    std::fflush(stdout);
  }
  return 0;
}

int run_recorded(const Arguments& a) {
  const bool euroc = a.what == "euroc";
  const auto folder = test::shared_data(euroc ? "data/euroc_mh01" : "data/kitti06_51");
  if (!folder) {
    fmt::print(stderr,
               "calibration_bench: no recorded excerpts; set VERGENCE_SHARED to the folder that "
               "holds data/\n");
    return 2;
  }
  const app::StereoSequence sequence =
      app::open_sequence(euroc ? app::SequenceFormat::euroc : app::SequenceFormat::kitti, *folder);
  RigFrame frame;
  std::array<cv::Mat, 2> images;
  const Found f = calibrate(a, sequence.calibration, [&](int i) -> const RigFrame* {
    if (i >= static_cast<int>(sequence.pairs.size())) return nullptr;
    const app::StereoPair& pair = sequence.pairs[static_cast<std::size_t>(i)];
    frame.number = static_cast<std::uint64_t>(i);
    frame.stamp = pair.stamp;
    frame.cameras = 2;
    for (std::size_t k = 0; k < 2; ++k) {
      const Intrinsics& c = sequence.calibration.intrinsics[k];
      images[k].create(c.height, (c.width + 63) / 64 * 64, CV_8U);
      std::vector<std::uint8_t> bytes;
      if (app::read_image_file(sequence.root / pair.file[k], &bytes) != app::ImageFileStatus::ok ||
          app::decode_grey(bytes, {c.width, c.height}, images[k].data, images[k].step) !=
              app::ImageFileStatus::ok)
        return nullptr;
      frame.images[k] = {images[k].data, c.width, c.height,
                         static_cast<std::ptrdiff_t>(images[k].step)};
    }
    return &frame;
  });
  print(a.what, f, errors_of(f.rig, sequence.calibration.T_camera_left[1]));
  const Vec3 turn = log_so3(f.rig.T_camera_left[1].R) * 180 / std::numbers::pi;
  fmt::print("rotation vector {:.4f} {:.4f} {:.4f} deg, t {:.5f} {:.5f} {:.5f} m\n", turn.x(),
             turn.y(), turn.z(), f.rig.T_camera_left[1].t.x(), f.rig.T_camera_left[1].t.y(),
             f.rig.T_camera_left[1].t.z());
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
    else if (word == "--verbose")
      a.verbose = true;
    else if (word == "--wrong-intrinsics")
      a.wrong_intrinsics = true;
    else
      a.what = word;
  }
  try {
    if (a.what == "mock") return run_mock(a);
    if (a.what == "knock") return run_knocks(a);
    if (a.what == "drives") return bench::run_drives(a.set, a.only);
    if (a.what == "learning" && a.only == "mock") return bench::run_mock_learning(a.set, a.frames);
    if (a.what == "learning") return bench::run_learning(a.set, a.starts);
    if (a.what == "focal") return bench::run_focal_lengths(a.set, a.only);
    if (a.what == "jumps") return bench::run_jumps(a.set, a.only);
    if (a.what == "stretches") return bench::run_stretches(a.set, a.only);
    if (a.what == "euroc" || a.what == "kitti") return run_recorded(a);
  } catch (const std::exception& e) {
    fmt::print(stderr, "calibration_bench: {}\n", e.what());
    return 2;
  }
  fmt::print(stderr,
             "calibration_bench: drives, focal, stretches, jumps, learning, mock, knock, euroc or "
             "kitti is "
             "wanted\n");
  return 2;
}
