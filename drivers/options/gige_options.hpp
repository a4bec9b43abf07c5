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

/// Options of GigE Vision cameras. Ranges and meaning: option_table().
struct Options {
  int packet_size = 0;                                // bytes; 0: computed
  Duration packet_delay = Duration::nanoseconds(-1);  // negative: computed
  int link_mbps = 0;                                  // Mbit/s; 0: what the system says
  int link_cameras = 0;                               // 0: CameraConfiguration::sharing
  Resend resend = Resend::automatic;
  int socket_buffer_kb = 0;    // KiB; 0: eight frames, at least 4 MiB
  int buffers = 12;            // slots
  std::string line = "Line1";  // input of the hardware trigger, the camera's own name
  TriggerEdge edge = TriggerEdge::rising;
  bool stamp_at_end = false;
  bool ptp = false;
  std::vector<std::pair<std::string, std::string>>
      features{};  // of the camera, by its own names, last
};

/// The table behind drivers/gige/README.md.
[[nodiscard]] const OptionTable<Options>& option_table();

}  // namespace vergence::gige
