// Availability of poses on recorded drives under perturbations that an odometry should bear.
//
//   robustness_bench [drives|cold|windows|times|scenes|unseen|planar|all] [DRIVE|all]
//   [variant=PART]
//                    [KEY=VALUE …]
//
// drives   Whole drives, calibration given, with `calibration.online=off` and online.
// cold     Starts at every tenth frame, ten frames, calibration
//          given and not refined: starts that give a pose within three frames.
// windows  Starts at every 25th frame, 150 frames or to the end, with the calibration given, the
//          one found beforehand, and from scratch (counted from the adoption on), against the same
//          window with the calibration given and `calibration.online=off`.
// times    Faults of time, with the calibration given, online and off.
// scenes   Harder scenes, the same.
// unseen   Whole drives played backwards, mirrored with the cameras swapped, and with the rig on
//          its side: rigs and motions that no default was chosen on.
// planar   `sand_rover` against its planar truth: similarity and an offset of time are fitted.
//
// Tables are markdown, for docs/benchmarks.md. Settings apply to every run.
#include <algorithm>
#include <numbers>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "app/session/drive_calibration.hpp"
#include "core/comparison/trajectory_metrics.hpp"
#include "core/estimator/estimator.hpp"
#include "core/math/so3.hpp"
#include "tests/bench/integrity_variants.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::bench {
namespace {

using namespace app;
using namespace test;

struct Bench {
  app::Configuration online, off;
  // Part of a variant's name for `times` and `scenes`.
  std::string variant;
};

StereoSequence part(const StereoSequence& s, std::size_t first, std::size_t count) {
  StereoSequence out = s;
  const auto begin = s.pairs.begin() + static_cast<std::ptrdiff_t>(first);
  const auto end = begin + static_cast<std::ptrdiff_t>(std::min(count, s.pairs.size() - first));
  out.pairs.assign(begin, end);
  return out;
}

StartingCalibration given(const app::Configuration& c, const StereoSequence& s) {
  return app::replayed_calibration(c, s, false);
}

int posed(const DriveOutcome& r) { return r.ok + r.degraded; }

/// Frames from `first` on that `r` has no pose of and `reference` has one.
int lost_beside(const DriveOutcome& r, const DriveOutcome& reference, std::size_t first) {
  int n = 0;
  for (std::size_t i = first; i < std::min(r.samples.size(), reference.samples.size()); ++i)
    n += r.samples[i].status == PoseStatus::lost && reference.samples[i].status != PoseStatus::lost
             ? 1
             : 0;
  return n;
}

std::string millimetres(const DriveOutcome& r) {
  return r.ate_m > 0 ? fmt::format("{:.1f}", 1e3 * r.ate_m) : "–";
}

void row(const std::string& text) {
  fmt::print("{}\n", text);
  std::fflush(stdout);
}

/// Share of frames that stay `ok` with online calibration, from
/// the first frame on at which a calibration given is usually confirmed.
double share_kept_ok(const DriveOutcome& online, const DriveOutcome& off) {
  constexpr std::size_t kFrom = 36;
  int before = 0, kept = 0;
  for (std::size_t i = kFrom; i < std::min(online.samples.size(), off.samples.size()); ++i) {
    if (off.samples[i].status != PoseStatus::ok) continue;
    ++before;
    kept += online.samples[i].status == PoseStatus::ok ? 1 : 0;
  }
  return before == 0 ? 1.0 : static_cast<double>(kept) / before;
}

void whole(const Bench& b, const RecordedSequence& d) {
  const DriveOutcome off = drive_recorded(d, d.sequence, b.off, given(b.off, d.sequence));
  const DriveOutcome online = drive_recorded(d, d.sequence, b.online, given(b.online, d.sequence));
  for (const DriveOutcome* r : {&off, &online}) {
    const auto moving =
        std::count_if(r->samples.begin(), r->samples.end(),
                      [](const PoseSample& s) { return s.reason == Reason::dynamic_scene; });
    const auto first = std::find_if(r->samples.begin(), r->samples.end(),
                                    [](const PoseSample& s) { return s.status == PoseStatus::ok; });
    row(fmt::format("| {} | {} | {} | {} | {} | {:.1f} | {} | {} | {} | {} | {} | {} |", d.name,
                    r == &online ? "online" : "off", posed(*r), r->ok,
                    first == r->samples.end() ? -1 : first - r->samples.begin(),
                    100 * share_kept_ok(*r, off), moving, millimetres(*r),
                    r->segments_percent > 0 ? fmt::format("{:.3f}", r->segments_percent) : "–",
                    r->knocks, r->adopted,
                    r->adopted > 0 ? fmt::format("{:.1f}", r->points_kept_percent) : "–"));
  }
}

/// Returns whether every start had a pose.
bool cold_starts(const Bench& b, const RecordedSequence& d) {
  constexpr std::size_t kStep = 10, kFrames = 10;
  int starts = 0, posed_within = 0;
  std::string failed;
  for (std::size_t first = 0; first + kFrames <= d.sequence.pairs.size(); first += kStep) {
    const StereoSequence s = part(d.sequence, first, kFrames);
    const DriveOutcome r = drive_recorded(d, s, b.off, given(b.off, s));
    ++starts;
    bool any = false;
    for (std::size_t i = 0; i < std::min<std::size_t>(3, r.samples.size()); ++i)
      any = any || r.samples[i].status != PoseStatus::lost;
    posed_within += any ? 1 : 0;
    if (!any) failed += fmt::format(" {} ({})", first, to_string(r.samples[2].reason));
  }
  row(fmt::format("| {} | {} of {} |{} |", d.name, posed_within, starts, failed));
  return posed_within == starts;
}

void window_row(const std::string& name, std::size_t first, const char* what, const DriveOutcome& r,
                const DriveOutcome& reference, bool scratch) {
  if (scratch && r.adopted_at < 0)
    return row(fmt::format("| {} | {} | {} | never adopted | | | | | |", name, first, what));
  const std::size_t from = scratch ? static_cast<std::size_t>(r.adopted_at) : 0;
  const auto after = [&](PoseStatus s) {
    return std::count_if(r.samples.begin() + static_cast<std::ptrdiff_t>(from), r.samples.end(),
                         [&](const PoseSample& p) { return p.status == s; });
  };
  row(fmt::format("| {} | {} | {} | {} of {} | {} | {} | {} | {} | {} |", name, first, what,
                  after(PoseStatus::ok) + after(PoseStatus::degraded), r.samples.size() - from,
                  after(PoseStatus::ok), millimetres(r), lost_beside(r, reference, from), r.knocks,
                  r.adopted));
}

void windows(const Bench& b, const RecordedSequence& d) {
  constexpr std::size_t kStep = 25, kFrames = 150, kMin = 25;
  const StartingCalibration initial = given(b.online, d.sequence);
  StartingCalibration own = initial;
  const app::DriveCalibration found =
      app::calibrate_drive({d.sequence, b.online, 0, d.sequence.pairs.size()}, initial);
  if (found.rig) own.file.rig = *found.rig;
  for (std::size_t first = 0; first + kMin <= d.sequence.pairs.size(); first += kStep) {
    const StereoSequence s = part(d.sequence, first, kFrames);
    const DriveOutcome off = drive_recorded(d, s, b.off, initial);
    window_row(d.name, first, "off", off, off, false);
    window_row(d.name, first, "given", drive_recorded(d, s, b.online, initial), off, false);
    if (found.rig)
      window_row(d.name, first, "found", drive_recorded(d, s, b.online, own), off, false);
    window_row(d.name, first, "from scratch", drive_recorded(d, s, b.online, test::blank(initial)),
               off, true);
  }
}

void variants(const Bench& b, const RecordedSequence& d, std::span<const IntegrityVariant> all) {
  const DriveOutcome untouched = drive_recorded(d, d.sequence, b.off, given(b.off, d.sequence));
  row(fmt::format("| {} | untouched | {} | {} | | | |", d.name, posed(untouched), untouched.ok));
  for (const IntegrityVariant& v : all) {
    if (v.name.find(b.variant) == std::string_view::npos) continue;
    const test::TemporaryFolder folder;
    const StereoSequence s = spoil(d, v, folder.path());
    const DriveOutcome off = drive_recorded(d, s, b.off, given(b.off, s));
    const DriveOutcome online = drive_recorded(d, s, b.online, given(b.online, s));
    row(fmt::format("| {} | {} | {} | {} | {} | {} | {} |", d.name, v.name, posed(off), off.ok,
                    posed(online), online.ok, online.knocks));
  }
}

/// The drive played backwards: a car that reverses.
RecordedSequence backwards(RecordedSequence d) {
  std::vector<app::StereoPair>& pairs = d.sequence.pairs;
  const Stamp first = pairs.front().stamp, last = pairs.back().stamp;
  const auto reversed = [&](Stamp s) { return first + (last - s); };
  std::reverse(pairs.begin(), pairs.end());
  for (app::StereoPair& p : pairs) p.stamp = reversed(p.stamp);
  std::reverse(d.truth.begin(), d.truth.end());
  for (StampedPose& p : d.truth) p.stamp = reversed(p.stamp);
  d.name += " backwards";
  return d;
}

/// The drive in a mirror, whose left camera is the right one's image.
RecordedSequence mirrored(const RecordedSequence& from, const std::filesystem::path& folder) {
  RecordedSequence d = from;
  d.sequence = spoil(from,
                     {"mirrored",
                      [](cv::Mat* left, cv::Mat* right, std::size_t, std::size_t) {
                        std::swap(*left, *right);
                        for (cv::Mat* image : {left, right}) cv::flip(*image, *image, 1);
                      },
                      nullptr},
                     folder);
  // Both sides of a mirrored rotation and translation are mirrored: S R S and S t.
  const Vec3 mirror(-1, 1, 1);
  const auto in_mirror = [&](const Transform& t) {
    return Transform{mirror.asDiagonal() * t.R * mirror.asDiagonal(), mirror.asDiagonal() * t.t};
  };
  RigCalibration& rig = d.sequence.calibration;
  std::swap(rig.intrinsics[0], rig.intrinsics[1]);
  for (Intrinsics& lens : rig.intrinsics) {
    lens.cx = lens.width - 1 - lens.cx;
    if (lens.kind == CameraModelKind::pinhole_radtan) lens.distortion[3] *= -1;
  }
  const Transform T_left_right = rig.T_camera_left[1].inverse();
  for (StampedPose& p : d.truth) p.T_world_body = in_mirror(p.T_world_body * T_left_right);
  rig.T_camera_left[1] = in_mirror(T_left_right);
  d.name += " mirrored";
  return d;
}

/// The drive with its rig on the side, one camera above the other.
RecordedSequence on_its_side(const RecordedSequence& from, const std::filesystem::path& folder) {
  RecordedSequence d = from;
  d.sequence = spoil(from,
                     {"on its side",
                      [](cv::Mat* left, cv::Mat* right, std::size_t, std::size_t) {
                        for (cv::Mat* image : {left, right})
                          cv::rotate(*image, *image, cv::ROTATE_90_CLOCKWISE);
                      },
                      nullptr},
                     folder);
  const Transform turn{exp_so3(Vec3(0, 0, std::numbers::pi / 2)), Vec3::Zero()};
  RigCalibration& rig = d.sequence.calibration;
  for (std::size_t k = 0; k < 2; ++k) {
    const Intrinsics& before = from.sequence.calibration.intrinsics[k];
    Intrinsics& lens = rig.intrinsics[k] = before;
    std::swap(lens.width, lens.height);
    std::swap(lens.fx, lens.fy);
    lens.cx = before.height - 1 - before.cy;
    lens.cy = before.cx;
    if (lens.kind != CameraModelKind::pinhole_radtan) continue;
    lens.distortion[2] = before.distortion[3];
    lens.distortion[3] = -before.distortion[2];
  }
  rig.T_camera_left[1] = turn * rig.T_camera_left[1] * turn.inverse();
  for (StampedPose& p : d.truth) p.T_world_body = p.T_world_body * turn.inverse();
  d.name += " on its side";
  return d;
}

/// Alignment of positions of frames in [first, last): rotated, moved, scaled and shifted in time
/// onto the track, which is flat.
struct PlanarFit {
  double rms_m = HUGE_VAL, scale = 0;
  std::size_t poses = 0;
};

PlanarFit fit_planar(const DriveOutcome& r, std::size_t first, std::size_t last) {
  const auto folder = test::shared_data("data/sand_rover").value();
  std::ifstream truth(folder / "truth_planar.txt"), times(folder / "times_1hz.txt");
  std::vector<StampedPose> track, poses;
  for (double t = 0, x = 0, y = 0; truth >> t >> x >> y;)
    track.push_back({Stamp{} + Duration::seconds(t), {Mat3::Identity(), Vec3(x, y, 0)}});
  std::vector<Stamp> stamps;
  for (double t = 0; times >> t;) stamps.push_back(Stamp{} + Duration::seconds(t));
  for (const PoseSample& s : r.samples)
    if (s.frame >= first && s.frame < last && s.status != PoseStatus::lost)
      poses.push_back({stamps.at(s.frame), s.T_world_left});
  EvaluationOptions options{.max_gap = Duration::seconds(1e6)};
  PlanarFit best;
  for (double offset = -5; offset <= 5; offset += 0.05) {
    std::vector<StampedPose> shifted = poses;
    for (StampedPose& p : shifted) p.stamp = p.stamp + Duration::seconds(offset);
    const TrajectoryEvaluation e = evaluate(shifted, track, options);
    if (e.status == EvaluationStatus::ok && e.ate_sim3.rmse < best.rms_m)
      best = {e.ate_sim3.rmse, e.sim3.scale, poses.size()};
  }
  return best;
}

void planar(const Bench& b, const RecordedSequence& d) {
  for (const bool online : {false, true}) {
    const app::Configuration& c = online ? b.online : b.off;
    const DriveOutcome r = drive_recorded(d, d.sequence, c, given(c, d.sequence));
    const PlanarFit sunny = fit_planar(r, 0, 329), dim = fit_planar(r, 329, 428);
    row(fmt::format("| {} | {} | {} | {} | {} | {:.0f} | {:.3f} | {} | {:.0f} | {:.3f} | {} |",
                    online ? "online" : "off", r.samples.size(), posed(r), r.ok, sunny.poses,
                    1e3 * sunny.rms_m, sunny.scale, dim.poses, 1e3 * dim.rms_m, dim.scale,
                    r.knocks));
  }
}

}  // namespace
}  // namespace vergence::bench

