#include "app/report/verdict.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include <fmt/format.h>

#include "app/report/advice.hpp"
#include "app/report/fit_pattern.hpp"
#include "app/report/usability.hpp"

namespace vergence::app::report {
namespace {

// Limits of drift, the same as of the depth error's words (METHOD §3): 2 % is good, beyond 5 %
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

/// Collects reasons; the grade is that of the worst.
class Judge {
 public:
  void find(Grade grade, std::string reason) {
    found_.push_back({grade, std::move(reason)});
    verdict_.grade = std::max(verdict_.grade, grade);
  }
  void advise(std::string sentence) { verdict_.advice.push_back(std::move(sentence)); }
  /// No pose can be relied on; the first reason stands.
  void give_up(const std::string& reason, const std::string& advice) {
    verdict_.usable = false;
    if (verdict_.main_reason.empty())
      verdict_.main_reason = reason + (advice.empty() ? "" : ". " + advice);
  }
  [[nodiscard]] Verdict finish() {
    std::stable_sort(found_.begin(), found_.end(),
                     [](const Found& a, const Found& b) { return a.grade > b.grade; });
    for (Found& f : found_) verdict_.reasons.push_back(std::move(f.reason));
    return std::move(verdict_);
  }

 private:
  struct Found {
    Grade grade;
    std::string reason;
  };
  std::vector<Found> found_;
  Verdict verdict_;
};

std::string percent(double share) {
  return fmt::format("{:.{}f} %", share * kPercent, share < 0.0995 ? 1 : 0);
}

void judge_frames(const Session& s, const Analysis& a, const Usability& use, Judge* j) {
  const bool posed =
      std::any_of(s.frames.begin(), s.frames.end(), [](const Frame& f) { return f.posed; });
  if (!posed && (!a.ok_share || a.ok > 0)) return j->find(Grade::bad, "there never was a pose");
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

void judge_drift(const Analysis& a, Judge* j) {
  if (a.ins_unplaced) {
    j->find(Grade::care,
            "nothing says how far it drifted: the drive was not placed on the earth with its INS");
    j->advise(
        "Errors are shown from comparison.placement_m (100 m) driven with a valid fix on: drive "
        "further, or set it lower.");
    return;
  }
  if (a.source == ErrorSource::none) {
    j->find(Grade::care, "nothing says how far it drifted: there was no reference");
    j->advise(
        "For a judgement of the drift record with an INS, or compare with a reference: vergence "
        "evaluate SESSION REFERENCE.");
    return;
  }
  if (!a.drift)
    j->find(Grade::care, "the drive is too short to measure its drift");
  else if (*a.drift > kGoodDrift)
    j->find(*a.drift > kWorstDrift ? Grade::bad : Grade::care,
            fmt::format("it drifts by {} of the distance{}", percent(*a.drift),
                        a.source == ErrorSource::ins ? " against the INS" : ""));
  const double off = a.scale ? std::abs(*a.scale - 1) : 0;
  if (off > kGoodScale) {
    j->find(
        off > kWorstScale ? Grade::bad : Grade::care,
        fmt::format("lengths come out {} too {}", percent(off), *a.scale < 1 ? "long" : "short"));
    j->advise(
        "Lengths disagree with the reference: measure the baseline again, then calibrate again.");
  }
}

/// A calibration written down in a way that the matches give away.
void judge_mistake(const Session& s, const Analysis& a, Judge* j) {
  struct Mistake {
    std::string_view word;
    const char *reason, *advice;
  };
  constexpr std::array kMistakes{
      Mistake{"rotation_transposed",
              "T_camera_left is inverted: the images fit its rotation transposed",
              "T_camera_left takes points of the left camera to the other one, X_camera = R X_left "
              "+ t; give R transposed and -R^T t of what "
              "stands there now."},
      Mistake{"already_rectified",
              "distortion is given for images that have none: they are rectified already",
              "Give distortion: [0, 0, 0, 0] for rectified images, with the focal length and "
              "principal point of the rectification."}};
  const std::string word = text_at(s.summary, "calibration.mistake");
  for (const Mistake& m : kMistakes) {
    if (word != m.word) continue;
    j->find(a.ok > 0 ? Grade::care : Grade::bad, m.reason);
    j->advise(m.advice);
    if (a.ok == 0) j->give_up(std::string(m.reason), m.advice);
  }
}

/// What matches far from their epipolar lines near the image's edges tell of the lenses.
void judge_lenses(const Session& s, const Analysis& a, Judge* j) {
  const Fit begin = fit_of(s, false), end = fit_of(s, true);
  const bool verified = flag_at(s.summary, "calibration.verified").value_or(false);
  const bool found_others =
      begin.pattern == FitPattern::lens &&
      a.ok > 0;  // the lens of the beginning; the poses since stand on another
  const Fit& fit = begin.pattern == FitPattern::lens ? begin : end;
  if (fit.pattern == FitPattern::fine || fit.pattern == FitPattern::unknown ||
      (verified && &fit == &end))
    return;
  const std::string grows = fmt::format(
      "residuals grow towards the edges of the image, from {:.1f} px in the middle to {:.1f} px",
      fit.middle_px, fit.edge_px);
  constexpr const char* kHelp =
      "Lens numbers: rectified images have distortion [0, 0, 0, 0], raw ones never; look whether "
      "model, order and image size are those of "
      "this lens. --calibrate-first finds the lens from the drive, vergence calibrate from a "
      "checkerboard.";
  if (fit.pattern == FitPattern::turned) {
    j->find(Grade::care, grows + ": a turn between the cameras, or the lens");
    return j->advise(
        "The calibration does not fit the images' edges: --calibrate-first finds a better one from "
        "the whole drive.");
  }
  j->advise(kHelp);
  if (found_others) {
    j->find(
        Grade::care,
        fmt::format(
            "the lens numbers given are wrong ({}); the drive found others{}", grows,
            a.confirmed_s ? fmt::format(" and confirmed them at {:.1f} s", *a.confirmed_s) : ""));
    return;
  }
  j->find(Grade::bad, grows + ": the lens");
  j->give_up(grows + ": the lens", kHelp);
}

/// A focal length that the drive itself measures to be another: all distances are off by as much.
void judge_focal_length(const Session& s, Judge* j) {
  if (flag_at(s.summary, "calibration.focal_length.contradicted") != true) return;
  const auto figure = [&](const char* key) {
    return number_at(s.summary, std::string("calibration.focal_length.") + key).value_or(0);
  };
  const double sigma = figure("sigma_px");
  const std::string measured =
      sigma > 0 ? fmt::format("{:.0f} ± {:.0f} px", figure("measured_px"), sigma)
                : fmt::format("{:.0f} px or still farther from it", figure("measured_px"));
  const std::string reason = fmt::format(
      "the focal length given, {:.0f} px, is not that of these images: the drive measures {}, and "
      "its distances are off by as much",
      figure("given_px"), measured);
  constexpr const char* kAdvice =
      "Give the focal length of this lens in pixels of these images (cameras.N.intrinsics, "
      "--focal): "
      "of another size of image, a crop or a rectification it is another.";
  j->find(Grade::bad, reason);
  j->advise(kAdvice);
  j->give_up(reason, kAdvice);
}

/// Whether the drive itself has confirmed what its poses stand on.
void judge_verification(const Session& s, const Analysis& a, const Usability& use, Judge* j) {
  if (std::none_of(s.calibrations.begin(), s.calibrations.end(),
                   [](const CalibrationRow& c) { return c.accepted; }))
    return;
  const std::optional<bool> verified = flag_at(s.summary, "calibration.verified");
  const bool waited_in_vain = !s.summary.is_object() && a.waited > 0 &&
                              !a.confirmed_s;  // the summary of a torn session says nothing
  if (verified.value_or(!waited_in_vain)) return;
  if (flag_at(s.summary, "calibration.online") == false) {
    j->find(Grade::care, "the calibration is not verified, nothing watched it");
    j->advise(
        "Nothing watched the rig: with calibration.online: on the drive itself confirms the "
        "calibration, or says that it is wrong.");
    return;
  }
  if (use.use != Use::unverified)
    j->find(Grade::care, a.confirmed_s ? "the calibration in use at the end is not verified"
                                       : "the drive has not confirmed its calibration");
  j->advise(
      "The drive did not show that its calibration is right: drive turns, past near things at the "
      "roadside, and look whether corners of "
      "the image stay without tracks (dirt, a bonnet, sky only).");
}

/// Rejected because the one in use is as good: no reason for doubt.
bool fits_as_well(const CalibrationRow& rejected) {
  constexpr double kBetter = 0.9;  // of the held-out error before: clearly better
  return rejected.held_out_before_px > 0 &&
         rejected.held_out_after_px > kBetter * rejected.held_out_before_px;
}

/// What the causes of accepted calibrations ask for.
void advise_on_causes(const Session& s, Judge* j) {
  constexpr std::array kCauses{
      Advice{"knock",
             "The rig was knocked during the drive and has been calibrated "
             "again: check the camera's mount before the next drive."},
      Advice{"collapse",
             "The rig was knocked hard during the drive and has been calibrated "
             "again: check the camera's mount before the next drive."},
      Advice{"drift",
             "The rig crept out of its calibration and was followed: look "
             "for a mount that warms up or works loose."}};
  for (const Advice& advice : kCauses)
    if (std::any_of(
            s.calibrations.begin(), s.calibrations.end(),
            [&advice](const CalibrationRow& c) { return c.accepted && c.cause == advice.word; }))
      j->advise(advice.sentence);
}

/// What events about calibrations and lengths ask for.
void advise_on_events(const Session& s, Judge* j) {
  const auto told = [&s](std::string_view kind) {
    return std::find_if(s.events.begin(), s.events.end(),
                        [kind](const Event& e) { return e.kind == kind; });
  };
  if (const auto event = told("calibration_not_kept"); event != s.events.end())
    j->advise("A calibration was not kept: " + event->sentence + ".");
  if (const auto event = told("calibration_contradicted"); event != s.events.end()) {
    j->find(Grade::care, "the calibration given is not that of the rig");
    j->advise("During the drive " + event->sentence +
              ": keep the calibration.yaml of this session, if the drive has confirmed it.");
  }
  if (const auto event = told("scale_disagrees"); event != s.events.end()) {
    j->find(Grade::care, "lengths disagree with the INS");
    j->advise("At some time " + event->sentence + ".");
  }
}

/// The last measurement by which the drive confirmed its calibration at the depth where a rig of
/// that baseline is judged, if it is known well there.
const CalibrationRow* known_well_near(const Session& s) {
  constexpr double kKnown = 2.0;  // %, the word `good`
  constexpr double kFar = 20;     // m, where the word is found
  const auto last =
      std::find_if(s.calibrations.rbegin(), s.calibrations.rend(), [](const CalibrationRow& c) {
        return (c.accepted || c.kept) && std::isfinite(c.judged_depth_m);
      });
  if (last == s.calibrations.rend() || !(last->judged_depth_m < kFar) ||
      !(last->depth_sigma_percent <= kKnown))
    return nullptr;
  return &*last;
}

void judge_calibration(const Session& s, const Usability& use, Judge* j) {
  const std::string word = text_at(s.summary, "calibration.word");
  if (const CalibrationRow* near = known_well_near(s); near != nullptr && word == "recalibrate") {
    j->find(Grade::care,
            fmt::format(
                "the baseline is short: depths are known to {:.1f} % at {:.1f} m, but not at 20 m",
                near->depth_sigma_percent, near->judged_depth_m));
  } else if (word == "recalibrate") {
    j->find(Grade::bad, "the calibration is too uncertain for depths");
    j->advise(text_at(s.summary, "calibration.limited_by") == "intrinsics"
                  ? "The calibration is weak because focal lengths or principal points are not "
                    "known better: calibrate the lenses on a "
                    "checkerboard; driving on does not help."
                  : "The calibration is weak: drive through a place with near and far structure "
                    "and some turns, or calibrate on a "
                    "checkerboard.");
  } else if (word == "can be improved") {
    j->find(Grade::care, "the calibration can be improved");
  }
  // A drive that begins with a calibration has a row of it; a session of another make has no count.
  if (s.calibrations.empty() && !number_at(s.summary, "calibration.accepted")) return;
  if (std::none_of(s.calibrations.begin(), s.calibrations.end(),
                   [](const CalibrationRow& c) { return c.accepted; })) {
    if (use.use == Use::ok) j->find(Grade::care, "no calibration was found");
    j->advise(
        "No calibration was found: drive past things at the roadside, near and far; "
        "calibrations.csv says what each attempt lacked.");
  } else {
    // What the drive measured while it went on was no attempt to replace the one in use.
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

void judge_session(const Session& s, const Analysis& a, Judge* j) {
  if (!s.missing.empty()) j->find(Grade::care, "the session's files are not whole");
  if (!s.summary.is_object() && !s.missing.empty())
    j->advise(
        "The session was not closed: stop with Ctrl-C and wait for the last message; check power "
        "and the disk's free space.");
  const double lines = number_at(s.summary, "drops.lines").value_or(0) +
                       number_at(s.summary, "drops.records").value_or(0);
  if (lines > 0) {
    j->find(Grade::care, fmt::format("{:.0f} lines did not get to the disk", lines));
    j->advise("The disk did not keep up or was full: make room, or record to a faster one.");
  }
  if (const auto allocations = number_at(s.summary, "allocations_after_seal");
      allocations && *allocations > 0)
    j->advise(fmt::format(
        "Memory was taken {:.0f} times during the drive, which must not happen: report it "
        "with this session.",
        *allocations));
  const double p99 = number_at(s.summary, "timing_ms.p99").value_or(0) * 1e-3;
  const double slow =
      static_cast<double>(std::count_if(s.frames.begin(), s.frames.end(), [&a](const Frame& f) {
        return f.estimate_ms * 1e-3 > a.interval_s;
      }));
  if (a.interval_s > 0 &&
      (p99 > a.interval_s || slow > kFewOverBudget * static_cast<double>(a.read)))
    j->advise(
        "More than one frame in a hundred took longer than the frame interval: live, work would be "
        "dropped; lower the rate or odometry's "
        "features.");
}

void advise_by_reasons(const Session& s, const Analysis& a, Judge* j) {
  for (const Advice& skip : skip_advice())
    if (const auto n = std::count_if(s.events.begin(), s.events.end(),
                                     [&skip](const Event& e) { return e.kind == skip.word; });
        n > 0)
      j->advise(fmt::format("{} ({} frame{} skipped): {}", skip.word, n, n == 1 ? "" : "s",
                            skip.sentence));
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
                            advice.sentence));
  }
}

}  // namespace

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

Verdict judge(const Session& session, const Analysis& analysis) {
  Judge j;
  const Usability use = usability_of(session, analysis);
  judge_mistake(session, analysis, &j);
  judge_focal_length(session, &j);
  judge_frames(session, analysis, use, &j);
  if (analysis.source != ErrorSource::none) judge_drift(analysis, &j);
  judge_calibration(session, use, &j);
  judge_lenses(session, analysis, &j);
  judge_verification(session, analysis, use, &j);
  advise_on_events(session, &j);
  judge_session(session, analysis, &j);
  if (analysis.source == ErrorSource::none) judge_drift(analysis, &j);
  advise_by_reasons(session, analysis, &j);
  Verdict v = j.finish();
  for (const std::string& reason : v.reasons)
    v.sentence += (v.sentence.empty() ? "" : "; ") + reason;
  if (v.reasons.empty())
    v.sentence = fmt::format(
        "every check passed: drift of {} on a drive of {:.0f} m, {} of {} frames ok{}",
        percent(analysis.drift.value_or(0)), analysis.path_m, analysis.ok,
        analysis.read + analysis.skipped,
        analysis.waited > 0
            ? fmt::format(", {} before the drive had confirmed its calibration", analysis.waited)
            : "");
  v.sentence.front() =
      static_cast<char>(std::toupper(static_cast<unsigned char>(v.sentence.front())));
  v.sentence += '.';
  return v;
}

}  // namespace vergence::app::report
