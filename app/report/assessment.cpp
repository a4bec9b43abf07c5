#include "app/report/assessment.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "app/report/svg.hpp"

namespace vergence::app::report {

namespace {

constexpr std::array kPose{
    Advice{"no_image",
           "A camera delivered no image: check its cable, its power and the trigger line."},
    Advice{"image_no_contrast",
           "Images carried no structure: clean the lenses, take covers off, set exposure and gain "
           "for the light."},
    Advice{"image_repeated",
           "A camera sent an image twice: check its link, its buffers and its trigger rate."},
    Advice{"few_features",
           "Too little texture: raise the exposure; check for fog, rain or dirt on the lenses."},
    Advice{"no_stereo_matches",
           "Left and right do not fit this calibration: check for directories of different "
           "sequences, an inverted T_camera_left (X_camera = R X_left + t), distortion set for "
           "rectified images, wrong intrinsics, or cameras that do not expose together; "
           "--from-scratch estimates the transform."},
    Advice{"cameras_swapped",
           "Left and right are swapped, or T_camera_left is inverted: swap cables, directories or "
           "the order of the cameras; X_camera = R X_left + t."},
    Advice{"few_inliers",
           "Poses rested on few points: check the images at those times for dirt, blur or a "
           "covered lens."},
    Advice{"single_camera",
           "One camera did not support the pose: check its images for dirt, blur or a wrong "
           "exposure."},
    Advice{"no_pose",
           "Tracking failed: check the images at those times; a shorter exposure or a higher "
           "frame rate helps in fast turns."},
    Advice{
        "time_gap",
        "Frames are missing: check cables, trigger and the disk's speed; see the events for when."},
    Advice{"map_reset",
           "After a gap the motion across it was extrapolated: do not use distances that span it."},
    Advice{
        "weak_geometry",
        "The points constrained the pose poorly, or the window corrected it by much: expected in "
        "tunnels, open fields and next to walls; elsewhere check that the cameras are in sync."},
    Advice{"dynamic_scene",
           "Much of the image moved independently, for example a bus: compare those sections with "
           "the map before use."},
    Advice{"unverified_calibration",
           "The calibration in use was not verified yet, or no longer: turns and near objects at "
           "the roadside verify it."},
    Advice{"recalibrating",
           "The rig did not fit its calibration. If it did before, look for a camera that was "
           "knocked or is loose on its mount; if it never did, check the supplied calibration: "
           "T_camera_left or its rotation may be inverted, or the intrinsics belong to unrectified "
           "images."},
    Advice{"uncalibrated",
           "No calibration was available yet: do not use these poses for measurements."},
    Advice{"out_of_sync",
           "A camera's images were taken at another instant: check trigger lines and exposure, and "
           "restart the cameras together."},
    Advice{"needs_motion",
           "The calibration cannot be estimated at standstill: drive some metres past objects at "
           "the roadside."},
    Advice{"needs_near_structure",
           "The calibration cannot be estimated from distant objects only: drive past houses, cars "
           "or trees."},
    Advice{"needs_texture",
           "Too few matches between the cameras to estimate the calibration: check lenses and "
           "exposure."},
    Advice{"pairing_ambiguous",
           "Pulses, counters and stamps contradicted each other: check trigger lines, exposure and "
           "the trigger board; see the events."},
};

constexpr std::array kSkipped{
    Advice{"stamp_not_increasing",
           "The stamps of these frames do not increase: check the order of times.txt and of the "
           "files."},
    Advice{"stamp_outlier",
           "The stamps of these frames are later than those that follow: check these lines of "
           "times.txt."},
    Advice{"image_missing",
           "An image listed by the recording is missing: copy the directory again, or remove the "
           "pair on both sides."},
    Advice{
        "image_truncated",
        "An image file is truncated: copy it again; the disk may have been full during recording."},
    Advice{"image_size",
           "The size of an image differs from that of the calibration: remove images that do not "
           "belong to this sequence."},
    Advice{"image_unreadable",
           "An image could not be decoded: check the file; PNG, JPEG, BMP, PGM and PPM are "
           "supported."},
};

}  // namespace

std::span<const Advice> pose_advice() noexcept { return kPose; }

std::span<const Advice> skip_advice() noexcept { return kSkipped; }

std::string_view advice_for(std::string_view word) noexcept {
  for (const std::span<const Advice> table : {pose_advice(), skip_advice()})
    for (const Advice& advice : table)
      if (advice.word == word) return advice.message;
  return {};
}

namespace {

/// Returns true if a session has a usable pose.
enum class Use : std::uint8_t {
  ok,          // at least one frame is ok, or statuses are not known
  unverified,  // none is, because the drive ended before it could confirm its calibration
  nothing,     // none is, for other reasons, or for so long
};

struct Usability {
  Use use = Use::ok;
  std::string reason;  // half a message with counts; empty: ok
  std::string advice;  // what to do about the main reason; may be empty
};

/// A drive of so many moving frames can confirm its calibration: 36 with a calibration given, 54
/// from scratch (docs/calibration.md).
inline constexpr std::size_t kFramesToVerify = 60;

/// Reasons that time alone may end.
bool is_waiting(std::string_view reason) {
  constexpr std::array kWaiting{"unverified_calibration", "uncalibrated", "needs_motion",
                                "needs_near_structure", "needs_texture"};
  return std::find(kWaiting.begin(), kWaiting.end(), reason) != kWaiting.end();
}

struct Main {
  std::string_view word;
  std::size_t frames = 0;
};

/// The reason of most frames that are not ok; one that is no waiting goes before, where it is that
/// of a quarter of them or more. Of frames that were not read, the kind of most events.
Main main_reason(const Session& s, const Analysis& a) {
  std::array<Main, 2> most{};  // of those that do not wait, of those that do
  for (std::size_t i = 0; i < std::min(s.reasons.size(), a.by_reason.size()); ++i) {
    Main& main = most[is_waiting(s.reasons[i]) ? 1 : 0];
    if (!s.reasons[i].empty() && a.by_reason[i] > main.frames)
      main = {s.reasons[i], a.by_reason[i]};
  }
  Main main = 4 * most[0].frames >= a.read      ? most[0]
              : most[0].frames > most[1].frames ? most[0]
                                                : most[1];
  for (const Advice& skip : skip_advice()) {
    const auto count = static_cast<std::size_t>(std::count_if(
        s.events.begin(), s.events.end(), [&skip](const Event& e) { return e.kind == skip.word; }));
    if (count > main.frames) main = {skip.word, count};
  }
  return main;
}

/// Frames that a calibration can be confirmed from: those that moved. A vehicle that stands tells
/// nothing of its rig.
std::size_t moving_frames(const Session& s, const Analysis& a) {
  constexpr double kStep = 0.1;  // of the baseline; EuRoC's excerpt moves by 0.12 a frame
  const double least = kStep * number_at(s.summary, "calibration.baseline_m").value_or(0);
  if (!(least > 0)) return a.read;
  std::size_t count = 0;
  for (std::size_t i = 1; i < a.distance_m.size(); ++i)
    if (a.distance_m[i] - a.distance_m[i - 1] >= least) ++count;
  return count;
}

/// Why no calibration was taken, where the drive sought one in vain.
std::string_view rejection(const Session& s) {
  std::string_view why;
  for (const CalibrationRow& row : s.calibrations) {
    if (row.accepted) return {};
    if (!row.kept && !row.reason.empty()) why = row.reason;
  }
  return why;
}

Usability usability_of(const Session& s, const Analysis& a) {
  if (!a.ok_share || a.ok > 0) return {};
  std::size_t waiting = 0;
  for (const Frame& f : s.frames)
    if (f.status == PoseStatus::degraded && is_waiting(s.reasons[f.reason])) ++waiting;
  const std::string_view rejected = rejection(s);
  if (waiting > 0 && waiting == a.degraded && moving_frames(s, a) < kFramesToVerify &&
      a.lost <= a.read / 10 && a.skipped <= a.read)
    return {Use::unverified,
            fmt::format("unverified: the run ended after {} frames; verifying the calibration "
                        "takes about {} frames in motion",
                        a.read, kFramesToVerify),
            std::string(rejected)};
  const Main main = main_reason(s, a);
  const bool posed = a.degraded > 0;
  Usability u{Use::nothing, "", std::string(advice_for(main.word))};
  u.reason =
      posed ? fmt::format("none of {} frames is ok", a.read + a.skipped) : "no frame has a pose";
  if (main.frames > 0)
    u.reason += fmt::format(": {} ({} of {} frames)", main.word, main.frames, a.read + a.skipped);
  if (!rejected.empty()) {
    u.reason += fmt::format("; no calibration was found: {}", rejected);
    u.advice = "";
  }
  return u;
}

constexpr double kLong = 2.0;  // s: the motion across a shorter hole is carried on
constexpr double kLag = 1.0;   // s: frames that are under way when a device goes

/// Outages of one device: how many, and how long.
struct Outages {
  std::size_t count = 0;
  double seconds = 0, longest_s = 0;  // of those that ended
  Stamp first{};
  std::optional<Stamp> open{};  // it never came back
};

/// `camera 1` of `camera 1 is disconnected; …`.
std::string device_of(const Event& e) {
  if (e.kind.starts_with("trigger_board")) return "the trigger board";
  constexpr std::string_view kCamera = "camera ";
  const bool named = e.message.starts_with(kCamera) && e.message.size() > kCamera.size() &&
                     std::isdigit(static_cast<unsigned char>(e.message[kCamera.size()])) != 0;
  return named ? e.message.substr(0, kCamera.size() + 1) : "a camera";
}

std::string since_start(const Session& s, Stamp stamp) {
  const Stamp first = s.frames.empty() ? stamp : s.frames.front().stamp;
  return duration_text(seconds_between(first, std::max(first, stamp)), 0.1);
}

/// By device, from the events camera_disconnected, camera_reconnected, trigger_board_disconnected
/// and trigger_board_reconnected.
std::map<std::string, Outages> outages_of(std::span<const Event> events) {
  std::map<std::string, Outages> all;
  for (const Event& e : events) {
    const bool begins = e.kind == "camera_disconnected" || e.kind == "trigger_board_disconnected";
    if (!begins && e.kind != "camera_reconnected" && e.kind != "trigger_board_reconnected")
      continue;
    Outages& o = all[device_of(e)];
    if (begins && !o.open) {
      if (o.count++ == 0) o.first = e.stamp;
      o.open = e.stamp;
    } else if (!begins && o.open) {
      const double s = seconds_between(*o.open, std::max(*o.open, e.stamp));
      o.seconds += s;
      o.longest_s = std::max(o.longest_s, s);
      o.open.reset();
    }
  }
  return all;
}

/// A device that never came back.
void assess_open_outage(const std::string& device, Stamp from, const Session& s, Findings* j) {
  // Frames that were left out may be later.
  const bool last = s.left_out.empty() && (s.frames.empty() || s.frames.back().stamp <= from ||
                                           seconds_between(from, s.frames.back().stamp) <= kLag);
  if (s.frames.empty())
    j->find(Grade::bad, "no frame was received: " + device + " was disconnected");
  else if (last)
    j->find(Grade::bad, "no frame after " + since_start(s, std::max(from, s.frames.back().stamp)) +
                            ": " + device + " was disconnected");
  else
    j->find(Grade::care, device + " was disconnected from " + since_start(s, from) + " to the end");
}

/// Adds the findings about outages, with one piece of advice per device. Returns true if poses are
/// missing within a long outage, so that the path's length is no measure of the rig.
bool assess_outages(const std::map<std::string, Outages>& outages, const Session& s,
                    const Analysis& a, Findings* j) {
  const bool holes =
      std::any_of(s.frames.begin(), s.frames.end(), [](const Frame& f) { return !f.posed; }) ||
      std::find(a.breaks.begin(), a.breaks.end(), 1) != a.breaks.end();
  bool broken = false;
  for (const auto& [device, o] : outages) {
    if (o.open) assess_open_outage(device, *o.open, s, j);
    if (holes && o.longest_s > kLong)
      j->find(Grade::care, device + " was disconnected for " + duration_text(o.longest_s, 0.1));
    broken = broken || (holes && (o.open || o.longest_s > kLong));
    std::string text = device + " was disconnected";
    text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
    if (o.count > 1) text += fmt::format(" {} times", o.count);
    if (o.seconds > 0) text += " for " + duration_text(o.seconds, 0.1);
    if (!s.frames.empty()) text += " from " + since_start(s, o.first) + " on";
    j->advise(text + (o.open ? ", to the end" : "") + ": check its cable and power.");
  }
  return broken;
}

/// Rejected because the one in use is as good: no reason for doubt.
bool fits_as_well(const CalibrationRow& rejected) {
  constexpr double kBetter = 0.9;  // of the held-out error before: clearly better
  return rejected.held_out_before_px > 0 &&
         rejected.held_out_after_px > kBetter * rejected.held_out_before_px;
}

/// Advice for the causes of accepted calibrations.
void advise_on_causes(const Session& s, Findings* j) {
  constexpr std::array kCauses{
      Advice{"knock",
             "The rig was knocked and recalibrated: check the camera mount before the next run."},
      Advice{
          "collapse",
          "The rig was knocked hard and recalibrated: check the camera mount before the next run."},
      Advice{"drift",
             "The extrinsics drifted and were followed: check for a mount that warms up or works "
             "loose."}};
  for (const Advice& advice : kCauses)
    if (std::any_of(
            s.calibrations.begin(), s.calibrations.end(),
            [&advice](const CalibrationRow& c) { return c.accepted && c.cause == advice.word; }))
      j->advise(advice.message);
}

/// The last measurement by which the drive confirmed its calibration at the depth where a rig of
/// that baseline is judged, if it is known well there.
const CalibrationRow* known_well_near(const Session& s) {
  constexpr double kKnown = 2.0;  // %, the word `good`
  constexpr double kFar = 20;     // m, where the word is found
  const auto last =
      std::find_if(s.calibrations.rbegin(), s.calibrations.rend(), [](const CalibrationRow& c) {
        return (c.accepted || c.kept) && std::isfinite(c.reference_depth_m);
      });
  if (last == s.calibrations.rend() || !(last->reference_depth_m < kFar) ||
      !(last->depth_sigma_percent <= kKnown))
    return nullptr;
  return &*last;
}

/// A focal length that the drive itself measures to be another: all distances are off by as much.
void assess_focal_length(const Session& s, Findings* j) {
  if (flag_at(s.summary, "calibration.focal_length.contradicted") != true) return;
  const auto metric = [&](const char* key) {
    return number_at(s.summary, std::string("calibration.focal_length.") + key).value_or(0);
  };
  const double sigma = metric("sigma_px");
  const std::string measured =
      sigma > 0 ? fmt::format("{:.0f} ± {:.0f} px", metric("measured_px"), sigma)
                : fmt::format("{:.0f} px or even further off", metric("measured_px"));
  const std::string reason = fmt::format(
      "the configured focal length, {:.0f} px, is contradicted by the images, which give {}; "
      "distances are wrong by the same ratio",
      metric("configured_px"), measured);
  constexpr const char* kAdvice =
      "Set the focal length in pixels of these images (cameras.N.intrinsics or --focal); resizing, "
      "cropping or rectification changes it.";
  j->find(Grade::bad, reason);
  j->advise(kAdvice);
  j->give_up(reason, kAdvice);
}

/// Evaluates its uncertainty and the last attempt.
void assess_calibration(const Session& s, const Usability& use, Findings* j) {
  const std::string rating = text_at(s.summary, "calibration.rating");
  if (const CalibrationRow* near = known_well_near(s); near != nullptr && rating == "poor") {
    j->find(
        Grade::care,
        fmt::format(
            "the baseline is short: depths are accurate to {:.1f} % at {:.1f} m, but not at 20 m",
            near->depth_sigma_percent, near->reference_depth_m));
  } else if (rating == "poor") {
    j->find(Grade::bad, "the calibration is too uncertain (rating: poor)");
    j->advise(text_at(s.summary, "calibration.limited_by") == "intrinsics"
                  ? "The calibration is limited by focal lengths or principal points: calibrate "
                    "the intrinsics with a target; driving on does not help."
                  : "The calibration is weak: drive turns with near and far structure in view, or "
                    "calibrate with a target.");
  } else if (rating == "fair") {
    j->find(Grade::care, "the calibration is only fair");
  }
  // A drive that begins with a calibration has a row of it; a session of another make has no count.
  if (s.calibrations.empty() && !number_at(s.summary, "calibration.accepted")) return;
  if (std::none_of(s.calibrations.begin(), s.calibrations.end(),
                   [](const CalibrationRow& c) { return c.accepted; })) {
    if (use.use == Use::ok) j->find(Grade::care, "no calibration was found");
    j->advise(
        "No calibration was found: drive past objects near and far; calibrations.csv has the "
        "reason of each attempt.");
  } else {
    // Online measurements are no attempts to replace the calibration in use.
    const auto last = std::find_if(s.calibrations.rbegin(), s.calibrations.rend(),
                                   [](const CalibrationRow& c) { return !c.kept; });
    if (last != s.calibrations.rend() && !last->accepted && !fits_as_well(*last)) {
      j->find(Grade::care, "the last calibration was rejected");
      if (!last->reason.empty())
        j->advise("The last calibration was rejected: " + last->reason + ".");
    }
  }
  advise_on_causes(s, j);
}

/// Evaluates whether the calibration was verified.
void assess_verification(const Session& s, const Analysis& a, const Usability& use, Findings* j) {
  if (std::none_of(s.calibrations.begin(), s.calibrations.end(),
                   [](const CalibrationRow& c) { return c.accepted; }))
    return;
  const std::optional<bool> verified = flag_at(s.summary, "calibration.verified");
  const bool waited_in_vain = !s.summary.is_object() && a.waited > 0 &&
                              !a.verified_s;  // the summary of a torn session says nothing
  if (verified.value_or(!waited_in_vain)) return;
  if (flag_at(s.summary, "calibration.online") == false) {
    j->find(Grade::care, "the calibration is not verified (calibration.online: off)");
    j->advise(
        "The rig was not monitored: set calibration.online: on to verify the calibration while "
        "driving.");
    return;
  }
  if (use.use != Use::unverified)
    j->find(Grade::care, a.verified_s ? "the calibration in use at the end is not verified"
                                      : "the calibration was never verified");
  j->advise(
      "The calibration was not verified: drive turns past near objects, and check whether image "
      "corners have no tracks (dirt, bonnet, sky).");
}

/// Advice for events about calibrations and lengths.
void advise_on_events(const Session& s, Findings* j) {
  const auto first = [&s](std::string_view kind) {
    return std::find_if(s.events.begin(), s.events.end(),
                        [kind](const Event& e) { return e.kind == kind; });
  };
  if (const auto event = first("calibration_save_failed"); event != s.events.end())
    j->advise("A calibration was not saved: " + event->message + ".");
  if (const auto event = first("calibration_contradicted"); event != s.events.end()) {
    j->find(Grade::care, "the initial calibration does not fit the rig");
    j->advise("Event calibration_contradicted: " + event->message +
              ". Use the calibration.yaml of this session if it is verified.");
  }
  if (const auto event = first("scale_disagrees"); event != s.events.end()) {
    j->find(Grade::care, "lengths disagree with the INS");
    j->advise("Event scale_disagrees: " + event->message + ".");
  }
}

// Limits of drift, the same as those of the calibration rating: up to 2 % is good, beyond 5 %
// something is wrong with the rig.
constexpr double kGoodDrift = 0.02, kWorstDrift = 0.05;
// A length measured by the rig against the reference's; 2 % is where the comparison says
// scale_disagrees.
constexpr double kGoodScale = 0.02, kWorstScale = 0.05;
// Share of frames without a pose: a handful is a bump; a tenth are holes that no one can drive by.
constexpr double kFewLost = 0.002, kManyLost = 0.10;
constexpr double kFewDegraded = 0.05;
constexpr double kFewOverBudget = 0.01;  // the 99th percentile is what the summary keeps
constexpr double kPercent = 100.0;

std::string percent(double share) {
  return fmt::format("{:.{}f} %", share * kPercent, share < 0.0995 ? 1 : 0);
}

void assess_frames(const Session& s, const Analysis& a, const Usability& use, Findings* j) {
  const bool posed =
      std::any_of(s.frames.begin(), s.frames.end(), [](const Frame& f) { return f.posed; });
  if (!posed && (!a.ok_share || a.ok > 0)) return j->find(Grade::bad, "no frame has a pose");
  if (!a.ok_share) return j->find(Grade::care, "the status of the frames is not known");
  if (use.use != Use::ok) {
    j->find(use.use == Use::unverified ? Grade::care : Grade::bad, use.reason);
    if (use.use == Use::nothing) return j->give_up(use.reason, use.advice);
  }
  const auto all = static_cast<double>(a.read + a.skipped);
  const double lost = static_cast<double>(a.lost + a.skipped) / all,
               degraded = static_cast<double>(a.degraded - a.waited) / all;
  if (lost > kFewLost)
    j->find(lost > kManyLost ? Grade::bad : Grade::care,
            fmt::format("{} of the frames have no pose", percent(lost)));
  if (use.use == Use::ok && degraded > kFewDegraded)
    j->find(Grade::care, fmt::format("{} of the frames are degraded", percent(degraded)));
}

/// `broken`: outages broke the way.
void assess_drift(const Session& s, const Analysis& a, bool broken, Findings* j) {
  if (a.ins_unplaced) {
    j->find(Grade::care, "drift unknown: no ENU alignment with the INS");
    j->advise(
        "The alignment needs comparison.alignment_distance_m (100 m) with a valid fix: drive "
        "further, or set it lower.");
    return;
  }
  if (a.source == ErrorSource::none) {
    j->find(Grade::care, "drift unknown: no reference");
    // Two cameras alone cannot tell a wrong unit: everything is too long or too short alike.
    if (s.calibration)
      if (const std::string warning = baseline_warning(s.calibration->rig); !warning.empty()) {
        j->find(Grade::care, warning);
        j->advise(
            "Measure the baseline of the rig: all lengths are wrong by the same ratio as the "
            "baseline.");
      }
    j->advise(
        "To measure drift, record with an INS, or compare with ground truth: vergence evaluate "
        "SESSION REFERENCE.");
    return;
  }
  if (!a.drift)
    j->find(Grade::care, "the path is too short to measure drift");
  else if (*a.drift > kGoodDrift)
    j->find(*a.drift > kWorstDrift ? Grade::bad : Grade::care,
            fmt::format("drift is {} of the distance travelled{}{}", percent(*a.drift),
                        a.source == ErrorSource::ins ? " against the INS" : "",
                        broken ? ", across outages" : ""));
  const double off = a.scale ? std::abs(*a.scale - 1) : 0;
  if (off > kGoodScale && !broken) {
    j->find(off > kWorstScale ? Grade::bad : Grade::care,
            fmt::format("lengths are {} too {}", percent(off), *a.scale < 1 ? "long" : "short"));
    j->advise(
        "Lengths disagree with the reference: measure the baseline again, then calibrate again.");
  }
}

void assess_session(const Session& s, const Analysis& a, Findings* j) {
  if (!s.missing.empty()) j->find(Grade::care, "session files are incomplete");
  if (!s.left_out.empty())
    j->find(Grade::care,
            "the session is longer than the report reads: only its beginning is shown");
  if (!s.summary.is_object() && !s.missing.empty())
    j->advise(
        "The session was not closed: stop with Ctrl-C and wait for the last message; check power "
        "and the disk's free space.");
  const double lines = number_at(s.summary, "drops.lines").value_or(0) +
                       number_at(s.summary, "drops.records").value_or(0);
  if (lines > 0) {
    j->find(Grade::care, fmt::format("{:.0f} lines were not written to disk", lines));
    j->advise("The disk was full or too slow: free space, or use a faster disk.");
  }
  if (const auto allocations = number_at(s.summary, "runtime_allocations");
      allocations && *allocations > 0)
    j->advise(fmt::format(
        "{:.0f} runtime allocations, which must not happen: please report it with this session.",
        *allocations));
  const double p99 = number_at(s.summary, "timing_ms.p99").value_or(0) * 1e-3;
  const double slow =
      static_cast<double>(std::count_if(s.frames.begin(), s.frames.end(), [&a](const Frame& f) {
        return f.estimate_ms * 1e-3 > a.interval_s;
      }));
  if (a.interval_s > 0 &&
      (p99 > a.interval_s || slow > kFewOverBudget * static_cast<double>(a.read)))
    j->advise(
        "More than 1 % of the frames took longer than the frame interval; live, work would be "
        "dropped: lower trigger.rate or odometry.features.");
}

void advise_by_reasons(const Session& s, const Analysis& a, Findings* j) {
  for (const Advice& skip : skip_advice())
    if (const auto n = std::count_if(s.events.begin(), s.events.end(),
                                     [&skip](const Event& e) { return e.kind == skip.word; });
        n > 0)
      j->advise(fmt::format("{} ({} frame{} skipped): {}", skip.word, n, n == 1 ? "" : "s",
                            skip.message));
  const bool changed = std::any_of(s.events.begin(), s.events.end(),
                                   [](const Event& e) { return e.kind == "rig_changed"; });
  for (const Advice& advice : pose_advice()) {
    // Frames that were doubted for a moment, or a calibration that was asked for, are no knock.
    if (advice.word == std::string_view("recalibrating") && !changed) continue;
    const auto found = std::find(s.reasons.begin(), s.reasons.end(), advice.word);
    if (found == s.reasons.end()) continue;
    const auto i = static_cast<std::size_t>(found - s.reasons.begin());
    const std::size_t frames =
        a.by_reason[i] - (i < a.waited_by_reason.size() ? a.waited_by_reason[i] : 0);
    if (frames > 0)
      j->advise(fmt::format("{} ({} frame{}): {}", advice.word, frames, frames == 1 ? "" : "s",
                            advice.message));
  }
}

}  // namespace

void Findings::find(Grade grade, std::string reason) {
  found_.push_back({grade, std::move(reason)});
  assessment_.grade = std::max(assessment_.grade, grade);
}

void Findings::give_up(const std::string& reason, const std::string& advice) {
  assessment_.usable = false;
  if (assessment_.main_reason.empty())
    assessment_.main_reason = reason + (advice.empty() ? "" : ". " + advice);
}

Assessment Findings::assessment() const {
  std::vector<Found> sorted = found_;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Found& a, const Found& b) { return a.grade > b.grade; });
  Assessment assessment = assessment_;
  for (Found& f : sorted) assessment.reasons.push_back(std::move(f.reason));
  return assessment;
}

