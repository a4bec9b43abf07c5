#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/types/time.hpp"

namespace vergence::gige {

/// CameraConfiguration::options, understood.
struct Options {
  int packet_size = 0;                                // bytes; 0: computed
  Duration packet_delay = Duration::nanoseconds(-1);  // negative: computed
  std::int64_t link_speed = 0;                        // bit/s; 0: what the system says
  int link_cameras = 0;                               // 0: CameraConfiguration::sharing
  bool packet_socket = false;
  enum class Resend : std::uint8_t { automatic, on, off } resend = Resend::automatic;
  Duration frame_retention{};      // 0: 3 frame periods, 60 to 100 ms
  std::int64_t socket_buffer = 0;  // bytes; 0: eight frames, at least 4 MiB
  int buffers = 12;                // slots
  std::string line = "Line1", edge = "rising", overlap;
  double trigger_delay_us = 0;
  std::string exposure_mode = "timed", exposure_line;
  bool stamp_at_end = false;
  bool ptp = false;
  bool chunks = true;    // where the camera has them
  int heartbeat_ms = 0;  // 0: the camera's own
  std::vector<std::pair<std::string, std::string>>
      features;  // of the camera, by its own names, last
};

/// Empty: understood. Else the sentence: which name or value, and what there is.
[[nodiscard]] std::string parse_options(const std::map<std::string, std::string>& given,
                                        Options* options);

}  // namespace vergence::gige
