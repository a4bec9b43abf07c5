#pragma once
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

/// Fault injected at a time of the drive. Parameters that a kind does not use are zero.
struct Fault {
  FaultKind kind = FaultKind::knock;
  /// Time since the start of the drive.
  Duration at{};
  /// Zero lasts to the end.
  Duration duration{};
  /// −1 means every camera.
  int camera = -1;
  /// Rotation in rad about the camera's x (pitch), y (yaw) and z (roll). For `occluder` only z is
  /// used, about the vertical.
  Vec3 turn = Vec3::Zero();
  /// Translation in m along the camera's x, y, z. For `position_jump` east, north, up; for
  /// `occluder` forward, left, 0.
  Vec3 shift = Vec3::Zero();
  /// Speed in m/s along its own length, relative to the vehicle.
  double speed = 0;
  /// Factor of the brightness.
  double factor = 1;
  /// Share of the frames, 0 to 1.
  double share = 0;
  /// Delay in s.
  double delay = 0;
  /// Step of the clock in s.
  double jump = 0;
  /// Number of consecutive pulses.
  int pulses = 0;
  /// True if the device has its own supply.
  bool powered = false;

  [[nodiscard]] bool active(Duration time) const noexcept {
    return time >= at && (duration <= Duration{} || time < at + duration);
  }
  [[nodiscard]] bool concerns(int k) const noexcept { return camera < 0 || camera == k; }
};

/// Parameter of a fault kind; documented in docs/simulated_rig.md.
struct FaultParameter {
  /// The name ends in its unit: _deg, _m, _s.
  const char* name;
  /// Default value.
  double fallback;
  double least, most;
  const char* meaning;
};
struct FaultRow {
  FaultKind kind;
  const char* name;
  const char* meaning;
  std::span<const FaultParameter> parameters;
};

/// All implemented kinds, in the order of FaultKind.
[[nodiscard]] std::span<const FaultRow> fault_rows() noexcept;
[[nodiscard]] std::string_view to_string(FaultKind) noexcept;

/// Makes a fault from its kind, time in seconds and parameters. Throws std::invalid_argument with a
/// message fragment about the problem.
[[nodiscard]] Fault make_fault(const std::string& kind, double at_s,
                               const std::vector<std::pair<std::string, double>>& parameters);

/// Parses a text such as `knock@42 camera=1 pitch_deg=0.2`. Throws as make_fault() does.
[[nodiscard]] Fault parse_fault(std::string_view text);

/// Table of faults in docs/simulated_rig.md.
[[nodiscard]] std::string fault_document();

}  // namespace vergence::mock
