#include "app/report/calibration_findings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "app/report/advice.hpp"

namespace vergence::app::report {
namespace {

/// Rejected because the one in use is as good: no reason for doubt.
bool fits_as_well(const CalibrationRow& rejected) {
  constexpr double kBetter = 0.9;  // of the held-out error before: clearly better
  return rejected.held_out_before_px > 0 &&
         rejected.held_out_after_px > kBetter * rejected.held_out_before_px;
}

/// What the causes of accepted calibrations ask for.
void advise_on_causes(const Session& s, Findings* j) {
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

}  // namespace

void judge_mistake(const Session& s, const Analysis& a, Findings* j) {
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

void judge_focal_length(const Session& s, Findings* j) {
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

void judge_calibration(const Session& s, const Usability& use, Findings* j) {
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

void judge_verification(const Session& s, const Analysis& a, const Usability& use, Findings* j) {
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

void advise_on_events(const Session& s, Findings* j) {
  const auto first = [&s](std::string_view kind) {
    return std::find_if(s.events.begin(), s.events.end(),
                        [kind](const Event& e) { return e.kind == kind; });
  };
  if (const auto event = first("calibration_not_kept"); event != s.events.end())
    j->advise("A calibration was not kept: " + event->sentence + ".");
  if (const auto event = first("calibration_contradicted"); event != s.events.end()) {
    j->find(Grade::care, "the calibration given is not that of the rig");
    j->advise("During the drive " + event->sentence +
              ": keep the calibration.yaml of this session, if the drive has confirmed it.");
  }
  if (const auto event = first("scale_disagrees"); event != s.events.end()) {
    j->find(Grade::care, "lengths disagree with the INS");
    j->advise("At some time " + event->sentence + ".");
  }
}

}  // namespace vergence::app::report
