#pragma once
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "app/recorder/histogram.hpp"

/// How time was over a drive: what the block `time` of summary.json is made of.
namespace vergence::app {

/// One device's clock against the host's.
struct ClockFigures {
  std::string device;
  std::uint64_t stamps = 0;   // that were mapped
  double drift_ppm = 0;       // of the host's clock against it
  double error_us = 0;        // bound of a stamp's error at the end …
  double worst_error_us = 0;  // … and the worst, once the clock was known
  // Of a board that is asked for its time:
  struct Pings {
    std::uint64_t asked = 0, answered = 0;
    double rtt_least_us = 0, rtt_median_us = 0, rtt_most_us = 0;
    bool pps_locked = false;
    double pps_age_s = -1;  // negative: never seen
  };
  std::optional<Pings> pings{};
};

/// What became of one camera's frames and pulses.
struct CameraPairing {
  bool proven = true;
  std::uint64_t acquisitions = 0;
  std::vector<std::pair<const char*, std::uint64_t>> losses{};  // each class under its name
};

struct PairingFigures {
  std::string mode{}, sentence{};
  bool can_be_proven = false;
  double worst_acquisition_s = 0;
  std::uint64_t pauses = 0, pauses_refused = 0;
  std::vector<CameraPairing> cameras{};
  std::vector<std::pair<const char*, std::uint64_t>>
      sets{};  // that went out, and pulses, each class under its name
};

/// The session's stamps against the INS's UTC. They follow the host's clock as it was at the start.
struct UtcFigures {
  std::uint64_t readings = 0;  // with a valid UTC
  double host_ahead_s = 0;     // mean
  double least_s = 0, most_s = 0;
};
struct SatelliteFigures {
  std::uint64_t readings = 0, without_fix = 0;
  int least = 0, most = 0;  // satellites, where they are told
};

struct TimeFigures {
  std::vector<ClockFigures> clocks{};
  std::uint64_t clock_resets = 0;
  PairingFigures pairing{};
  std::vector<std::pair<const char*, std::uint64_t>> board{}, ins{};  // losses on their lines
  double worst_stamp_error_us = 0;                                    // of the sets' stamps
  TimeHistogram latency{};  // ms, from the middle of the exposure to the pose
  bool latency_is_virtual =
      false;  // --fast: the devices' part is what it would be, the estimator's what it was
  UtcFigures utc{};
  SatelliteFigures satellites{};
};

[[nodiscard]] nlohmann::ordered_json time_json(const TimeFigures& figures);

}  // namespace vergence::app
