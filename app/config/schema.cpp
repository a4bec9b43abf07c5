#include "app/config/schema.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>
#include <limits>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

namespace vergence::app {

namespace groups {
namespace {

/// Rows whose values are fields of one part of the configuration. `part` is the member that is that
/// part, or a function that gives it, of a Configuration const or not.
template <class Part>
class Rows {
  using Settings = std::remove_reference_t<std::invoke_result_t<Part, Configuration&>>;

 public:
  Rows(std::string prefix, std::string meaning, Part part)
      : prefix_(std::move(prefix)), part_(part) {
    group_.name = prefix_.substr(0, prefix_.find('.'));
    group_.meaning = std::move(meaning);
  }

  /// Any integral field.
  template <class Integer>
  Rows& integer(const char* name, Integer Settings::*field, std::int64_t least, std::int64_t most,
                const char* unit, const char* meaning) {
    return add<std::int64_t>(name, KeyType::integer, static_cast<double>(least),
                             static_cast<double>(most), unit, meaning, field);
  }

  Rows& number(const char* name, double Settings::*field, double least, double most,
               const char* unit, const char* meaning) {
    return add<double>(name, KeyType::number, least, most, unit, meaning, field);
  }

  /// A list: one key for each number, `name.0` and so on. The first one has the meaning.
  template <std::size_t N>
  Rows& numbers(const char* name, std::array<double, N> Settings::*field, double least, double most,
                const char* unit, const char* meaning) {
    for (std::size_t i = 0; i < N; ++i)
      add<double>(
          name + ("." + std::to_string(i)), KeyType::number, least, most, unit,
          i == 0 ? meaning : "Next element of the list.",
          [ field, i ](auto& s) -> auto& { return (s.*field)[i]; });
    return *this;
  }

  Rows& text(const char* name, std::string Settings::*field, std::size_t longest,
             const char* meaning) {
    return add<std::string>(name, KeyType::text, 0, static_cast<double>(longest), "", meaning,
                            field);
  }

  /// A text that is one of a few words, or empty where that is the default.
  Rows& word(const char* name, std::string Settings::*field, std::vector<std::string> words,
             const char* meaning) {
    text(name, field, 0, meaning);
    group_.keys.back().words = std::move(words);
    return *this;
  }

  /// A number or an enumerator that is chosen by its word: the first stands for 0.
  template <class Value>
  Rows& choice(const char* name, Value Settings::*field, const std::vector<std::string>& words,
               const char* meaning) {
    add(
        name, KeyType::text, 0, 0, "", meaning,
        [field, words](Settings& s, const KeyValue& v) {
          const auto at = std::ranges::find(words, std::get<std::string>(v)) - words.begin();
          s.*field = static_cast<Value>(at);
        },
        [field, words](const Settings& s) -> KeyValue {
          return words.at(static_cast<std::size_t>(s.*field));
        });
    group_.keys.back().words = words;
    return *this;
  }

  /// The options of a camera's driver, as one text.
  Rows& options(const char* name, std::size_t longest, const char* meaning) {
    return add(
        name, KeyType::text, 0, static_cast<double>(longest), "", meaning,
        [](Settings& s, const KeyValue& v) { set_camera_options(std::get<std::string>(v), &s); },
        [](const Settings& s) -> KeyValue { return options_text(s.options); });
  }

  /// The rows of another part, behind these.
  Rows& also(Group&& other) {
    std::move(other.keys.begin(), other.keys.end(), std::back_inserter(group_.keys));
    return *this;
  }

  /// The rows, which are then empty.
  operator Group() { return std::move(group_); }

 private:
  /// `field` is a member of Settings, or a function that gives it.
  template <class Value, class Field>
  Rows& add(const std::string& name, KeyType type, double least, double most, const char* unit,
            const char* meaning, Field field) {
    return add(
        name, type, least, most, unit, meaning,
        [field](Settings& s, const KeyValue& v) {
          auto& target = std::invoke(field, s);
          target = static_cast<std::remove_reference_t<decltype(target)>>(std::get<Value>(v));
        },
        [field](const Settings& s) -> KeyValue {
          return static_cast<Value>(std::invoke(field, s));
        });
  }

