#include "app/runtime/withdrawn.hpp"

#include <algorithm>
#include <array>

namespace vergence::app {
namespace {

using Kind = Withdrawn::Kind;

constexpr std::string_view kNoLine =
    "the mock's devices have no serial line; drivers on simulated lines are part of the tests";

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
    Withdrawn{Kind::key, "ins.sync_in",
              "SyncIn stays as the device has it; set it with the maker's program"},
    Withdrawn{Kind::key, "mock.ins_line", kNoLine},
    Withdrawn{Kind::key, "mock.ins_latency_timer_ms", kNoLine},
    Withdrawn{Kind::key, "mock.ins_late_percent", kNoLine},
    Withdrawn{Kind::key, "mock.ins_late_ms", kNoLine},
    Withdrawn{Kind::key, "mock.board_line", kNoLine},
    Withdrawn{Kind::key, "mock.board_latency_timer_ms", kNoLine},
    Withdrawn{Kind::key, "mock.board_late_percent", kNoLine},
    Withdrawn{Kind::key, "mock.board_late_ms", kNoLine},
    Withdrawn{Kind::camera_option, "chunks",
              "a frame's exposure is the one that the camera held when it began"},
    Withdrawn{Kind::camera_option, "packet_socket", "images come by UDP"},
    Withdrawn{Kind::camera_option, "frame_retention_ms",
              "a frame waits for three of its intervals"},
    Withdrawn{Kind::camera_option, "trigger_overlap", "set feature.TriggerOverlap"},
    Withdrawn{Kind::camera_option, "trigger_delay_us", "set feature.TriggerDelay"},
    Withdrawn{Kind::camera_option, "exposure_mode", "set feature.ExposureMode"},
    Withdrawn{Kind::camera_option, "exposure_line",
              "set feature.LineSelector, feature.LineMode and feature.LineSource"},
    Withdrawn{Kind::camera_option, "heartbeat_ms", "set feature.GevHeartbeatTimeout"},
    Withdrawn{Kind::record_topic, "raw",
              "device bytes are no longer recorded; images and ins hold all that a replay reads"},
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
