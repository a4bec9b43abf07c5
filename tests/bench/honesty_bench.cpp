// Wrong `ok` on recorded drives: each spoilt in many ways, driven with the given calibration, with
// the drive's own and from scratch. A pose is wrong when the motion over the last 20 frames is off
// by more than five times what it is off by on the mean of the drive as it was recorded. Counted as
// WRONG are `ok` poses whose 20 frames, or as many as there were since the last pose that was not
// `ok`, are; "over 20" says how many there are when poses before that count, too, although they
// were told as `degraded`.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "app/commands/drive_calibration.hpp"
#include "core/estimator/estimator.hpp"
#include "tests/bench/honesty_variants.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::bench {
namespace {

using app::StartingCalibration;
using test::RecordedSequence;

constexpr std::size_t kFrames = 20;  // that an error is taken over; fewer at the beginning
constexpr double kTimes = 5;

struct Driven {
  std::vector<PoseSample> samples;  // in order; also those without a pose
  int knocks = 0;
};

/// What the estimator says after a frame, for who looks into why.
void print_events(const Estimator& e, const PoseSample& sample) {
  for (const EstimatorEvent& event : e.events())
    fmt::print("    frame {:3d} event {} value {:.3f} {}\n", sample.frame,
               static_cast<int>(event.kind), event.value, event.why);
  for (const CalibrationDecision& d : e.calibrations())
    fmt::print(
        "    frame {:3d} calibration of {} frames {} {}: held out {:.3f} → {:.3f} px, depth {:.2f} "
        "% "
        "known to {:.2f} % at {:.1f} m{}\n",
        sample.frame, d.calibration.frames, d.accepted ? "accepted" : "rejected", d.reason,
        d.held_out_before_px, d.held_out_after_px, d.depth_difference_percent,
        d.depth_sigma_percent, d.judged_depth_m, d.verified ? ", verified" : "");
}

Driven drive(const app::StereoSequence& s, const app::Configuration& c,
             const StartingCalibration& begin, bool events = false) {
  Driven d;
  (void)app::drive_once({s, c, 0, s.pairs.size(), {}, {}}, begin,
                        [&](const Estimator& e, const PoseSample& sample) {
                          d.samples.push_back(sample);
                          if (events) print_events(e, sample);
                          for (const EstimatorEvent& event : e.events())
                            d.knocks += event.kind == EstimatorEvent::Kind::rig_changed ? 1 : 0;
                        });
  return d;
}

/// The true pose nearest in time; nothing beyond half of EuRoC's interval of truth.
const Transform* true_pose(const app::Trajectory& truth, Stamp stamp) {
  auto at = std::lower_bound(truth.begin(), truth.end(), stamp,
                             [](const StampedPose& p, Stamp s) { return p.stamp < s; });
  if (at != truth.begin() && (at == truth.end() || at->stamp - stamp > stamp - (at - 1)->stamp))
    --at;
  const Duration apart = at->stamp > stamp ? at->stamp - stamp : stamp - at->stamp;
  return apart <= Duration::milliseconds(3) ? &at->T_world_body : nullptr;
}

/// Error of the motion between two samples, m; negative: the truth is not known at one of them.
double motion_error(const PoseSample& from, const PoseSample& to, const app::Trajectory& truth) {
  const Transform *a = true_pose(truth, from.stamp), *b = true_pose(truth, to.stamp);
  if (a == nullptr || b == nullptr) return -1;
  const Vec3 estimate = (from.T_world_left.inverse() * to.T_world_left).t;
  return (estimate - (a->inverse() * *b).t).norm();
}

/// Mean error by the number of frames that it is over.
std::array<double, kFrames + 1> normal_errors(const Driven& d, const app::Trajectory& truth) {
  std::array<double, kFrames + 1> sum{};
  const std::size_t n = d.samples.size();
  for (std::size_t length = 1; length <= kFrames; ++length) {
    int count = 0;
    for (std::size_t i = length; i < n; ++i) {
      const double error = motion_error(d.samples[i - length], d.samples[i], truth);
      if (error < 0) continue;
      sum[length] += error;
      ++count;
    }
    sum[length] /= std::max(1, count);
  }
  return sum;
}

struct Tally {
  int runs = 0, wrong_runs = 0, wrong = 0, ok = 0;
};

void judge(const RecordedSequence& drive_of, const std::string& what, const Driven& d,
           const std::array<double, kFrames + 1>& normal, Tally* tally) {
  int ok = 0, wrong = 0, wrong_over_all = 0, lost = 0;
  std::size_t first_wrong = 0;
  double most = 0;
  std::size_t posed_since = 0, ok_since = 0;  // indices of the first sample of the run
  for (std::size_t i = 0; i < d.samples.size(); ++i) {
    const PoseSample& s = d.samples[i];
    if (s.status == PoseStatus::lost) posed_since = i + 1, ++lost;
    if (s.status != PoseStatus::ok) {
      ok_since = i + 1;
      continue;
    }
    ++ok;
    const auto times = [&](std::size_t since) {
      const std::size_t from = std::max(since, i < kFrames ? 0 : i - kFrames);
      return from == i ? 0.0 : motion_error(d.samples[from], s, drive_of.truth) / normal[i - from];
    };
    const double claimed = times(ok_since);
    most = std::max(most, claimed);
    if (claimed > kTimes && wrong++ == 0) first_wrong = i;
    wrong_over_all += times(posed_since) > kTimes ? 1 : 0;
  }
  ++tally->runs;
  tally->ok += ok;
  tally->wrong += wrong;
  tally->wrong_runs += wrong > 0 ? 1 : 0;
  fmt::print("{:12s} {:46s} frames {:3d} ok {:3d} lost {:3d} knocks {}  most {:4.1f}",
             drive_of.name, what, d.samples.size(), ok, lost, d.knocks, most);
  if (wrong_over_all > 0) fmt::print("  over 20 {}", wrong_over_all);
  if (wrong > 0) fmt::print("  WRONG {} from {}", wrong, first_wrong);
  fmt::print("\n");
  std::fflush(stdout);
}

void run(const RecordedSequence& d, const std::string& filter, bool events, Tally* tally) {
  const app::Configuration c = app::load_configuration(std::nullopt, {});
  const StartingCalibration given = app::replayed_calibration(c, d.sequence, false);
  StartingCalibration own = given;
  const app::DriveCalibration found =
      app::calibrate_drive({d.sequence, c, 0, d.sequence.pairs.size(), {}, {}}, given);
  if (found.rig) own.file.rig = *found.rig;
  const auto normal = normal_errors(drive(d.sequence, c, own), d.truth);
  fmt::print("{:12s} normal error over {} frames: {:.3f} m\n", d.name, kFrames, normal[kFrames]);
  for (const HonestyVariant& v : honesty_variants()) {
    if (v.name.find(filter) == std::string_view::npos) continue;
    const test::TemporaryFolder folder;
    const app::StereoSequence s = spoil(d, v, folder.path());
    const std::string name(v.name);
    judge(d, name + ", given", drive(s, c, given, events), normal, tally);
    if (found.rig) judge(d, name + ", own", drive(s, c, own, events), normal, tally);
    judge(d, name + ", from scratch", drive(s, c, test::blank(given), events), normal, tally);
  }
}

}  // namespace
}  // namespace vergence::bench

/// honesty_bench [DRIVE|all] [part of a variant's name] [events]
int main(int argc, char** argv) {
  using namespace vergence;
  const std::string drive = argc > 1 ? argv[1] : "all", filter = argc > 2 ? argv[2] : "";
  bench::Tally tally;
  for (const char* name : test::kRecordedSequences) {
    if (drive != "all" && drive != name) continue;
    const auto d = test::open_recorded(name);
    if (!d) {
      fmt::print("{}: VERGENCE_SHARED has no such data\n", name);
      continue;
    }
    bench::run(*d, filter, argc > 3, &tally);
  }
  fmt::print("{} runs, {} poses ok, {} of them wrong, in {} runs\n", tally.runs, tally.ok,
             tally.wrong, tally.wrong_runs);
  return tally.wrong > 0 ? EXIT_FAILURE : EXIT_SUCCESS;
}
