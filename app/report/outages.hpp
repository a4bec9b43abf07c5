#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/report/analysis.hpp"
#include "app/report/session.hpp"
#include "app/report/verdict.hpp"

namespace vergence::app::report {

/// A device that gave nothing for a while, by the events camera_gone, camera_back, board_gone and
/// board_back.
struct Outage {
  std::string device;  // `camera 1`, `the trigger board`
  Stamp from{};
  std::optional<Stamp> to{};  // nothing: it never came back
};

/// By their begin.
[[nodiscard]] std::vector<Outage> outages_of(std::span<const Event> events);

/// Returns true if frames or poses are missing within an outage: the way after it hangs on a guess,
/// so that its length says nothing of the rig.
[[nodiscard]] bool break_the_way(std::span<const Outage> outages, const Session& session,
                                 const Analysis& analysis);

/// What outages say against the drive, and for how long which devices were gone.
void judge_outages(std::span<const Outage> outages, const Session& session,
                   const Analysis& analysis, Findings* findings);

}  // namespace vergence::app::report
