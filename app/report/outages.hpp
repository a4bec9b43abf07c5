#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/report/analysis.hpp"
#include "app/report/findings.hpp"
#include "app/report/session.hpp"

namespace vergence::app::report {

/// Devices that gave nothing for a while, as the events camera_gone, camera_back, board_gone and
/// board_back say.
struct Outage {
  std::uint32_t devices = 0;  // bit k: camera k; kMaxCameras: the trigger board; the one above: a
                              // camera that its event does not name
  Stamp from{};
  std::optional<Stamp> to{};  // nothing: they never came back
};

/// By their begin; devices that went and came at once are one outage.
[[nodiscard]] std::vector<Outage> outages_of(std::span<const Event> events);

/// All outages of the same devices.
struct OutageSum {
  std::uint32_t devices = 0;  // as Outage
  std::size_t count = 0;
  Stamp from{};               // of the first
  std::optional<Stamp> to{};  // of the last; nothing: they never came back
  double seconds = 0;         // of those that ended
};
[[nodiscard]] std::vector<OutageSum> summed(std::span<const Outage> outages);

/// `camera 1 was gone`, `cameras 0, 1 were gone`, `the trigger board was gone`.
[[nodiscard]] std::string gone_sentence(std::uint32_t devices);

/// Frames or poses are missing within an outage: the way after it hangs on a guess, so that its
/// length says nothing of the rig.
[[nodiscard]] bool break_the_way(std::span<const Outage> outages, const Session& session,
                                 const Analysis& analysis);

/// What outages say against the drive, and for how long which devices were gone.
void judge_outages(std::span<const Outage> outages, const Session& session,
                   const Analysis& analysis, Findings* findings);

}  // namespace vergence::app::report