int main(int argc, char** argv) {
  using namespace vergence;
  using namespace vergence::bench;
  const std::string what = argc > 1 ? argv[1] : "all", only = argc > 2 ? argv[2] : "all";
  std::vector<std::string> set(argv + std::min(argc, 3), argv + argc);
  std::string variant;
  if (!set.empty() && set.front().starts_with("variant=")) {
    variant = set.front().substr(std::string_view("variant=").size());
    set.erase(set.begin());
  }
  Bench b{app::load_configuration(std::nullopt, set), app::load_configuration(std::nullopt, set),
          variant};
  b.off.online = 0;
  std::vector<RecordedSequence> drives;
  if (!test::for_recorded(test::kRecordedDrives, only,
                          [&](RecordedSequence* d) { drives.push_back(std::move(*d)); }))
    return 2;
  bool started = true;
  const auto section = [&](const char* name, const char* heading, int columns, const auto& run) {
    if (what != "all" && what != name) return;
    fmt::print("\n| {} |\n|", heading);
    for (int i = 0; i < columns; ++i) fmt::print("---|");
    fmt::print("\n");
    for (const RecordedSequence& d : drives) run(d);
  };
  const char* drives_heading =
      "drive | calibration | posed | ok | first ok | ok of those with `off` from frame 36 on, % | "
      "moving scene | ATE mm | segments % | knocks | adopted | points kept at adoptions, least, %";
  section("drives", drives_heading, 12, [&](const RecordedSequence& d) { whole(b, d); });
  section("cold", "drive | starts with a pose within three frames | not, at frame (reason)", 3,
          [&](const RecordedSequence& d) { started = cold_starts(b, d) && started; });
  section("windows",
          "drive | start | calibration | posed | ok | ATE mm | lost, and posed with `off` | knocks "
          "| adopted",
          9, [&](const RecordedSequence& d) { windows(b, d); });
  const char* spoilt = "drive | what | posed, off | ok, off | posed, online | ok, online | knocks";
  section("times", spoilt, 7, [&](const RecordedSequence& d) { variants(b, d, time_variants()); });
  section("scenes", spoilt, 7, [&](RecordedSequence d) {
    // From there on it is too dim for any odometry to follow when it is made darker still.
    if (d.name == "sand_rover") d.sequence = part(d.sequence, 0, 330);
    variants(b, d, scene_variants());
  });
  section("unseen", drives_heading, 12, [&](const RecordedSequence& d) {
    const test::TemporaryFolder folder;
    whole(b, backwards(d));
    whole(b, mirrored(d, folder.path() / "mirrored"));
    whole(b, on_its_side(d, folder.path() / "side"));
  });
  section(
      "planar",
      "sand_rover | frames | posed | ok | posed 0–328 | rms mm | scale | posed 329–427 | rms mm "
      "| scale | knocks",
      11, [&](const RecordedSequence& d) {
        if (d.name == "sand_rover") planar(b, d);
      });
  return started ? EXIT_SUCCESS : EXIT_FAILURE;
}
