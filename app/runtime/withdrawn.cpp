#include "app/runtime/withdrawn.hpp"

#include <algorithm>
#include <array>

namespace vergence::app {
namespace {

using Kind = Withdrawn::Kind;

constexpr std::array kTable{
    Withdrawn{Kind::key, "record.raw",
              "device bytes are no longer recorded; record.images and record.ins hold all that a "
              "replay reads"},
    Withdrawn{Kind::key, "record.roll_s", "files are split by size alone; set record.roll_mb"},
    Withdrawn{Kind::key, "odometry.min_corner_score",
              "corners are chosen by rank within the image"},
    Withdrawn{Kind::key, "odometry.nearest_baselines",
              "disparities are searched up to the image's width"},
    Withdrawn{Kind::key, "odometry.match_zncc", "matches are accepted by consistency"},
    Withdrawn{Kind::key, "odometry.max_gap_s",
              "gaps are measured in the intervals of the sequence itself"},
    Withdrawn{Kind::record_topic, "raw",
              "device bytes are no longer recorded; images and ins hold all that a replay reads"},
    Withdrawn{Kind::key, "record.image_format", "images are recorded as they are"},
    Withdrawn{Kind::key, "record.memory_mb", "six seconds of images wait for the disk"},
    Withdrawn{Kind::key, "sessions.quota_mb",
              "remove old session folders by systemd-tmpfiles or cron (docs/session.md)"},
    Withdrawn{Kind::option, "run --also",
              "poses.csv has latitude, longitude and height of every frame; see docs/session.md"},
    Withdrawn{Kind::option, "replay --also",
              "poses.csv has latitude, longitude and height of every frame; see docs/session.md"},
    Withdrawn{Kind::option, "replay --through-devices",
              "a replay reads the recorded frames and INS samples, and gives the same poses"},
    Withdrawn{Kind::command, "completion",
              "'vergence --help' and 'vergence COMMAND --help' list commands and options"},
    Withdrawn{
        Kind::command, "manual",
        "man pages are part of the Debian package; 'vergence COMMAND --help' prints the same"},
};

}  // namespace

std::span<const Withdrawn> withdrawn() { return kTable; }

std::string why_withdrawn(Kind kind, std::string_view name) {
  const auto* row = std::find_if(kTable.begin(), kTable.end(), [&](const Withdrawn& w) {
    return w.kind == kind && w.name == name;
  });
  return row == kTable.end() ? "" : "; it was removed: " + std::string(row->instead);
}

}  // namespace vergence::app
