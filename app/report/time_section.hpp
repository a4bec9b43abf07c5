#pragma once
#include <string>

#include "app/report/session.hpp"

/// How time was over the drive, from the block `time` of summary.json.
namespace vergence::app::report {

struct TimeSection {
  std::string
      body{};  // what proves the pairs, clocks, losses; empty where the session has no such block
  std::string latency{};  // how long poses took from the exposure on, a whole <svg>; empty where
                          // none is known
  std::string caption{};  // of that
};

/// Whatever is missing or makes no sense is left out.
[[nodiscard]] TimeSection time_section(const Session& session);

}  // namespace vergence::app::report