  template <class Set, class Get>
  Rows& add(const std::string& name, KeyType type, double least, double most, const char* unit,
            const char* meaning, Set set, Get get) {
    group_.keys.push_back(
        {prefix_.empty() ? name : prefix_ + "." + name,
         type,
         unit,
         least,
         most,
         meaning,
         [part = part_, set](Configuration& c, const KeyValue& v) { set(std::invoke(part, c), v); },
         [part = part_, get](const Configuration& c) { return get(std::invoke(part, c)); },
         {}});
    return *this;
  }

  std::string prefix_;
  Part part_;
  Group group_;
};

constexpr std::int64_t kLargestSeed = std::numeric_limits<std::int64_t>::max();

/// The part that is the configuration itself.
constexpr auto whole = [](auto& c) -> auto& { return c; };

Group general() {
  return Rows("", "Keys that belong to no group.", whole)
      .integer("threads", &Configuration::threads, 1, 2, "",
               "Threads of the estimator: two divide the images, the points and the window between "
               "them; the poses are the same.");
}

Group kitti_raw() {
  using K = KittiRawSettings;
  return Rows("kitti_raw", "Replays of KITTI raw drives.", &Configuration::kitti_raw)
      .integer("left", &K::left, 0, 3, "", "Left camera of a drive, `image_NN`: 0 grey, 2 colour.")
      .integer("right", &K::right, 0, 3, "", "Right camera: 1 grey, 3 colour.");
}

Group record() {
  using R = RecordSettings;
  const std::vector<std::string> off_on{"off", "on"};
  return Rows("record",
              "What is recorded into `drive.mcap` of the session (docs/session_files.md). A list, "
              "`record: [poses, ins, images]`, enables the listed topics.",
              &Configuration::record)
      .choice("poses", &R::poses, off_on, "Odometry and transforms of every frame.")
      .choice("ins", &R::ins, off_on, "All INS samples, as compared.")
      .choice("images", &R::images, off_on,
              "All images, with camera_info; a replay of the session needs them.")
      .choice("pulses", &R::pulses, off_on, "The trigger board's pulses of a live run.")
      .integer("split_mb", &R::split_mb, 0, 10'000'000, "MB",
               "Size at which a new file starts; 0: one file.");
}

Group publish() {
  using P = PublishSettings;
  return Rows("publish",
              "Pose stream and live page of a running session or replay (docs/live_interface.md).",
              &Configuration::publish)
      .text("pose_stream", &P::pose_stream, 200,
            "Pose stream: `unix:///PATH` or `udp://HOST:PORT`; empty: off.")
      .text("http", &P::http, 200, "HOST:PORT of the live page, e.g. `127.0.0.1:8080`; empty: off.")
      .text("token_file", &P::token_file, 400,
            "File with the page's token; empty: a new token each session.");
}

Group sessions() {
  using S = SessionsSettings;
  return Rows("sessions", "Session directories next to the one of `--out`.",
              &Configuration::sessions)
      .integer("quota_mb", &S::quota_mb, 0, 1'000'000'000, "MB",
               "Maximum total size: a run first removes the oldest beyond it. 0: never.");
}

Group realtime() {
  using R = RealtimeSettings;
  return Rows("realtime",
              "Scheduling and memory of a live run (docs/deployment.md). If the system refuses a "
              "setting, a warning is printed and the run continues.",
              &Configuration::realtime)
      .integer("priority", &R::priority, 0, 90, "",
               "SCHED_FIFO priority of the most urgent threads; 0: off.")
      .text("affinity", &R::affinity, 64,
            "Processors of all threads but the solver, e.g. `0-1,3`; empty: any.")
      .text("solver_affinity", &R::solver_affinity, 64,
            "Processors of the calibration solver; empty: any.")
      .choice("lock_memory", &R::lock_memory, {"off", "on"},
              "`on`: lock memory before the first frame (mlockall).")
      .number("frame_budget_ms", &R::frame_budget_ms, 0, 10000, "ms",
              "Time budget per live frame; 0: the frame interval.");
}

Group rig() {
  using R = RigSettings;
  return Rows("rig", "The rig as a whole.", &Configuration::rig)
      .text("name", &R::name, 64, "Name in `calibration.yaml` and in the path of the state file.")
      .number("nominal.baseline_m", &R::baseline_m, 0.02, 10, "m",
              "Distance of the right camera from the left one, to its right.")
      .number("nominal.focal_px", &R::focal_px, 0, 20000, "px",
              "Focal length of every camera; 0: 0.72 of the image's width.")
      .number("nominal.k1", &R::k1, -1, 1, "", "First radial coefficient of every camera.")
      .number("nominal.k2", &R::k2, -1, 1, "", "Second radial coefficient of every camera.")
      .text("state_dir", &R::state_dir, 400,
            "Directory of the state file (docs/calibration.md); `none`: no state file.");
}

Group cameras() {
  using C = CameraSettings;
  Group all;
  for (std::size_t k = 0; k < kMaxCameras; ++k) {
    Group one =
        Rows(
            "cameras." + std::to_string(k), "The cameras, a list; the first is the left one.",
            [k](auto& c) -> auto& { return c.cameras[k]; })
            .word("driver", &C::driver, {"mock", "gige", "iidc-usb", "iidc-1394", "v4l2"},
                  "Driver; empty: no such camera.")
            .text("name", &C::name, 32, "Name in messages and in calibration.yaml.")
            .text("serial", &C::serial, 64,
                  "Serial number, or address of a GigE camera; empty: the next found.")
            .choice("image_half", &C::half, {"whole", "left", "right"},
                    "Half of a frame that has both images side by side (docs/cameras.md).")
            .integer("size.0", &C::width, 64, 4096, "px", "Width of the image in pixels.")
            .integer("size.1", &C::height, 48, 4096, "px", "Height of the image in pixels.")
            .integer("offset.0", &C::offset_x, 0, 16384, "px",
                     "Left edge of the region of interest on the sensor.")
            .integer("offset.1", &C::offset_y, 0, 16384, "px", "Upper edge of that region.")
            .text("pixel_format", &C::pixel_format, 32,
                  "Format as the device names it, e.g. `Mono8`; empty: the cheapest for grey.")
            .choice("trigger", &C::trigger, {"hardware", "software", "free"},
                    "Trigger source, equal for all cameras (docs/synchronisation.md).")
            .options("options", 400,
                     "Options of this driver (drivers/*/README.md), a group or `NAME=VALUE …`.")
            .number("exposure_us", &C::exposure_us, 10, 1e6, "µs",
                    "Exposure time; 8000 suits daylight on the simulated rig.")
            .number("trigger_delay_us", &C::trigger_delay_us, 0, 20000, "µs",
                    "Delay from a pulse's edge to the start of the exposure.")
            .number("stamp_jitter_us", &C::stamp_jitter_us, 0, 5000, "µs",
                    "Maximum jitter of its stamps; 0: the driver's (20; host stamps 1000).")
            .number("gain_db", &C::gain_db, 0, 40, "dB", "Gain of the sensor's amplifier.")
            .text("mask", &C::mask, 400,
                  "PNG or PGM; pixels of value 0 are not used (docs/cameras.md).")
            .choice("model", &C::model, {"pinhole-radtan", "pinhole-equidistant"},
                    "Lens model; `pinhole-equidistant` is a fisheye lens.")
            .numbers("intrinsics", &C::intrinsics, 0, 20000, "px",
                     "fx, fy, cx, cy; all four 0: those of `rig.nominal`.")
            .numbers("distortion", &C::distortion, -2, 2, "",
                     "k1, k2, p1, p2, k3; of an equidistant lens k1 to k4.")
            .numbers("T_camera_left", &C::T_camera_left, -20, 20, "1, m",
                     "Rows of [R t], X_camera = R X_left + t; all 0: parallel cameras.");
    all.name = one.name;
    all.meaning = one.meaning;
    std::move(one.keys.begin(), one.keys.end(), std::back_inserter(all.keys));
  }
  all.list = "cameras.";
  return all;
}

Group exposure() {
  using E = ExposureSettings;
  return Rows("exposure",
              "Exposure and gain of all cameras together, while driving (docs/cameras.md).",
              &Configuration::exposure)
      .choice("mode", &E::mode, {"fixed", "auto"},
              "`auto`: one exposure for all cameras, by the brightness of camera 0.")
      .number("target", &E::target, 20, 200, "grey levels", "Target mean of the unmasked pixels.")
      .number("saturated_percent", &E::saturated_percent, 0, 50, "%",
              "Maximum share of saturated pixels.")
      .number("min_us", &E::min_us, 5, 100000, "µs", "Minimum exposure.")
      .number("max_us", &E::max_us, 10, 200000, "µs",
              "Maximum exposure; beyond it the gain is raised.")
      .number("max_gain_db", &E::max_gain_db, 0, 40, "dB", "Maximum gain.")
      .integer("settle_frames", &E::settle_frames, 2, 60, "frames",
               "Images skipped after a change: one more than the change takes.");
}

Group trigger() {
  using T = TriggerSettings;
  const std::vector<std::string> edges{"none", "rising", "falling"};
  return Rows("trigger", "Trigger of the cameras.", &Configuration::trigger)
      .word("driver", &T::driver, {"none", "mock", "board"},
            "Source of the pulses (docs/synchronisation.md).")
      .text("port", &T::port, 200,
            "Serial port of the trigger board, or its serial number; empty: the only one.")
      .integer("baud", &T::baud, 0, 3000000, "baud", "Baud rate of the serial link; 0: detected.")
      .number("rate", &T::rate, 1, 200, "Hz", "Pulse rate and frame rate.")
      .number("width_us", &T::width_us, 1, 100000, "µs",
              "Length of a pulse, as the camera inputs require.")
      .number("dither_us", &T::dither_us, 0, 20000, "µs",
              "Variation of the pulse interval by which images are identified; 0: none.")
      .integer("lines", &T::lines, 0, 15, "",
               "Bit mask of the pulsed outputs; 0: one for each camera.")
      .integer("active_low", &T::active_low, 0, 15, "", "Bit mask of the lines whose pulse is low.")
      .integer("feedback", &T::feedback, 0, 15, "",
               "Bit mask of the inputs wired to exposure-active outputs.")
      .integer("feedback_active_low", &T::feedback_active_low, 0, 15, "",
               "Bit mask of the feedback inputs that are low during exposure.")
      .choice("pps", &T::pps, edges,
              "Edge of the GNSS receiver's pulse per second at the trigger board.")
      .choice("ins", &T::ins, edges, "Edge of the INS's SyncOut at the trigger board.");
}

Group sync() {
  using S = SyncSettings;
  return Rows("sync", "How images are paired.", &Configuration::sync)
      .choice("mode", &S::mode,
              {"frame_counter", "approximate_time", "board", "ins_syncout", "master_strobe",
               "ieee1394_cycle_time", "ptp", "side_by_side"},
              "How images are paired and verified (docs/synchronisation.md).")
      .number("timeout_ms", &S::timeout_ms, 1, 10000, "ms",
              "Maximum wait for a late image of a pulse.")
      .number("tolerance_ms", &S::tolerance_ms, 0.01, 1000, "ms",
              "Maximum difference of the stamps of a set, in modes without pulses.");
}

Group ins() {
  using I = InsSettings;
  return Rows("ins", "Inertial navigation system that the pose is compared with.",
              &Configuration::ins)
      .word("driver", &I::driver, {"none", "mock", "xsens", "nmea", "ubx"},
            "Driver; `nmea` and `ubx` are satellite receivers.")
      .text("port", &I::port, 200,
            "Serial port, e.g. `/dev/serial/by-id/…`; empty: the only one on USB.")
      .integer("baud", &I::baud, 0, 2000000, "baud",
               "Baud rate to set; 0: keep that of the device.")
      .number("rate", &I::rate, 1, 400, "Hz",
              "Sample rate; of `nmea` and `ubx` the rate that the receiver sends.")
      .number("sync_out_hz", &I::sync_out_hz, -1, 400, "Hz",
              "Pulse rate at SyncOut; 0: unchanged, -1: off.")
      .number("sync_out_width_ms", &I::sync_out_width_ms, 0.1, 100, "ms",
              "Length of a SyncOut pulse.")
      .number("processing_ms", &I::processing_ms, 0, 50, "ms",
              "Delay from a sample to its first byte on the serial link (see its manual).")
      .numbers("lever_arm_m", &I::lever_arm_m, -100, 100, "m",
               "Position of the left camera in the INS body: forward, left, up.")
      .numbers("boresight_deg", &I::boresight_deg, -180, 180, "°",
               "Rotation of the rig relative to the INS: roll, pitch, yaw.");
}

Group comparison() {
  using C = ComparisonSettings;
  return Rows("comparison", "The comparison with the INS.", &Configuration::comparison)
      .number("alignment_distance_m", &C::alignment_distance_m, 1, 100000, "m",
              "Distance with a valid fix after which the path is aligned with ENU.")
      .number("correlation_s", &C::correlation_s, 0.1, 3600, "s",
              "Correlation time of the INS's position errors.")
      .number("heading_sigma_deg", &C::heading_sigma_deg, 0, 180, "°",
              "Sigma of the INS heading in the alignment; 0: heading not used.")
      .number("max_gap_ms", &C::max_gap_ms, 1, 10000, "ms",
              "Maximum interval between INS samples to interpolate across.")
      .number("max_wait_ms", &C::max_wait_ms, 1, 3000, "ms",
              "Maximum wait of a pose for the next INS sample.");
}

Group odometry() {
  using O = OdometryOptions;
  Rows rows("odometry",
            "Motion estimation. The defaults suit road vehicles and hand-held rigs; change one at "
            "a time.",
            &Configuration::odometry);
  rows.integer("features", &O::features, 50, 1000, "points", "Points tracked in each image.")
      .choice("init_features", &O::init_features, {"corners", "surf"},
              "Features of the first matches from scratch (docs/benchmarks.md).")
      .integer("pyramid_levels", &O::pyramid_levels, 2, 6, "levels",
               "Image pyramid levels; more levels follow faster motion.")
      .number("band_px", &O::band_px, 0.5, 5, "px",
              "Half width of the search band along the epipolar line.")
      .number("pixel_sigma", &O::pixel_sigma, 0.02, 5, "px",
              "Standard deviation of a tracked corner per coordinate.")
      .number("parallax_sigma", &O::parallax_sigma, 0, 10, "px",
              "Added to pixel_sigma in quadrature, times the sideways motion over the depth.")
      .integer("window_keyframes", &O::window_keyframes, 3, 20, "keyframes",
               "Keyframes in the sliding window.")
      .number("extrinsic_rotation_sigma_rad", &O::extrinsic_rotation_sigma_rad, 0, 0.05, "rad",
              "Maximum prior sigma of the rotation between cameras; 0: rotation fixed.")
      .integer("window_steps", &O::window_steps, 1, 30, "steps",
               "Maximum solver steps per window adjustment.")
      .number("keyframe_parallax", &O::keyframe_parallax, 0.005, 0.3, "rad",
              "Median parallax since the last keyframe that creates a new one.")
      .number("keyframe_tracked", &O::keyframe_tracked, 0.1, 1, "",
              "A new keyframe is created when less than this share of the last one's points is "
              "still tracked.")
      .integer("min_inliers", &O::min_inliers, 6, 200, "points",
               "Minimum inliers of a pose; below, the status is `lost`.")
      .integer("ok_inliers", &O::ok_inliers, 6, 1000, "points",
               "Below this number of inliers the pose is `degraded: few_inliers`.")
      .integer("mlesac_hypotheses", &O::mlesac_hypotheses, 10, 1000, "",
               "Maximum MLESAC hypotheses per frame.")
      .integer("seed", &O::seed, 0, kLargestSeed, "",
               "Seed of the random sampling: the same seed gives the same poses.");
  return rows.also(Rows("odometry", "", whole)
                       .choice("preset", &Configuration::preset, {"default", "small"},
                               "`small`: less work, for small computers (docs/deployment.md)."));
}

Group calibration_options() {
  using C = calibration::CalibrationOptions;
  return Rows("calibration", "Online calibration of the rig; see docs/calibration.md.",
              &Configuration::calibration)
      .integer("min_frames", &C::min_frames, 5, 150, "frames",
               "Moving frames before a calibration is solved; not above `max_frames`.")
      .integer("max_frames", &C::max_frames, 10, 150, "frames",
               "Maximum number of frames solved together; older ones are dropped.")
      .integer("adopt_after", &C::adopt_after, 0, 1000, "frames",
               "Frames after the snapshot of a solve within which its result is adopted.")
      .integer("max_observations", &C::max_observations, 10'000, 1'000'000, "",
               "Maximum observations per solve; beyond it frames are subsampled.")
      .choice("intrinsics", &C::intrinsics, {"fixed", "focal", "full"},
              "Intrinsics that are estimated with the extrinsics.")
      .number("focal_sigma_percent", &C::focal_sigma_percent, 0.001, 10, "%",
              "Prior sigma of a focal length.")
      .number("principal_point_sigma_px", &C::principal_point_sigma_px, 0.01, 50, "px",
              "Assumed error of a fixed principal-point coordinate; with `intrinsics: full` its "
              "prior sigma.")
      .number("lens_centre_sigma_px", &C::lens_centre_sigma_px, 0.01, 100, "px",
              "Prior sigma of an additional camera's principal point with `intrinsics: full`; a "
              "sigma in calibration.yaml takes precedence.")
      .number("distortion_sigma", &C::distortion_sigma, 1e-5, 1, "",
              "Prior sigma of a radial coefficient (k1, k2; equidistant: k1 to k4).")
      .number("tangential_sigma", &C::tangential_sigma, 1e-6, 0.1, "",
              "Prior sigma of a tangential coefficient (p1, p2).")
      .number("max_direction_deg", &C::max_direction_deg, 0.1, 180, "°",
              "Maximum angle of the translation to the nominal one.")
      .number("max_rotation_deg", &C::max_rotation_deg, 0.1, 180, "°",
              "Maximum rotation from the nominal one.")
      .integer("min_near_points", &C::min_near_points, 0, 1000, "points",
               "Minimum near points of a solve; below: `needs_near_structure`.")
      .number("near_baselines", &C::near_baselines, 5, 500, "baselines",
              "Maximum distance of a near point, in baselines.")
      .number("extrinsic_random_walk_mrad_per_sqrt_h", &C::extrinsic_random_walk_mrad_per_sqrt_h, 0,
              100, "mrad/√h", "Random walk of undisturbed extrinsics.")
      .number("max_depth_error_percent", &C::max_depth_error_percent, 0.1, 50, "%",
              "Maximum depth error of a verified calibration.")
      .number("reference_depth_m", &C::reference_depth_m, 0.5, 500, "m",
              "Depth at which that error is evaluated; nearer on a short baseline.")
      .number("good_depth_percent", &C::good_depth_percent, 0.01, 100, "%",
              "Maximum depth error at 20 m of the rating `good`.")
      .number("usable_depth_percent", &C::usable_depth_percent, 0.01, 100, "%",
              "Maximum depth error at 20 m of the rating `fair`.")
      .also(Rows("calibration", "", whole)
                .choice("online", &Configuration::online, {"off", "on"},
                        "`off`: the initial calibration is used throughout, not monitored."));
}

Group monitor() {
  using M = calibration::MonitorOptions;
  return Rows("monitor", "Monitoring of the calibration in use.", &Configuration::monitor)
      .number("threshold", &M::threshold, 20, 500, "",
              "Test statistic that reports a knock or a drift; higher: fewer alarms.")
      .number("bias_px", &M::bias_px, 0, 1, "px",
              "Minimum of the assumed slowly varying error of stereo matches, RMS over the image.")
      .number("verified_bias_px", &M::verified_bias_px, 0, 2, "px",
              "Initial value of that error, for a verified calibration solved from images.")
      .number("unverified_bias_px", &M::unverified_bias_px, 0, 5, "px",
              "Initial value of that error, for any other calibration.")
      .integer("min_matches", &M::min_matches, 12, 1000, "matches",
               "Frames with fewer stereo matches are not used.")
      .integer("short_window", &M::short_window, 1, 10, "frames",
               "Shortest window of moving frames that is tested: for large knocks.")
      .integer("long_window", &M::long_window, 60, 1800, "frames",
               "Longest window of moving frames that is tested: for drift.")
      .integer("collapse_frames", &M::collapse_frames, 2, 60, "frames",
               "Consecutive frames that raise a `collapse` (too few stereo matches), or a knock at "
               "standstill (above the threshold).")
      .number("collapse_share", &M::collapse_share, 0.01, 0.9, "",
              "Share of the expected matches below which a frame counts towards a collapse.")
      .integer("collapse_expected", &M::collapse_expected, 10, 1000, "matches",
               "Minimum expected matches for a frame to count.");
}

Group intrinsics_error() {
  using E = IntrinsicsErrorSettings;
  return Rows(
             "mock.intrinsics_error", "", [](auto& c) -> auto& { return c.mock.intrinsics_error; })
      .number("principal_point_px", &E::principal_point_px, 0, 50, "px",
              "Sigma of the error of each supplied principal-point coordinate.")
      .number("focal_percent", &E::focal_percent, 0, 10, "%",
              "Sigma of the error of the supplied focal length.")
      .integer("seed", &E::seed, 0, kLargestSeed, "", "Seed of these errors.");
}

Group calibration_error() {
  using E = CalibrationErrorSettings;
  return Rows(
             "mock.calibration_error", "",
             [](auto& c) -> auto& { return c.mock.calibration_error; })
      .number("pitch_deg", &E::pitch_deg, -45, 45, "°",
              "Error of the rotation of camera 1 about its x axis.")
      .number("yaw_deg", &E::yaw_deg, -45, 45, "°", "The same about its y axis.")
      .number("roll_deg", &E::roll_deg, -45, 45, "°", "The same about its z axis.")
      .number("x_m", &E::x_m, -1, 1, "m", "Error of the translation of camera 1 along its x axis.")
      .number("y_m", &E::y_m, -1, 1, "m", "The same along its y axis.")
      .number("z_m", &E::z_m, -1, 1, "m", "The same along its z axis.")
      .number("length_percent", &E::length_percent, -60, 200, "%",
              "Scale error of the supplied lengths.");
}

Group mock() {
  using M = MockSettings;
  return Rows("mock", "World and vehicle of the simulated rig (docs/simulated_rig.md).",
              &Configuration::mock)
      .word("world", &M::world, {"suburb"}, "Rendered world.")
      .choice("drive", &M::drive, {"loop", "figure-eight", "straight", "brief", "still"},
              "Route: `loop` is 1 km, `brief` 120 m.")
      .integer("seed", &M::seed, 0, kLargestSeed, "",
               "Seed of world, motion and noise: same seed, same run.")
      .choice("pattern", &M::pattern, {"grey", "gbrg"}, "Sensors: `grey`, or `gbrg` (Bayer).")
      .choice("ins", &M::ins, {"noisy", "ideal"},
              "Errors of the INS: `noisy` as an MTi-G, or `ideal`.")
      .integer("texture_detail", &M::texture_detail, 0, 2, "",
               "Resolution of the facades: 4.7, 2.3 or 1.2 cm a texel.")
      .integer("noise", &M::noise, 0, 1, "", "1: shot and read noise of the sensors; 0: none.")
      .integer("blur_samples", &M::blur_samples, 1, 16, "",
               "Poses averaged over an exposure; 1: no motion blur.")
      .number("speed", &M::speed, 0.01, 20, "m/s", "Speed on the straights.")
      .number("suspension", &M::suspension, 0, 3, "",
              "Gain on pitch, roll and heave of the springs.")
      .number("vibration", &M::vibration, 0, 5, "", "Gain on the vibration at 6 to 12 Hz.")
      .number("stop_s", &M::stop_s, 1, 3600, "s",
              "Duration of each stop, and of the standing start and end.")
      .number("hill_deg", &M::hill_deg, 0, 5, "°", "Steepest slope of the streets.")
      .number("clock_drift_ppm", &M::clock_drift_ppm, 0, 150, "ppm",
              "Largest drift of the devices' clocks; each has its own.")
      .also(intrinsics_error())
      .also(calibration_error());
}

Group faults() {
  Group group{.name = "faults", .list = "faults."};
  group.meaning =
      "Faults of the simulated rig, a list; docs/simulated_rig.md has the kinds and their "
      "parameters.";
  for (std::size_t i = 0; i < kMaxFaults; ++i)
    group.keys.push_back(
        {"faults." + std::to_string(i), KeyType::text, "", 0, 200,
         "`KIND@SECONDS NAME=NUMBER …`, or the same as a group: `{at: 42, kind: knock, camera: 1, "
         "pitch_deg: 0.2}`.",
         [i](Configuration& c, const KeyValue& v) { c.faults[i] = std::get<std::string>(v); },
         [i](const Configuration& c) -> KeyValue { return c.faults[i]; }});
  return group;
}

}  // namespace
}  // namespace groups

const std::vector<Group>& schema() {
  static const std::vector<Group> all{
      groups::general(),  groups::rig(),        groups::cameras(),
      groups::exposure(), groups::ins(),        groups::trigger(),
      groups::sync(),     groups::odometry(),   groups::calibration_options(),
      groups::monitor(),  groups::comparison(), groups::kitti_raw(),
      groups::mock(),     groups::record(),     groups::publish(),
      groups::sessions(), groups::realtime(),   groups::faults()};
  return all;
}

namespace {

/// Finds intrinsics of a camera that would be ignored.
std::string find_unread_lens(const CameraSettings& camera, std::size_t k) {
  const auto given = [](double v) { return v != 0; };
  const auto& numbers = camera.intrinsics;
  const bool none = std::ranges::none_of(numbers, given);
  if (!none && !std::ranges::all_of(numbers, given))
    return fmt::format(
        "cameras.{}.intrinsics is [{}]; set all of fx, fy, cx, cy in pixels, or none", k,
        fmt::join(numbers, ", "));
  if (none && std::ranges::any_of(camera.distortion, given))
    return fmt::format(
        "cameras.{}.distortion is set without cameras.{}.intrinsics; set both, or use "
        "rig.nominal.k1 and rig.nominal.k2",
        k, k);
  if (camera.model == CameraModelKind::pinhole_equidistant && given(camera.distortion[4]))
    return fmt::format(
        "cameras.{}.distortion has five coefficients; the model pinhole-equidistant has k1 to k4",
        k);
  return {};
}

/// The items of a list have the same keys: item 0 stands for all, as N.
std::string documented_name(const Group& group, const Key& key) {
  if (group.list.empty()) return key.name;
  const std::string first = group.list + "0";
  return key.name.starts_with(first) ? group.list + "N" + key.name.substr(first.size())
                                     : std::string();
}

}  // namespace

std::string find_contradiction(const Configuration& c) {
  for (std::size_t k = 0; k < c.cameras.size(); ++k)
    if (std::string unread = find_unread_lens(c.cameras[k], k); !unread.empty()) return unread;
  const auto& odometry = c.odometry;
  const auto& calibration = c.calibration;
  for (const auto& [larger, high, smaller, low] :
       {std::tuple<const char*, double, const char*, double>{
            "odometry.ok_inliers", odometry.ok_inliers, "odometry.min_inliers",
            odometry.min_inliers},
        {"calibration.max_frames", calibration.max_frames, "calibration.min_frames",
         calibration.min_frames},
        {"calibration.usable_depth_percent", calibration.usable_depth_percent,
         "calibration.good_depth_percent", calibration.good_depth_percent}})
    if (high < low)
      return fmt::format("{} ({}) is below {} ({}); raise the first or lower the second", larger,
                         high, smaller, low);
  for (const auto& [key, list] :
       {std::pair<const char*, const std::string&>{"affinity", c.realtime.affinity},
        {"solver_affinity", c.realtime.solver_affinity}})
    if (!list.empty() && !parse_cpu_list(list))
      return fmt::format(
          "realtime.{} ({}) is not a list of processors; write numbers and ranges, as in 0-1,3",
          key, list);
  return {};
}

std::string to_text(const KeyValue& value) {
  return std::visit([](const auto& v) { return fmt::format("{}", v); }, value);
}

std::string range_text(const Key& key) {
  if (!key.words.empty()) return fmt::format("{}", fmt::join(key.words, ", "));
  if (key.type == KeyType::text) return fmt::format("up to {} bytes", key.most);
  if (key.type == KeyType::number) return fmt::format("{} … {}", key.least, key.most);
  // The largest 64-bit integer is no double: as a bound it stands for "any".
  if (key.most >= 0x1p63) return fmt::format("from {}", key.least);
  return fmt::format("{} … {}", static_cast<std::int64_t>(key.least),
                     static_cast<std::int64_t>(key.most));
}

std::string configuration_tables() {
  std::string page;
  for (const Group& group : schema()) {
    page += group.name.empty() ? std::string("\n## Without a group\n\n")
                               : "\n## `" + group.name + "`\n\n";
    page += group.meaning + "\n\n";
    page += "| key | default | type | unit | range | meaning |\n|---|---|---|---|---|---|\n";
    for (const Key& key : group.keys) {
      constexpr std::array kTypes{"integer", "number", "text"};
      const std::string name = documented_name(group, key),
                        value = to_text(key.get(Configuration{}));
      if (name.empty()) continue;
      page += fmt::format("| `{}` | {} | {} | {} | {} | {} |\n", name,
                          value.empty() ? "empty" : "`" + value + "`",
                          kTypes.at(static_cast<std::size_t>(key.type)),
                          key.unit.empty() ? "–" : key.unit, range_text(key), key.meaning);
    }
  }
  return page;
}

}  // namespace vergence::app
