#include <algorithm>
#include <iterator>
#include <sstream>
#include <string_view>

#include <fmt/format.h>

#include "core/math/random.hpp"
#include "tests/system/faults/fault_drive.hpp"

/// The faults that the table and the random drives are made of.
namespace vergence::test {
namespace {

/// Time in s at which the calibration is verified.
constexpr double kAt = 9;

/// A fault without its times.
struct Kind {
  const char* name;
  /// Kind of the fault, as `--fault` takes it before the @.
  const char* what;
  /// Parameters other than duration_s.
  const char* parameters;
  /// Duration in s; 0 for a fault that is injected once and stays.
  double seconds;
  /// Words of FaultCase::said.
  const char* said;
  /// Time in s within which poses are permanently `ok` again: the pairing is verified, and so is
  /// the calibration.
  double recovers = 3;
};

const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all{
      {"one camera disconnected", "camera_gone", "camera=1", 3,
       "camera_disconnected camera_reconnected no_image"},
      {"both cameras disconnected", "camera_gone", "camera=-1", 3,
       "camera_disconnected camera_reconnected"},
      {"both cameras blink", "camera_gone", "camera=-1", 0.1,
       "camera_disconnected camera_reconnected"},
      {"INS disconnected", "ins_gone", "", 3, "ins_timeout ins_recovered"},
      {"no fix", "no_fix", "", 5, "ins_no_fix ins_recovered"},
      {"INS position jumps", "position_jump", "east_m=100", 3, "ins_jump"},
      {"trigger board disconnected", "board_gone", "", 3,
       "trigger_board_disconnected trigger_board_reconnected"},
      {"trigger board disconnected, pulses continue", "board_gone", "powered=1", 3,
       "trigger_board_disconnected trigger_board_reconnected"},
      {"board restarts", "board_reboot", "", 0.5, "trigger_board_restarted"},
      {"knock", "knock", "camera=1 pitch_deg=0.2", 0, "rig_changed recalibrating", 4},
      {"one lens covered", "cover", "camera=1", 3, "image_no_contrast"},
      {"both lenses covered", "cover", "camera=-1", 3, "image_no_contrast"},
      {"night", "night", "", 5, "image_no_contrast"},
      {"tunnel", "night", "factor=0.1", 5, "weak_geometry"},
      {"exposure stuck, too bright", "exposure", "factor=6", 5, "few_inliers"},
      {"one side dark", "exposure", "camera=1 factor=0.1", 5, ""},
      {"30 % of the frames lost", "lose_frames", "share=0.3", 5, "no_image"},
      {"30 % of the frames late", "late_frames", "share=0.3", 5, "no_image"},
      {"30 % of the frames twice", "duplicate_frames", "share=0.3", 5,
       "/devices/camera0_duplicate /devices/camera1_duplicate"},
      {"pairs broken", "break_pairs", "share=1", 3, "no_image"},
      {"one camera a frame late", "lag", "camera=1", 3, "out_of_sync cameras_in_sync", 5},
      {"cables exchanged", "swap_cables", "", 3, "cameras_swapped rig_changed", 9},
      {"three triggers missed", "missed_trigger", "camera=1 pulses=3", 0, "no_image"},
      {"a camera's clock set", "time_jump", "camera=1 jump_s=1", 0, "no_image"},
      {"the INS's clock set", "time_jump", "camera=-1 jump_s=1", 0, "/devices/clock_resets"},
      {"a bus in the way", "occluder", "", 5, "no_pose map_reset", 9},
      {"disk full", "disk_full", "", 3, "disk_full disk_recovered"},
      {"recalibration requested", "recalibrate", "", 0, "rig_changed recalibrating", 6},
  };
  return all;
}

std::string fault_of(const Kind& kind, double at_s) {
  std::string fault = fmt::format("{}@{:g}", kind.what, at_s);
  if (kind.seconds > 0) fault += fmt::format(" duration_s={:g}", kind.seconds);
  if (*kind.parameters != '\0') fault += fmt::format(" {}", kind.parameters);
  return fault;
}

void add(const Kind& kind, double at_s, FaultCase* c) {
  const bool first = c->faults.empty();
  c->faults.push_back(fault_of(kind, at_s));
  c->from_s = first ? at_s : std::min(c->from_s, at_s);
  c->until_s = std::max(c->until_s, at_s + kind.seconds);
  c->recovers_within_s = std::max(c->recovers_within_s, kind.recovers);
  // Two seconds are more than twenty frames.
  c->duration_s = c->until_s + c->recovers_within_s + 2;
}

}  // namespace

const std::vector<FaultCase>& single_faults() {
  static const std::vector<FaultCase> all = [] {
    std::vector<FaultCase> cases;
    std::vector<Kind> alone = kinds();
    // Not one of kinds(): a seed of random drives stands for the same faults as before.
    Kind left = alone.front();
    left.name = "the left camera disconnected", left.parameters = "camera=0";
    alone.insert(alone.begin() + 1, left);
    for (const Kind& kind : alone) {
      FaultCase c{.name = kind.name};
      std::istringstream said(kind.said);
      c.said.assign(std::istream_iterator<std::string>(said), {});
      // The end of a lag neither verifies the calibration in use nor contradicts it.
      if (std::string_view(kind.what) == "lag")
        c.unsaid = {"calibration_verified", "calibration_contradicted"};
      add(kind, kAt, &c);
      cases.push_back(c);
    }
    return cases;
  }();
  return all;
}

const std::vector<FaultCase>& long_faults() {
  static const std::vector<FaultCase> all = [] {
    FaultCase stand;
    stand.name = "standing 10 minutes";
    stand.more = "--set mock.drive=straight --set mock.stop_s=600";
    // A minute at the start, then 240 m.
    stand.from_s = 80, stand.until_s = 690;
    stand.duration_s = stand.until_s + 12;
    stand.recovers_within_s = 5;
    FaultCase stall{.name = "disk stalled", .system = "VERGENCE_STALL='12 3'"};
    stall.said = {"faulty_system: a write waits"};
    stall.from_s = 9, stall.until_s = 15, stall.duration_s = 20, stall.recovers_within_s = 2.5;
    return std::vector{stand, stall};
  }();
  return all;
}

std::vector<FaultCase> fault_pairs() {
  std::vector<FaultCase> cases;
  for (std::size_t i = 0; i < kinds().size(); ++i) {
    for (std::size_t j = i + 1; j < kinds().size(); ++j) {
      FaultCase c{.name = fmt::format("{}; {}", kinds()[i].name, kinds()[j].name)};
      add(kinds()[i], kAt, &c);
      add(kinds()[j], kAt + 1, &c);
      cases.push_back(c);
    }
  }
  return cases;
}

FaultCase random_faults(std::uint64_t seed) {
  Random random(seed, 24);
  FaultCase c{.name = fmt::format("seed {}", seed)};
  const std::uint32_t count = 1 + random.below(4);
  for (std::uint32_t i = 0; i < count; ++i) {
    Kind kind = kinds()[random.below(static_cast<std::uint32_t>(kinds().size()))];
    if (kind.seconds > 0) kind.seconds = std::max(0.05, kind.seconds * random.uniform(0, 1.5));
    kind.seconds = static_cast<double>(static_cast<int>(kind.seconds * 1000)) / 1000;
    add(kind, static_cast<double>(1000 + random.below(13'000)) / 1000, &c);
  }
  // The calibration is verified at 6 s.
  c.duration_s = std::max(c.duration_s, 12.0);
  return c;
}

}  // namespace vergence::test
