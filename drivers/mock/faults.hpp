#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/math/se3.hpp"
#include "core/types/time.hpp"

namespace vergence::mock {

enum class FaultKind : std::uint8_t {
  knock,
  drift,
  recalibrate,
  lag,
  swap_cables,
  occluder,
  cover,
  night,
  exposure,
  camera_disconnected,
  lose_frames,
  late_frames,
  duplicate_frames,
  break_pairs,
  missed_trigger,
  board_disconnected,
  board_reboot,
  ins_disconnected,
  no_fix,
  position_jump,
  time_jump,
  disk_full,
};

/// Something that goes wrong at a time of the drive. Parameters that a kind does not have are zero.
struct Fault {
  FaultKind kind = FaultKind::knock;
  Duration at{};              // since the drive's start
  Duration duration{};        // zero: to the end
  int camera = -1;            // −1: every camera
  Vec3 turn = Vec3::Zero();   // rad about the camera's x (pitch), y (yaw), z (roll); of occluder: z
                              // alone, about the vertical
  Vec3 shift = Vec3::Zero();  // m along the camera's x, y, z; of position_jump: east, north, up; of
                              // occluder: ahead, to the left, 0
  double speed = 0;           // m/s, along its own length, relative to the vehicle
  double factor = 1;          // of the brightness
  double share = 0;           // of the frames, 0..1
  double delay = 0;           // s
  double jump = 0;            // s
  int pulses = 0;             // one after the other
  bool powered = false;       // it has a supply of its own

  [[nodiscard]] bool active(Duration time) const noexcept {
    return time >= at && (duration <= Duration{} || time < at + duration);
  }
  [[nodiscard]] bool concerns(int k) const noexcept { return camera < 0 || camera == k; }
};

/// Parameter of a fault kind; the table behind docs/simulated_rig.md.
struct FaultParameter {
  const char* name;  // its unit is its ending: _deg, _m, _s
  double fallback;   // when not given
  double least, most;
  const char* meaning;
};
struct FaultRow {
  FaultKind kind;
  const char* name;
  const char* meaning;
  std::span<const FaultParameter> parameters;
};

/// Every kind that acts, in the order of FaultKind.
[[nodiscard]] std::span<const FaultRow> fault_rows() noexcept;
[[nodiscard]] std::string_view to_string(FaultKind) noexcept;

/// A fault from its kind, time in seconds and parameters. Throws std::invalid_argument: half a
/// message about what is wrong.
[[nodiscard]] Fault make_fault(const std::string& kind, double at_s,
                               const std::vector<std::pair<std::string, double>>& parameters);

/// `knock@42 camera=1 pitch_deg=0.2`. Throws as make_fault().
[[nodiscard]] Fault parse_fault(std::string_view text);

/// The table of docs/simulated_rig.md.
[[nodiscard]] std::string fault_document();

}  // namespace vergence::mock