const char* to_words(Grade grade) noexcept {
  switch (grade) {
    case Grade::good:
      return "Good";
    case Grade::care:
      return "Usable with care";
    case Grade::bad:
      return "Do not use";
  }
  return "";
}

Assessment assess(const Session& session, const Analysis& analysis) {
  Findings j;
  const Usability use = usability_of(session, analysis);
  const std::map<std::string, Outages> outages = outages_of(session.events);
  const bool broken = assess_outages(outages, session, analysis, &j);
  assess_focal_length(session, &j);
  if (analysis.read > 0 || outages.empty()) assess_frames(session, analysis, use, &j);
  if (analysis.source != ErrorSource::none) assess_drift(session, analysis, broken, &j);
  assess_calibration(session, use, &j);
  // A session without frames needs no further evaluation.
  if (analysis.read > 0) assess_verification(session, analysis, use, &j);
  advise_on_events(session, &j);
  assess_session(session, analysis, &j);
  if (analysis.source == ErrorSource::none && analysis.read > 0)
    assess_drift(session, analysis, broken, &j);
  advise_by_reasons(session, analysis, &j);
  Assessment v = j.assessment();
  for (const std::string& reason : v.reasons) v.message += (v.message.empty() ? "" : "; ") + reason;
  if (v.reasons.empty())
    v.message =
        fmt::format("every check passed: drift of {} on a drive of {:.0f} m, {} of {} frames ok{}",
                    percent(analysis.drift.value_or(0)), analysis.path_m, analysis.ok,
                    analysis.read + analysis.skipped,
                    analysis.waited > 0
                        ? fmt::format(", {} before the calibration was verified", analysis.waited)
                        : "");
  v.message.front() =
      static_cast<char>(std::toupper(static_cast<unsigned char>(v.message.front())));
  v.message += '.';
  return v;
}

}  // namespace vergence::app::report
