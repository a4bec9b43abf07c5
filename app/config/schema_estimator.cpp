#include <cstdint>
#include <limits>

#include "app/config/detail/schema_groups.hpp"

namespace vergence::app::groups {

Group odometry() {
  using O = OdometryOptions;
  constexpr std::int64_t kLargestSeed = std::numeric_limits<std::int64_t>::max();
  Rows<O> rows(
      "odometry",
      "How motion is found from the images. The defaults suit road vehicles and hand-held rigs; "
      "change one at a time.",
      [](auto& c) -> auto& { return c.odometry; });
  rows.integer("features", &O::features, 50, 1000, "points",
               "Points tracked in each image: more of them cost time and hold the pose better "
               "where texture is poor. They are spread "
               "over a grid of cells of the size that this number asks for.")
      .choice("first_pair", &O::first_pair, {"corners", "surf"},
              "What is matched across the first images of a rig that is calibrated from scratch: "
              "the corners that are tracked anyway, or "
              "SURF-64; docs/front_ends.md compares them.")
      .integer("pyramid_levels", &O::pyramid_levels, 2, 6, "levels",
               "Sizes of the image that are searched, each half of the one before: more levels "
               "follow faster motion.")
      .number("band_px", &O::band_px, 0.5, 5, "px",
              "Half the width of the band along the epipolar line in which a match across is "
              "sought: wide for a poor calibration.")
      .number("pixel_sigma", &O::pixel_sigma, 0.02, 5, "px",
              "Standard deviation of a tracked corner's position, each coordinate, at full "
              "resolution; the scale of all residuals.")
      .number("parallax_sigma", &O::parallax_sigma, 0, 10, "px",
              "Added to it (in quadrature) for a patch seen from one depth further to the side "
              "than where it was cut: its slope is unknown.")
      .number("huber", &O::huber, 1, 10, "sigmas",
              "Residuals beyond this count less and less (Huber's weight).")
      .integer("window_keyframes", &O::window_keyframes, 3, 20, "keyframes",
               "Keyframes that are adjusted together with their points.")
      .number("rig_turn_sigma", &O::rig_turn_sigma, 0, 0.05, "rad",
              "What the turn between two cameras that shifts all disparities alike may be off by, "
              "where their calibration does not say less: "
              "it is estimated with every window. 0: the calibration is held as exact.")
      .integer("window_steps", &O::window_steps, 1, 30, "steps",
               "Most solver steps of one such adjustment.")
      .number("keyframe_parallax", &O::keyframe_parallax, 0.005, 0.3, "rad",
              "Median turn of the rays to the points since the last keyframe that makes a new one.")
      .number("keyframe_tracked", &O::keyframe_tracked, 0.1, 1, "",
              "A new keyframe is made when less than this share of the last one's points is still "
              "tracked.")
      .integer("min_inliers", &O::min_inliers, 6, 200, "points",
               "A pose on fewer points than this is not believed: status `lost`.")
      .integer("ok_inliers", &O::ok_inliers, 6, 1000, "points",
               "A pose on fewer points than this is `degraded` with the reason `few_inliers`; not "
               "below `min_inliers`.")
      .integer("mlesac_hypotheses", &O::mlesac_hypotheses, 10, 1000, "",
               "Most poses tried on random point triples, a frame.")
      .integer("seed", &O::seed, 0, kLargestSeed, "",
               "Seed of that sampling: the same seed gives the same poses.");
  return rows
      .also(Rows<Configuration>(
                "odometry", "", [](auto& c) -> auto& { return c; })
                .choice("preset", &Configuration::preset, {"default", "small"},
                        "`small`, for small boards: `odometry.features` 250, "
                        "`odometry.window_keyframes` 8, `calibration.max_frames` 100 and "
                        "`calibration.max_observations` 50000 where they are not given; what it "
                        "costs and saves is in docs/deployment.md.")
                .done())
      .done();
}

Group calibration_options() {
  using C = calibration::CalibrationOptions;
  return Rows<C>(
             "calibration",
             "How the stereo transform is found and kept while driving; docs/calibration.md tells "
             "more.",
             [](auto& c) -> auto& { return c.calibration; })
      .integer("min_frames", &C::min_frames, 5, 150, "frames",
               "Frames with motion that are gathered before a calibration is tried; not above "
               "`max_frames`.")
      .integer("max_frames", &C::max_frames, 10, 150, "frames",
               "The newest so many are kept, and solved at once.")
      .number("rotation_sigma_mrad", &C::rotation_sigma_mrad, 0.001, 10, "mrad",
              "Enough: predicted sigma of each rotation axis, noise only, at which a calibration "
              "is solved before `max_frames`.")
      .number("translation_sigma_mm", &C::translation_sigma_mm, 0.01, 1000, "mm",
              "The same of the translation across the baseline, for a baseline of 0.75 m and in "
              "proportion to it.")
      .integer("adopt_after", &C::adopt_after, 0, 1000, "frames",
               "A result is adopted when the frames after its snapshot confirm it, 6 of them or "
               "more; so many frames after the snapshot it is decided about, one way or the other. "
               "In a replay and with `--fast` the solver is waited for: alike on every machine.")
      .integer(
          "max_observations", &C::max_observations, 10'000, 1'000'000, "",
          "Observations that one solve takes; of more, frames are taken at wider steps: time and "
          "memory.")
      .choice("focal_lengths", &C::estimate_focal_lengths, {"hold", "estimate"},
              "`estimate`: the focal length of each further camera is found with the transform, by "
              "its prior; `hold`: it is believed.")
      .choice("intrinsics", &C::refine_intrinsics, {"hold", "refine"},
              "`refine`: focal lengths and principal points of all cameras are found, too, by "
              "their priors.")
      .choice("lenses", &C::estimate_lenses, {"hold", "estimate"},
              "`estimate`: focal lengths, principal points and distortion are part of what the "
              "drive measures, and are taken from it where "
              "it shows that those given are off; `hold`: they are believed.")
      .number("focal_sigma_percent", &C::focal_sigma_percent, 0.001, 10, "%",
              "Prior sigma of a focal length.")
      .number("principal_point_sigma_px", &C::principal_point_sigma_px, 0.01, 50, "px",
              "What a coordinate of a principal point that is held may be off by; with "
              "`intrinsics: refine` its prior sigma.")
      .number("lens_centre_sigma_px", &C::lens_centre_sigma_px, 0.01, 100, "px",
              "Prior sigma of a further camera's principal point with `lenses: estimate`; one in "
              "calibration.yaml goes before it.")
      .number("distortion_sigma", &C::distortion_sigma, 1e-5, 1, "",
              "The same of a radial coefficient (k1, k2), of an equidistant lens k1 to k4.")
      .number("tangential_sigma", &C::tangential_sigma, 1e-6, 0.1, "",
              "The same of a tangential coefficient (p1, p2).")
      .number("max_direction_deg", &C::max_direction_deg, 0.1, 180, "°",
              "A calibration whose translation points farther from the nominal one is rejected.")
      .number("max_rotation_deg", &C::max_rotation_deg, 0.1, 180, "°",
              "The same of the rotation; the first calibration of a drive from scratch is asked "
              "for its direction only.")
      .number("needs_motion_m", &C::needs_motion_m, 0.01, 1000, "m",
              "Way within the frames gathered (or three baselines) below which the reason is "
              "`needs_motion`.")
      .integer("needs_near_points", &C::needs_near_points, 0, 1000, "points",
               "Near points among those gathered below which the reason is `needs_near_structure`.")
      .number("near_baselines", &C::near_baselines, 5, 500, "baselines",
              "Nearer than this a point is near.")
      .number("drift_mrad", &C::drift_mrad, 0, 100, "mrad/√h",
              "How far a rig that nobody touches wanders in an hour, as a random walk: what is "
              "known of it grows old by this.")
      .number("tolerated_depth_percent", &C::tolerated_depth_percent, 0.1, 50, "%",
              "Depth error up to which the drive has confirmed a calibration; until then poses are "
              "`degraded: unverified_calibration`.")
      .number("tolerated_depth_m", &C::tolerated_depth_m, 0.5, 500, "m",
              "The depth at which that is asked; on a short baseline nearer, where a single match "
              "is no better than that.")
      .number("good_depth_percent", &C::good_depth_percent, 0.01, 100, "%",
              "Predicted depth error at 20 m up to which a calibration is called `good`.")
      .number("usable_depth_percent", &C::usable_depth_percent, 0.01, 100, "%",
              "The same up to which it `can be improved`; beyond, the word is `recalibrate`.")
      .also(Rows<Configuration>(
                "calibration", "", [](auto& c) -> auto& { return c; })
                .choice("online", &Configuration::online, {"off", "on"},
                        "`off`: nothing watches the rig, the calibration given is used to the end.")
                .done())
      .done();
}

Group monitor() {
  using M = calibration::MonitorOptions;
  return Rows<M>(
             "monitor", "What watches whether the calibration in use is still true.",
             [](auto& c) -> auto& { return c.monitor; })
      .number("threshold", &M::threshold, 20, 500, "",
              "Statistic that raises a knock or a drift: higher for fewer false alarms, lower for "
              "smaller knocks found sooner.")
      .number("bias_px", &M::bias_px, 0, 1, "px",
              "Slow error that imperfect intrinsics leave in the matches across and that is no "
              "knock, at least.")
      .number("found_bias_px", &M::found_bias_px, 0, 2, "px",
              "The same with a calibration that was found from images and is confirmed, expected "
              "until the monitor has measured it.")
      .number("claimed_bias_px", &M::claimed_bias_px, 0, 5, "px",
              "The same with a calibration that is given.")
      .integer("min_matches", &M::min_matches, 12, 1000, "matches",
               "A frame with fewer matches across measures nothing.")
      .integer("short_window", &M::short_window, 1, 10, "frames",
               "Shortest window of moving frames that is tested: for large knocks.")
      .integer("long_window", &M::long_window, 60, 1800, "frames",
               "Longest window of moving frames that is tested: for drift.")
      .number("lag_frames", &M::lag_frames, 0.1, 1, "frames",
              "Least lag of a camera behind the others that is called `out_of_step`.")
      .number("lag_sigmas", &M::lag_sigmas, 3, 20, "sigmas",
              "By how much that lag has to stand out from every fixed transform.")
      .integer("collapse_frames", &M::collapse_frames, 2, 60, "frames",
               "So many frames in a row without the matches across that there should be are a "
               "`collapse`.")
      .number("collapse_share", &M::collapse_share, 0.01, 0.9, "",
              "Of the matches expected: finding fewer is that.")
      .integer("collapse_expected", &M::collapse_expected, 10, 1000, "matches",
               "Matches that must be expected before their absence says anything.")
      .done();
}

}  // namespace vergence::app::groups
