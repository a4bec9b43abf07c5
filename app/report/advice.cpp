#include "app/report/advice.hpp"

#include <algorithm>
#include <array>

namespace vergence::app::report {
namespace {

constexpr std::array kPose{
    Advice{"no_image",
           "A camera delivered no image: check its cable, its power and the trigger line."},
    Advice{"image_dark",
           "Images carried no structure: clean the lenses, take covers off, set exposure and gain "
           "for the light."},
    Advice{"image_repeated",
           "A camera gave an older image again: check its link, its buffers and the trigger rate "
           "it is set to."},
    Advice{"few_features",
           "There was too little texture: raise the exposure, look for fog, rain or dirt on the "
           "lenses."},
    Advice{"no_stereo_matches",
           "Left and right do not fit this calibration: look for folders of different drives, "
           "T_camera_left inverted (X_camera = R X_left "
           "+ t), distortion given for images that are rectified already, wrong lens numbers, or "
           "cameras that do not expose together; --from-scratch finds the "
           "transform itself."},
    Advice{"cameras_swapped",
           "Left and right are swapped, or T_camera_left is inverted: swap cables, folders or the "
           "cameras' order; X_camera = R X_left + t."},
    Advice{"few_inliers",
           "Poses rested on few points: check the images of those moments for dirt, blur or a "
           "covered lens."},
    Advice{"one_camera",
           "One camera did not support the pose: check its images for dirt, blur or a wrong "
           "exposure."},
    Advice{"no_pose",
           "Tracking failed: check the images of those moments; shorter exposure or a higher "
           "frame rate helps in fast turns."},
    Advice{
        "time_gap",
        "Frames are missing: check cables, trigger and the disk's speed; see the events for when."},
    Advice{"scene_restarted",
           "After a gap the motion across it was extrapolated: do not use distances that span it."},
    Advice{
        "weak_geometry",
        "The points did not hold the pose well or much worse than usual, or a pose was corrected "
        "far: expect it in tunnels, open fields and beside walls; elsewhere check that the "
        "cameras are in step."},
    Advice{"moving_scene",
           "Much of the picture moved by itself, as behind a bus: compare those stretches with the "
           "map before use."},
    Advice{"unconfirmed",
           "The calibration from the last drive was not confirmed: drive on until it is, or give "
           "one with --calibration."},
    Advice{"unverified_calibration",
           "The calibration in use was no longer, or not yet, confirmed by the drive: turns and "
           "near things at the roadside confirm it."},
    Advice{"recalibrating",
           "The rig no longer fitted its calibration: look for a camera that was knocked or is "
           "loose on its mount."},
    Advice{
        "uncalibrated",
        "No calibration had been found yet: these poses only bridge the time until there is one."},
    Advice{"out_of_step",
           "A camera's images were of another instant: check trigger lines and exposure, and "
           "restart the cameras together."},
    Advice{"needs_motion",
           "The calibration could not be found standing still: drive some metres past things at "
           "the roadside."},
    Advice{"needs_near_structure",
           "The calibration could not be found with far things only: drive past houses, cars or "
           "trees."},
    Advice{"needs_texture",
           "The calibration could not be found for want of matches between the cameras: check "
           "lenses and exposure."},
    Advice{"unproven_pairing",
           "Pulses, counters and stamps contradicted each other: check trigger lines, exposure and "
           "the board; see the events."},
};

constexpr std::array kSkipped{
    Advice{"time_backwards",
           "The times of these frames are not later than those before them: look at the order of "
           "times.txt and of the files."},
    Advice{"time_ahead",
           "The times of these frames are later than those after them: look at these lines of "
           "times.txt."},
    Advice{"image_missing",
           "An image that the recording lists is not there: copy the folder again, or leave the "
           "pair out on both sides."},
    Advice{"image_torn",
           "An image file ends too early: copy it again; the disk that it was recorded to may have "
           "been full."},
    Advice{"image_size",
           "An image has another size than the calibration is for: take out what does not belong "
           "to this drive."},
    Advice{"image_unreadable",
           "An image could not be read as a picture: look at the file; PNG and JPEG are what can "
           "be read."},
};

}  // namespace

std::span<const Advice> pose_advice() noexcept { return kPose; }

std::span<const Advice> skip_advice() noexcept { return kSkipped; }

std::string_view advice_for(std::string_view word) noexcept {
  for (const std::span<const Advice> table : {pose_advice(), skip_advice()})
    for (const Advice& advice : table)
      if (advice.word == word) return advice.sentence;
  return {};
}

}  // namespace vergence::app::report
