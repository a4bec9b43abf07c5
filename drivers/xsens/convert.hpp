#pragma once
#include <array>
#include <optional>

#include "drivers/ins.hpp"
#include "firmware_iface/xbus/xbus.hpp"

namespace vergence::xsens {

/// Quaternion x y z w, sensor → ENU, of one w x y z, sensor → `frame`; normalised. Nothing: it is
/// none.
///   NWU: q_enu = (√½, 0, 0, √½) ⊗ q      x north becomes y
///   NED: q_enu = (0, √½, √½, 0) ⊗ q      x and y change places, z turns over
/// The sensor's own axes are those printed on its housing in every frame; how it is mounted is the
/// boresight's affair.
[[nodiscard]] std::optional<std::array<double, 4>> enu_attitude(const std::array<double, 4>& wxyz,
                                                                xbus::LocalFrame frame) noexcept;
/// The same of roll, pitch, yaw in degrees, and of a rotation matrix row by row.
[[nodiscard]] std::array<double, 4> quaternion_of_euler(
    const xbus::Three& roll_pitch_yaw_deg) noexcept;  // → w x y z
[[nodiscard]] std::array<double, 4> quaternion_of_matrix(
    const std::array<double, 9>& rows) noexcept;  // → w x y z
[[nodiscard]] std::array<double, 3> enu_vector(const xbus::Three& v,
                                               xbus::LocalFrame frame) noexcept;

/// The receiver's newest word about its fix.
struct Receiver {
  bool known = false;
  HostStamp received{};
  std::uint8_t fix = 0;  // as GnssPvt
  std::uint8_t satellites = 0;
  float position_dop = 0;
  double position_sigma = 0, height_sigma = 0,
         velocity_sigma = 0;  // m, m, m/s, each axis; 0: not told
};
[[nodiscard]] Receiver receiver_of(const xbus::GnssPvt& pvt, HostStamp received) noexcept;
[[nodiscard]] Receiver receiver_of(const xbus::LegacyFix& fix, std::uint8_t status,
                                   HostStamp received) noexcept;

/// Fills attitude, velocity, position, fix, sigmas and quality; number and times are the caller's.
/// Absent fields stay invalid. A receiver's word older than kReceiverStale is not used.
inline constexpr Duration kReceiverStale = Duration::seconds(3);
void fill(const xbus::Mtdata2& data, const Receiver& receiver, HostStamp now,
          InsReading* reading) noexcept;
void fill(const xbus::Mtdata& data, const Receiver& receiver, HostStamp now,
          InsReading* reading) noexcept;

}  // namespace vergence::xsens
