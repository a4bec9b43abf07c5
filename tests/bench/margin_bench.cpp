// How far the decisions of the online calibration are from their bounds, on all recorded drives.
//
//   margin_bench [--only DRIVE] [--set KEY=VALUE]     six minutes
//
// Every statistic is divided by its bound: 1 decides. "Quiet" are the drives as they are and with
// disturbances that are not a fault of the rig, given the published calibration and the one found
// from the drive; their largest value is the nearest to a false alarm. "Faults" are the same drives
// with a fault that the decision must report; the smallest of their largest values within
// kFaultFrames of the fault is the nearest to a miss. A decision ends what is measured, so a
// sequential test hardly exceeds 1 there: its margin is the number of frames, which is printed,
// too.
#include <cstdio>
#include <cstdlib>

#include <fmt/format.h>

#include "app/session/drive_calibration.hpp"
#include "core/estimator/estimator.hpp"
#include "tests/bench/integrity_variants.hpp"
#include "tests/support/quantile.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::bench {
namespace {

using app::StartingCalibration;
using test::quantile;

// Frames after a fault within which it must be decided on.
constexpr std::size_t kFaultFrames = 30;

enum Decision : std::size_t { change, jump, lag, uncertainty, verified, contradicted, kDecisions };
constexpr std::array<const char*, kDecisions> kNames = {"knock or drift, from epipolar distances",
                                                        "knock, from a jump of disparities",
                                                        "camera a frame late",
                                                        "unusually uncertain motion",
                                                        "calibration verified",
                                                        "calibration contradicted"};
constexpr unsigned bit(Decision d) { return 1U << d; }

/// A perturbation, the decisions of which one must follow from it, and those that must not.
struct Case {
  std::string_view variant;
  unsigned must = 0, must_not = 0;
  // The fault begins in the middle of the drive, else with its first frame.
  bool half_way = false;
};

constexpr unsigned kKnock = bit(change) | bit(jump);
constexpr unsigned kAlarms = kKnock | bit(lag) | bit(contradicted);
constexpr std::array kCases = {
    Case{"untouched", bit(verified), kAlarms | bit(uncertainty)},
    Case{"every second pair", 0, kAlarms},
    Case{"JPEG 20", 0, kAlarms},
    Case{"one frame 2.5 rows off", 0, kAlarms},
    Case{"pitch 0.3° half-way", kKnock, bit(lag), true},
    Case{"roll 0.5° half-way", kKnock, bit(lag), true},
    Case{"yaw 0.3° half-way", kKnock, bit(lag), true},
    Case{"right one frame late half-way", bit(lag), kKnock, true},
    Case{"yaw 0.3° from the start", bit(contradicted), bit(verified)},
};

const IntegrityVariant* find(std::string_view name) {
  for (const auto& all : {integrity_variants(), time_variants()})
    for (const IntegrityVariant& v : all)
      if (v.name == name) return &v;
  return nullptr;
}

/// Values of one run, one of each frame or decision, and the frame that it is of.
struct Value {
  std::size_t frame;
  double value;
};
using Run = std::array<std::vector<Value>, kDecisions>;

Run run(const app::StereoSequence& s, const app::Configuration& c,
        const StartingCalibration& begin) {
  Run r;
  std::size_t frame = 0;
  (void)app::drive_once({s, c, 0, s.pairs.size()}, begin,
                        [&](const Estimator& e, const PoseSample& /*sample*/) {
                          const DecisionMargins& m = e.margins();
                          r[change].push_back({frame, m.change});
                          r[jump].push_back({frame, m.jump});
                          r[lag].push_back({frame, m.lag});
                          r[uncertainty].push_back({frame, m.uncertainty});
                          for (const CalibrationDecision& d : e.calibrations()) {
                            r[verified].push_back({frame, d.certainty});
                            r[contradicted].push_back({frame, -d.certainty});
                          }
                          ++frame;
                        });
  return r;
}

Value largest(const std::vector<Value>& values, std::size_t from, std::size_t to) {
  Value most{from, 0};
  for (const Value& v : values)
    if (v.frame >= from && v.frame < to && v.value > most.value) most = v;
  return most;
}

/// What is known of one decision after all runs.
struct Summary {
  std::vector<double> quiet;
  double nearest_false = 0, nearest_miss = 1e9;
  std::string false_case = "–", miss_case = "–";
};

void add_quiet(const std::vector<Value>& values, std::size_t frames, const std::string& name,
               Summary* s) {
  for (const Value& v : values) s->quiet.push_back(v.value);
  const Value most = largest(values, 0, frames);
  if (most.value <= s->nearest_false) return;
  s->nearest_false = most.value;
  s->false_case = fmt::format("{}, frame {}", name, most.frame);
}

/// A fault counts for the decision that it shows in most.
void add_fault(const Run& r, const Case& of, std::size_t frames, const std::string& name,
               std::array<Summary, kDecisions>* all) {
  const std::size_t from = of.half_way ? frames / 2 : 0;
  Value most{from, -1};
  std::size_t shown = 0;
  for (std::size_t d = 0; d < kDecisions; ++d) {
    if ((of.must & bit(static_cast<Decision>(d))) == 0) continue;
    const Value v = largest(r[d], from, d < verified ? from + kFaultFrames : frames);
    if (v.value > most.value) most = v, shown = d;
  }
  Summary& s = (*all)[shown];
  if (of.must == 0 || most.value >= s.nearest_miss) return;
  s.nearest_miss = most.value;
  s.miss_case = fmt::format("{}, after {} frames", name, most.frame - from);
}

void add(const Run& r, const Case& of, std::size_t frames, const std::string& name,
         std::array<Summary, kDecisions>* all) {
  for (std::size_t d = 0; d < kDecisions; ++d)
    if ((of.must_not & bit(static_cast<Decision>(d))) != 0)
      add_quiet(r[d], frames, name, &(*all)[d]);
  add_fault(r, of, frames, name, all);
}

void run_drive(const test::RecordedSequence& drive, const app::Configuration& c,
               std::array<Summary, kDecisions>* all) {
  const StartingCalibration given = app::replayed_calibration(c, drive.sequence, false);
  StartingCalibration found = given;
  const auto calibrated =
      app::calibrate_drive({drive.sequence, c, 0, drive.sequence.pairs.size()}, given);
  if (calibrated.rig) found.file.rig = *calibrated.rig;
  for (const Case& of : kCases) {
    const test::TemporaryFolder folder;
    const app::StereoSequence s = spoil(drive, *find(of.variant), folder / "images");
    for (const bool own : {false, true}) {
      if (own && !calibrated.rig) continue;
      const std::string name =
          fmt::format("{}, {}, {}", drive.name, of.variant, own ? "found" : "given");
      const Run r = run(s, c, own ? found : given);
      add(r, of, s.pairs.size(), name, all);
      fmt::print(stderr, "{}:", name);
      for (std::size_t d = 0; d < kDecisions; ++d)
        fmt::print(stderr, " {:.2f}", largest(r[d], 0, s.pairs.size()).value);
      fmt::print(stderr, "\n");
    }
  }
}

void print(const std::array<Summary, kDecisions>& all) {
  fmt::print(
      "| decision | quiet: values | median | 99 % | largest | of | faults: smallest | of "
      "|\n|---|---|---|---|---|---|---|---|\n");
  for (std::size_t d = 0; d < kDecisions; ++d) {
    const Summary& s = all[d];
    const std::string miss = s.miss_case == "–" ? "–" : fmt::format("{:.2f}", s.nearest_miss);
    fmt::print("| {} | {} | {:.2f} | {:.2f} | {:.2f} | {} | {} | {} |\n", kNames[d], s.quiet.size(),
               quantile(s.quiet, 0.5), quantile(s.quiet, 0.99), s.nearest_false, s.false_case, miss,
               s.miss_case);
  }
}

}  // namespace
}  // namespace vergence::bench

int main(int argc, char** argv) {
  using namespace vergence;
  std::string only = "all";
  std::vector<std::string> set;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::string_view(argv[i]) == "--set") set.emplace_back(argv[i + 1]);
    if (std::string_view(argv[i]) == "--only") only = argv[i + 1];
  }
  try {
    const app::Configuration c = app::load_configuration(std::nullopt, set);
    std::array<bench::Summary, bench::kDecisions> all;
    if (test::for_recorded(test::kRecordedDrives, only, [&](test::RecordedSequence* drive) {
          bench::run_drive(*drive, c, &all);
        })) {
      bench::print(all);
      return EXIT_SUCCESS;
    }
  } catch (const std::exception& e) {
    fmt::print(stderr, "margin_bench: {}\n", e.what());
    return 2;
  }
  return 2;
}
