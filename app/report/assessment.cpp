#include "app/report/assessment.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "app/report/svg.hpp"

namespace vergence::app::report {

namespace {

/// Advice about frames with a reason, indexed by Reason.
constexpr std::array kAdvice{
    "",
    "A camera delivered no image: check its cable, its power and the trigger line.",
    "Images without structure: clean the lenses, take covers off, set exposure and gain.",
    "An image came twice, from one camera or as left and right: check the directories or topics, "
    "links, buffers and the trigger rate.",
    "Too little texture: raise the exposure; check for fog, rain or dirt on the lenses.",
    "Left and right do not fit this calibration: check for directories of different sequences, an "
    "inverted T_camera_left (X_camera = R X_left + t), distortion set for rectified images, wrong "
    "intrinsics, or cameras that do not expose together.",
    "Left and right are swapped, or T_camera_left is inverted: X_camera = R X_left + t.",
    "Few points constrained the poses, or none fitted well: check the images for dirt or blur.",
    "One camera did not support the pose: check its images for dirt, blur or wrong exposure.",
    "Tracking failed: a shorter exposure or a higher frame rate helps in fast turns.",
    "Frames are missing: check cables, trigger and the disk's speed; the events state when.",
    "The motion across a gap was extrapolated: do not use distances across it.",
    "The points constrained the pose poorly, as in tunnels, open fields and next to walls.",
    "Much of the image moved independently: check those parts of the path before use.",
    "The calibration in use is not verified: turns and near objects at the roadside verify it.",
    "The rig did not fit its calibration: look for a camera that was knocked or is loose. If it "
    "never fitted, check the supplied calibration: T_camera_left or its rotation may be inverted, "
    "or the intrinsics belong to unrectified images.",
    "No calibration was available yet: do not use these poses for measurements.",
    "A camera's images are of another instant: check trigger lines and exposure.",
    "The calibration cannot be estimated at standstill: drive past objects at the roadside.",
    "The calibration needs near objects: drive past houses, cars or trees.",
    "Too few matches between the cameras to calibrate: check lenses and exposure.",
    "Pulses, counters and stamps contradicted each other: check trigger lines and board.",
};
static_assert(kAdvice.size() == std::tuple_size_v<Analysis::ByReason>);

/// Kinds of the events about frames of a recording that were not read.
constexpr std::array<std::string_view, 6> kSkipped{"stamp_not_increasing", "stamp_outlier",
                                                   "image_missing",        "image_truncated",
                                                   "image_size",           "image_unreadable"};
constexpr const char* kSkippedAdvice =
    "The events name the files: check them, or copy the recording again.";

/// A drive of so many moving frames can confirm its calibration: 36 with a calibration given, 54
/// from scratch (docs/calibration.md).
inline constexpr std::size_t kFramesToVerify = 60;

/// Reasons that time alone may end.
bool is_waiting(Reason reason) {
  return reason == Reason::unverified_calibration || reason == Reason::uncalibrated ||
         reason == Reason::needs_motion || reason == Reason::needs_near_structure ||
         reason == Reason::needs_texture;
}

struct Main {
  std::string_view word{};
  std::size_t frames = 0;
  const char* advice = "";
};

// Duration in s. The motion across a shorter gap is extrapolated.
constexpr double kLong = 2.0;
// Duration in s of frames that are in transit when a device disconnects.
constexpr double kLag = 1.0;

/// Outages of one device: how many, and how long.
struct Outages {
  std::size_t count = 0;
  // Durations of the outages that ended.
  double seconds = 0, longest_s = 0;
  // Start of an outage that never ended.
  std::optional<Stamp> open{};
};

/// By device, from the events camera_disconnected, camera_reconnected, trigger_board_disconnected
/// and trigger_board_reconnected.
std::map<std::string, Outages> outages_of(std::span<const Event> events) {
  std::map<std::string, Outages> all;
  for (const Event& e : events) {
    const bool begins = e.kind == "camera_disconnected" || e.kind == "trigger_board_disconnected";
    if (!begins && e.kind != "camera_reconnected" && e.kind != "trigger_board_reconnected")
      continue;
    // `camera 1` of `camera 1 is disconnected; …`.
    Outages& o =
        all[e.kind.starts_with("trigger_board") ? "the trigger board"
                                                : e.message.substr(0, e.message.find(" is "))];
    if (begins && !o.open) {
      ++o.count;
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

/// Rejected because the one in use is as good: no reason for doubt.
bool fits_as_well(const CalibrationRow& rejected) {
  // Fraction of the earlier held-out error below which a result is clearly better.
  constexpr double kBetter = 0.9;
  return rejected.held_out_before_px > 0 &&
         rejected.held_out_after_px > kBetter * rejected.held_out_before_px;
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
constexpr double kFewOverBudget = 0.01;
constexpr double kPercent = 100.0;

std::string percent(double share) {
  return fmt::format("{:.{}f} %", share * kPercent, share < 0.0995 ? 1 : 0);
}

std::string capitalised(std::string text) {
  text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  return text;
}

/// The assessment of one session; each function adds what it finds.
class Assessor {
 public:
  Assessor(const Session& session, const Analysis& analysis)
      : s_(session), a_(analysis), all_(analysis.read + analysis.skipped) {}

  Assessment assess() {
    const std::map<std::string, Outages> outages = outages_of(s_.events);
    assess_outages(outages);
    assess_focal_length();
    if (a_.read > 0 || outages.empty()) assess_frames();
    if (a_.source != ErrorSource::none) assess_drift();
    assess_calibration();
    // A session without frames needs no further evaluation.
    if (a_.read > 0) assess_verification();
    advise_on_events();
    assess_session();
    if (a_.source == ErrorSource::none && a_.read > 0) assess_drift();
    advise_by_reasons();
    return finish();
  }

 private:
  /// `advice`: what to do about it; may be empty.
  void find(Grade grade, const std::string& reason, const std::string& advice = "") {
    reasons_[static_cast<std::size_t>(grade)].push_back(reason);
    out_.grade = std::max(out_.grade, grade);
    if (!advice.empty()) advise(advice);
  }
  void advise(const std::string& message) { out_.advice.push_back(message); }
  /// No pose can be relied on. The first call has the main reason.
  void give_up(const std::string& reason, const std::string& advice) {
    out_.usable = false;
    if (out_.main_reason.empty()) out_.main_reason = reason + (advice.empty() ? "" : ". " + advice);
  }

  [[nodiscard]] std::size_t count(std::string_view kind) const {
    return static_cast<std::size_t>(std::ranges::count(s_.events, kind, &Event::kind));
  }
  [[nodiscard]] bool any_accepted() const {
    return std::ranges::any_of(s_.calibrations, &CalibrationRow::accepted);
  }
  [[nodiscard]] std::string since_start(Stamp stamp) const {
    const Stamp first = s_.frames.empty() ? stamp : s_.frames.front().stamp;
    return duration_text(seconds_between(first, std::max(first, stamp)), 0.1);
  }

  /// The reason of most frames that are not ok; one that is no waiting goes before, where it is
  /// that of a quarter of them or more. Of frames that were not read, the kind of most events.
  [[nodiscard]] Main main_reason() const {
    // The entries are for events that do not wait and for those that do.
    std::array<Main, 2> most{};
    for (std::size_t i = 1; i < a_.by_reason.size(); ++i) {
      const auto reason = static_cast<Reason>(i);
      Main& main = most[is_waiting(reason) ? 1 : 0];
      if (a_.by_reason[i] > main.frames) main = {to_string(reason), a_.by_reason[i], kAdvice[i]};
    }
    Main main =
        4 * most[0].frames >= a_.read || most[0].frames > most[1].frames ? most[0] : most[1];
    for (const std::string_view kind : kSkipped)
      if (const std::size_t n = count(kind); n > main.frames) main = {kind, n, kSkippedAdvice};
    return main;
  }

  /// Frames that a calibration can be verified from: those that moved.
  [[nodiscard]] std::size_t moving_frames() const {
    // Fraction of the baseline. The EuRoC excerpt moves by 0.12 baselines per frame.
    constexpr double kStep = 0.1;
    const double least = kStep * number_at(s_.summary, "calibration.baseline_m").value_or(0);
    if (!(least > 0)) return a_.read;
    std::size_t count = 0;
    for (std::size_t i = 1; i < a_.distance_m.size(); ++i)
      if (a_.distance_m[i] - a_.distance_m[i - 1] >= least) ++count;
    return count;
  }

  /// Why no calibration was accepted; empty if one was, or there was no attempt.
  [[nodiscard]] std::string rejection() const {
    const auto last = std::find_if(s_.calibrations.rbegin(), s_.calibrations.rend(),
                                   [](const auto& c) { return !c.kept && !c.reason.empty(); });
    return any_accepted() || last == s_.calibrations.rend() ? "" : last->reason;
  }

  /// No frame is ok. Returns true if that is because the run ended before it could verify its
  /// calibration.
  [[nodiscard]] bool ended_early() const {
    const auto waiting =
        static_cast<std::size_t>(std::ranges::count_if(s_.frames, [](const Frame& f) {
          return f.status == PoseStatus::degraded && is_waiting(f.reason);
        }));
    return waiting > 0 && waiting == a_.degraded && moving_frames() < kFramesToVerify &&
           a_.lost <= a_.read / 10 && a_.skipped <= a_.read;
  }

  void assess_frames() {
    if (std::ranges::none_of(s_.frames, &Frame::posed) && (a_.read == 0 || a_.ok > 0))
      return find(Grade::bad, "no frame has a pose");
    if (a_.ok == 0) {
      unverified_ = ended_early();
      if (!unverified_) return assess_no_ok_frame();
      find(Grade::care, fmt::format("unverified: the run ended after {} frames; verifying the "
                                    "calibration takes about {} frames in motion",
                                    a_.read, kFramesToVerify));
    }
    const auto all = static_cast<double>(all_);
    const double lost = static_cast<double>(a_.lost + a_.skipped) / all,
                 degraded = static_cast<double>(a_.degraded - a_.waited) / all;
    if (lost > kFewLost)
      find(lost > kManyLost ? Grade::bad : Grade::care,
           fmt::format("{} of the frames have no pose", percent(lost)));
    if (a_.ok > 0 && degraded > kFewDegraded)
      find(Grade::care, fmt::format("{} of the frames are degraded", percent(degraded)));
  }

  void assess_no_ok_frame() {
    const Main main = main_reason();
    const std::string rejected = rejection();
    std::string reason =
        a_.degraded > 0 ? fmt::format("none of {} frames is ok", all_) : "no frame has a pose";
    if (main.frames > 0)
      reason += fmt::format(": {} ({} of {} frames)", main.word, main.frames, all_);
    if (!rejected.empty()) reason += "; no calibration was found: " + rejected;
    find(Grade::bad, reason);
    give_up(reason, rejected.empty() ? main.advice : "");
  }

  /// A device that never came back ends the run or not; a long outage breaks the path.
  void assess_outages(const std::map<std::string, Outages>& outages) {
    const bool holes = !std::ranges::all_of(s_.frames, &Frame::posed) ||
                       std::ranges::find(a_.breaks, 1) != a_.breaks.end();
    for (const auto& [device, o] : outages) {
      const std::string was = device + " was disconnected";
      const Stamp end = s_.frames.empty() ? Stamp{} : s_.frames.back().stamp;
      if (o.open && s_.frames.empty())
        find(Grade::bad, "no frame was received: " + was);
      else if (o.open && (end <= *o.open || seconds_between(*o.open, end) <= kLag))
        find(Grade::bad, "no frame after " + since_start(std::max(*o.open, end)) + ": " + was);
      else if (o.open)
        find(Grade::care, was + " from " + since_start(*o.open) + " to the end");
      if (holes && o.longest_s > kLong)
        find(Grade::care, was + " for " + duration_text(o.longest_s, 0.1));
      broken_ = broken_ || (holes && (o.open || o.longest_s > kLong));
      advise(fmt::format("{} {}{}{}: check its cable and power.", capitalised(was),
                         o.count == 1 ? "once" : fmt::format("{} times", o.count),
                         o.seconds > 0 ? " for " + duration_text(o.seconds, 0.1) : "",
                         o.open ? ", to the end" : ""));
    }
  }

  /// A focal length that is not, or probably not, the one the images show: all distances are wrong
  /// by that ratio.
  void assess_focal_length() {
    const bool contradicted = flag_at(s_.summary, "calibration.focal_length.contradicted") == true;
    if (!contradicted && flag_at(s_.summary, "calibration.focal_length.doubted") != true) return;
    const auto metric = [&](const char* key) {
      return number_at(s_.summary, std::string("calibration.focal_length.") + key).value_or(0);
    };
    const double sigma = metric("sigma_px");
    const std::string measured =
        sigma > 0 ? fmt::format("{:.0f} ± {:.0f} px", metric("measured_px"), sigma)
                  : fmt::format("{:.0f} px or even further off", metric("measured_px"));
    const std::string reason = fmt::format(
        "the configured focal length, {:.0f} px, is {} by the images, which give {}; distances are "
        "wrong by the same ratio",
        metric("configured_px"), contradicted ? "contradicted" : "not supported", measured);
    constexpr const char* kFix =
        "Set the focal length in pixels of these images (cameras.N.intrinsics or --focal); "
        "resizing, cropping or rectification changes it.";
    find(contradicted ? Grade::bad : Grade::care, reason, kFix);
    if (contradicted) give_up(reason, kFix);
  }

  /// The last measurement at the depth where a rig of that baseline is evaluated, if the depth is
  /// known well there.
  [[nodiscard]] const CalibrationRow* known_well_near() const {
    // Depth error in percent that is rated `good`.
    constexpr double kKnown = 2.0;
    // Depth in m at which the rating is evaluated.
    constexpr double kFar = 20;
    const auto last = std::find_if(
        s_.calibrations.rbegin(), s_.calibrations.rend(),
        [](const auto& c) { return (c.accepted || c.kept) && std::isfinite(c.reference_depth_m); });
    const bool known = last != s_.calibrations.rend() && last->reference_depth_m < kFar &&
                       last->depth_sigma_percent <= kKnown;
    return known ? &*last : nullptr;
  }

  /// Evaluates its uncertainty and the last attempt.
  void assess_calibration() {
    const std::string rating = text_at(s_.summary, "calibration.rating");
    const CalibrationRow* near = known_well_near();
    if (rating == "poor" && near != nullptr)
      find(Grade::care, fmt::format("the baseline is short: depths are accurate to {:.1f} % at "
                                    "{:.1f} m, but not at 20 m",
                                    near->depth_sigma_percent, near->reference_depth_m));
    else if (rating == "poor")
      find(Grade::bad, "the calibration is too uncertain (rating: poor)",
           text_at(s_.summary, "calibration.limited_by") == "intrinsics"
               ? "The calibration is limited by focal lengths or principal points: calibrate the "
                 "intrinsics with a target; driving on does not help."
               : "The calibration is weak: drive turns with near and far structure in view, or "
                 "calibrate with a target.");
    else if (rating == "fair")
      find(Grade::care, "the calibration is only fair");
    // A run that begins with a calibration has a row of it; a foreign session has no count.
    if (s_.calibrations.empty() && !number_at(s_.summary, "calibration.accepted")) return;
    // Online measurements are no attempts to replace the calibration in use.
    const auto last = std::find_if(s_.calibrations.rbegin(), s_.calibrations.rend(),
                                   [](const CalibrationRow& c) { return !c.kept; });
    if (!any_accepted()) {
      if (a_.ok > 0 || a_.read == 0) find(Grade::care, "no calibration was found");
      advise("No calibration was found: drive past objects near and far; see calibrations.csv.");
    } else if (last != s_.calibrations.rend() && !last->accepted && !fits_as_well(*last)) {
      find(Grade::care, "the last calibration was rejected",
           last->reason.empty() ? "" : "The last calibration was rejected: " + last->reason + ".");
    }
    for (const char* cause : {"knock", "collapse", "drift"})
      if (std::ranges::any_of(s_.calibrations,
                              [&](const auto& c) { return c.accepted && c.cause == cause; }))
        advise(
            fmt::format("The rig changed ({}) and was recalibrated: check for a mount that was "
                        "knocked, works loose or warms up before the next run.",
                        cause));
  }

  /// Evaluates whether the calibration was verified.
  void assess_verification() {
    // The summary of a truncated session has no value.
    const bool never_verified = !s_.summary.is_object() && a_.waited > 0 && !a_.verified_s;
    if (!any_accepted() || flag_at(s_.summary, "calibration.verified").value_or(!never_verified))
      return;
    if (flag_at(s_.summary, "calibration.online") == false)
      return find(Grade::care, "the calibration is not verified (calibration.online: off)",
                  "The rig was not monitored: set calibration.online: on to verify the calibration "
                  "while driving.");
    if (!unverified_)
      find(Grade::care, a_.verified_s ? "the calibration in use at the end is not verified"
                                      : "the calibration was never verified");
    advise(
        "The calibration was not verified: drive turns past near objects, and check whether image "
        "corners have no tracks (dirt, bonnet, sky).");
  }

  /// Findings from events about calibrations and lengths.
  void advise_on_events() {
    using Finding = std::array<const char*, 3>;
    for (const auto& [kind, reason, advice] :
         {Finding{"calibration_save_failed", "", "A calibration was not saved: {}."},
          Finding{"calibration_contradicted", "the initial calibration does not fit the rig",
                  "Event calibration_contradicted: {}. Use the calibration.yaml of this session if "
                  "it is verified."},
          Finding{"scale_disagrees", "lengths disagree with the INS",
                  "Event scale_disagrees: {}."}}) {
      const auto event = std::ranges::find(s_.events, kind, &Event::kind);
      if (event == s_.events.end()) continue;
      advise(fmt::format(fmt::runtime(advice), event->message));
      if (*reason != 0) find(Grade::care, reason);
    }
  }

  void assess_drift() {
    if (a_.ins_unplaced)
      return find(Grade::care, "drift unknown: no ENU alignment with the INS",
                  "The alignment needs comparison.alignment_distance_m (100 m) with a valid fix: "
                  "drive further, or set it lower.");
    if (a_.source == ErrorSource::none) {
      find(Grade::care, "drift unknown: no reference");
      return advise(
          "To measure drift, record with an INS, or compare with ground truth: vergence evaluate "
          "SESSION REFERENCE.");
    }
    if (!a_.drift)
      find(Grade::care, "the path is too short to measure drift");
    else if (*a_.drift > kGoodDrift)
      find(*a_.drift > kWorstDrift ? Grade::bad : Grade::care,
           fmt::format("drift is {} of the distance travelled{}{}", percent(*a_.drift),
                       a_.source == ErrorSource::ins ? " against the INS" : "",
                       broken_ ? ", across outages" : ""));
    const double off = a_.scale ? std::abs(*a_.scale - 1) : 0;
    if (off > kGoodScale && !broken_)
      find(off > kWorstScale ? Grade::bad : Grade::care,
           fmt::format("lengths are {} too {}", percent(off), *a_.scale < 1 ? "long" : "short"),
           "Lengths disagree with the reference: measure the baseline again, then calibrate "
           "again.");
  }

  void assess_session() {
    if (!s_.missing.empty()) find(Grade::care, "session files are incomplete");
    if (!s_.summary.is_object() && !s_.missing.empty())
      advise(
          "The session was not closed: stop with Ctrl-C and wait for the last message; check power "
          "and the disk's free space.");
    const double lines = number_at(s_.summary, "drops.lines").value_or(0) +
                         number_at(s_.summary, "drops.records").value_or(0);
    if (lines > 0)
      find(Grade::care, fmt::format("{:.0f} lines were not written to disk", lines),
           "The disk was full or too slow: free space, or use a faster disk.");
    if (const double n = number_at(s_.summary, "runtime_allocations").value_or(0); n > 0)
      advise(fmt::format(
          "{:.0f} runtime allocations, which must not happen: please report it with this session.",
          n));
    const auto slow = std::ranges::count_if(
        s_.frames, [this](const Frame& f) { return f.estimate_ms * 1e-3 > a_.interval_s; });
    if (a_.interval_s > 0 &&
        static_cast<double>(slow) > kFewOverBudget * static_cast<double>(a_.read))
      advise(
          "More than 1 % of the frames took longer than the frame interval. A live run would omit "
          "work: lower trigger.rate or odometry.features.");
  }

  void advise_by_reasons() {
    for (const std::string_view kind : kSkipped)
      if (const std::size_t n = count(kind); n > 0)
        advise(
            fmt::format("{} ({} frame{} skipped): {}", kind, n, n == 1 ? "" : "s", kSkippedAdvice));
    for (std::size_t i = 1; i < a_.by_reason.size(); ++i) {
      // Frames that were doubted for a moment, or a calibration that was asked for, are no knock.
      if (static_cast<Reason>(i) == Reason::recalibrating && count("rig_changed") == 0) continue;
      if (const std::size_t n = a_.by_reason[i] - a_.waited_by_reason[i]; n > 0)
        advise(fmt::format("{} ({} frame{}): {}", to_string(static_cast<Reason>(i)), n,
                           n == 1 ? "" : "s", kAdvice[i]));
    }
  }

  /// The worst reasons first.
  Assessment finish() {
    for (auto same = reasons_.rbegin(); same != reasons_.rend(); ++same)
      out_.reasons.insert(out_.reasons.end(), same->begin(), same->end());
    out_.message =
        out_.reasons.empty()
            ? fmt::format("every check passed: drift {} over {:.0f} m, {} of {} frames ok{}",
                          percent(a_.drift.value_or(0)), a_.path_m, a_.ok, all_,
                          a_.waited > 0
                              ? fmt::format(", {} before the calibration was verified", a_.waited)
                              : "")
            : fmt::format("{}", fmt::join(out_.reasons, "; "));
    out_.message = capitalised(out_.message) + ".";
    return std::move(out_);
  }

  const Session& s_;
  const Analysis& a_;
  // Number of frames, including those that were not read.
  const std::size_t all_;
  // True if poses are missing within a long outage, so that the path length means little.
  bool broken_ = false;
  // True if the run ended before it could verify its calibration.
  bool unverified_ = false;
  // Reasons, indexed by Grade.
  std::array<std::vector<std::string>, 3> reasons_;
  Assessment out_;
};

}  // namespace

const char* advice_for(Reason reason) noexcept {
  return kAdvice.at(static_cast<std::size_t>(reason));
}

const char* spaced(Grade grade) noexcept {
  constexpr std::array kTexts{"Good", "Usable with care", "Do not use"};
  return kTexts.at(static_cast<std::size_t>(grade));
}

Assessment assess(const Session& session, const Analysis& analysis) {
  return Assessor(session, analysis).assess();
}

}  // namespace vergence::app::report
