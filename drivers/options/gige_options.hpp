#pragma once
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/types/time.hpp"
#include "drivers/options/option_table.hpp"

namespace vergence::gige {

enum class Resend : std::uint8_t { automatic, on, off };
enum class TriggerEdge : std::uint8_t { rising, falling };

/// Options of GigE Vision cameras. option_table() has ranges and meaning.
struct Options {
  /// In bytes; 0: computed.
  int packet_size = 0;
  /// Negative: computed.
  Duration packet_delay = Duration::nanoseconds(-1);
  /// In Mbit/s; 0: as reported by the system.
  int link_mbps = 0;
  /// 0: CameraConfiguration::sharing.
  int link_cameras = 0;
  Resend resend = Resend::automatic;
  /// In KiB; 0: eight frames, at least 4 MiB.
  int socket_buffer_kb = 0;
  /// Number of slots.
  int buffers = 12;
  /// Input of the hardware trigger, by the camera's own name.
  std::string line = "Line1";
  TriggerEdge edge = TriggerEdge::rising;
  bool stamp_at_end = false;
  bool ptp = false;
  /// Further features by the camera's own names, applied last.
  std::vector<std::pair<std::string, std::string>> features{};
};

/// Options documented in drivers/gige/README.md.
[[nodiscard]] const OptionTable<Options>& option_table();

}  // namespace vergence::gige
