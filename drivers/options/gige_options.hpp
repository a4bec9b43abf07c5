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
enum class TriggerOverlap : std::uint8_t { unset, off, readout, previous_frame };
enum class ExposureMode : std::uint8_t { timed, trigger_width };

/// What only GigE Vision cameras have. Ranges and meaning: option_table().
struct Options {
  int packet_size = 0;                                // bytes; 0: computed
  Duration packet_delay = Duration::nanoseconds(-1);  // negative: computed
  int link_mbps = 0;                                  // Mbit/s; 0: what the system says
  int link_cameras = 0;                               // 0: CameraConfiguration::sharing
  bool packet_socket = false;
  Resend resend = Resend::automatic;
  Duration frame_retention{};  // 0: 3 frame periods, 60 to 100 ms
  int socket_buffer_kb = 0;    // KiB; 0: eight frames, at least 4 MiB
  int buffers = 12;            // slots
  std::string line = "Line1";  // input of the hardware trigger, the camera's own name
  TriggerEdge edge = TriggerEdge::rising;
  TriggerOverlap overlap = TriggerOverlap::unset;  // unset: the camera's
  double trigger_delay_us = 0;
  ExposureMode exposure_mode = ExposureMode::timed;
  std::string exposure_line{};  // empty: none
  bool stamp_at_end = false;
  bool ptp = false;
  bool chunks = true;    // where the camera has them
  int heartbeat_ms = 0;  // 0: the camera's own
  std::vector<std::pair<std::string, std::string>>
      features{};  // of the camera, by its own names, last
};

/// The table behind docs/cameras/gige.md.
[[nodiscard]] const OptionTable<Options>& option_table();

}  // namespace vergence::gige
