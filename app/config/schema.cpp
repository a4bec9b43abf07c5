#include "app/config/schema.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>
#include <limits>
#include <sstream>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include "app/runtime/realtime.hpp"

namespace vergence::app {

namespace groups {
namespace {

/// Rows whose values are fields of one part of the configuration. `part` is the member that is that
/// part, or a function that gives it, of a Configuration const or not.
template <class Part>
class Rows {
  using Settings = std::remove_reference_t<std::invoke_result_t<Part, Configuration&>>;

 public:
  Rows(std::string prefix, Part part) : prefix_(std::move(prefix)), part_(part) {
    group_.name = prefix_.substr(0, prefix_.find('.'));
  }

  /// Any integral field.
  template <class Integer>
  Rows& integer(const char* name, Integer Settings::*field, std::int64_t least, std::int64_t most,
                const char* unit = "") {
    return add<std::int64_t>(name, KeyType::integer, static_cast<double>(least),
                             static_cast<double>(most), unit, field);
  }

  Rows& number(const char* name, double Settings::*field, double least, double most,
               const char* unit = "") {
    return add<double>(name, KeyType::number, least, most, unit, field);
  }

  /// A list: one key for each number, `name.0` and so on.
  template <std::size_t N>
  Rows& numbers(const char* name, std::array<double, N> Settings::*field, double least, double most,
                const char* unit = "") {
    for (std::size_t i = 0; i < N; ++i)
      add<double>(
          name + ("." + std::to_string(i)), KeyType::number, least, most, unit,
          [ field, i ](auto& s) -> auto& { return (s.*field)[i]; });
    return *this;
  }

  Rows& text(const char* name, std::string Settings::*field, std::size_t longest) {
    return add<std::string>(name, KeyType::text, 0, static_cast<double>(longest), "", field);
  }

  /// A text that is one of a few words, or empty where that is the default.
  Rows& word(const char* name, std::string Settings::*field, std::vector<std::string> words) {
    text(name, field, 0);
    group_.keys.back().words = std::move(words);
    return *this;
  }

  /// A number or an enumerator that is chosen by its word: the first stands for 0.
  template <class Value>
  Rows& choice(const char* name, Value Settings::*field, const std::vector<std::string>& words) {
    add(
        name, KeyType::text, 0, 0, "",
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
  Rows& options(const char* name, std::size_t longest) {
    return add(
        name, KeyType::text, 0, static_cast<double>(longest), "",
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
            Field field) {
    return add(
        name, type, least, most, unit,
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
            Set set, Get get) {
    group_.keys.push_back(
        {prefix_.empty() ? name : prefix_ + "." + name, type, unit, least, most,
         [part = part_, set](Configuration& c, const KeyValue& v) { set(std::invoke(part, c), v); },
         [part = part_, get](const Configuration& c) { return get(std::invoke(part, c)); }});
    return *this;
  }

  std::string prefix_;
  Part part_;
  Group group_;
};

constexpr std::int64_t kLargestSeed = std::numeric_limits<std::int64_t>::max();

/// The part that is the configuration itself.
constexpr auto whole = [](auto& c) -> auto& { return c; };

Group general() { return Rows("", whole).integer("threads", &Configuration::threads, 1, 2); }

Group kitti_raw() {
  using K = KittiRawSettings;
  return Rows("kitti_raw", &Configuration::kitti_raw)
      .integer("left", &K::left, 0, 3)
      .integer("right", &K::right, 0, 3);
}

Group record() {
  using R = RecordSettings;
  const std::vector<std::string> off_on{"off", "on"};
  return Rows("record", &Configuration::record)
      .choice("poses", &R::poses, off_on)
      .choice("ins", &R::ins, off_on)
      .choice("images", &R::images, off_on)
      .choice("pulses", &R::pulses, off_on)
      .integer("split_mb", &R::split_mb, 0, 10'000'000, "MB");
}

Group publish() {
  using P = PublishSettings;
  return Rows("publish", &Configuration::publish)
      .text("pose_stream", &P::pose_stream, 200)
      .text("http", &P::http, 200)
      .text("token_file", &P::token_file, 400);
}

Group sessions() {
  using S = SessionsSettings;
  return Rows("sessions", &Configuration::sessions)
      .integer("quota_mb", &S::quota_mb, 0, 1'000'000'000, "MB");
}

Group realtime() {
  using R = RealtimeSettings;
  return Rows("realtime", &Configuration::realtime)
      .integer("priority", &R::priority, 0, 90)
      .text("affinity", &R::affinity, 64)
      .text("solver_affinity", &R::solver_affinity, 64)
      .choice("lock_memory", &R::lock_memory, {"off", "on"})
      .number("frame_budget_ms", &R::frame_budget_ms, 0, 10000, "ms");
}

Group rig() {
  using R = RigSettings;
  return Rows("rig", &Configuration::rig)
      .text("name", &R::name, 64)
      .number("nominal.baseline_m", &R::baseline_m, 0.02, 10, "m")
      .number("nominal.focal_px", &R::focal_px, 0, 20000, "px")
      .number("nominal.k1", &R::k1, -1, 1)
      .number("nominal.k2", &R::k2, -1, 1)
      .text("state_dir", &R::state_dir, 400);
}

Group cameras() {
  using C = CameraSettings;
  Group all;
  for (std::size_t k = 0; k < kMaxCameras; ++k) {
    Group one = Rows(
                    "cameras." + std::to_string(k), [k](auto& c) -> auto& { return c.cameras[k]; })
                    .word("driver", &C::driver, {"mock", "gige", "iidc-usb", "iidc-1394", "v4l2"})
                    .text("name", &C::name, 32)
                    .text("serial", &C::serial, 64)
                    .choice("image_half", &C::half, {"whole", "left", "right"})
                    .integer("size.0", &C::width, 64, 4096, "px")
                    .integer("size.1", &C::height, 48, 4096, "px")
                    .integer("offset.0", &C::offset_x, 0, 16384, "px")
                    .integer("offset.1", &C::offset_y, 0, 16384, "px")
                    .text("pixel_format", &C::pixel_format, 32)
                    .choice("trigger", &C::trigger, {"hardware", "software", "free"})
                    .options("options", 400)
                    .number("exposure_us", &C::exposure_us, 10, 1e6, "µs")
                    .number("trigger_delay_us", &C::trigger_delay_us, 0, 20000, "µs")
                    .number("stamp_jitter_us", &C::stamp_jitter_us, 0, 5000, "µs")
                    .number("gain_db", &C::gain_db, 0, 40, "dB")
                    .text("mask", &C::mask, 400)
                    .choice("model", &C::model, {"pinhole-radtan", "pinhole-equidistant"})
                    .numbers("intrinsics", &C::intrinsics, 0, 20000, "px")
                    .numbers("distortion", &C::distortion, -2, 2)
                    .numbers("T_camera_left", &C::T_camera_left, -20, 20, "1, m");
    all.name = one.name;
    std::move(one.keys.begin(), one.keys.end(), std::back_inserter(all.keys));
  }
  all.list = "cameras.";
  return all;
}

Group exposure() {
  using E = ExposureSettings;
  return Rows("exposure", &Configuration::exposure)
      .choice("mode", &E::mode, {"fixed", "auto"})
      .number("target", &E::target, 20, 200, "grey levels")
      .number("saturated_percent", &E::saturated_percent, 0, 50, "%")
      .number("min_us", &E::min_us, 5, 100000, "µs")
      .number("max_us", &E::max_us, 10, 200000, "µs")
      .number("max_gain_db", &E::max_gain_db, 0, 40, "dB")
      .integer("settle_frames", &E::settle_frames, 2, 60, "frames");
}

Group trigger() {
  using T = TriggerSettings;
  const std::vector<std::string> edges{"none", "rising", "falling"};
  return Rows("trigger", &Configuration::trigger)
      .word("driver", &T::driver, {"none", "mock", "board"})
      .text("port", &T::port, 200)
      .integer("baud", &T::baud, 0, 3000000, "baud")
      .number("rate", &T::rate, 1, 200, "Hz")
      .number("width_us", &T::width_us, 1, 100000, "µs")
      .number("dither_us", &T::dither_us, 0, 20000, "µs")
      .integer("lines", &T::lines, 0, 15)
      .integer("active_low", &T::active_low, 0, 15)
      .integer("feedback", &T::feedback, 0, 15)
      .integer("feedback_active_low", &T::feedback_active_low, 0, 15)
      .choice("pps", &T::pps, edges)
      .choice("ins", &T::ins, edges);
}

Group sync() {
  using S = SyncSettings;
  return Rows("sync", &Configuration::sync)
      .choice("mode", &S::mode,
              {"frame_counter", "approximate_time", "board", "ins_syncout", "master_strobe",
               "ieee1394_cycle_time", "ptp", "side_by_side"})
      .number("timeout_ms", &S::timeout_ms, 1, 10000, "ms")
      .number("tolerance_ms", &S::tolerance_ms, 0.01, 1000, "ms");
}

Group ins() {
  using I = InsSettings;
  return Rows("ins", &Configuration::ins)
      .word("driver", &I::driver, {"none", "mock", "xsens", "nmea", "ubx"})
      .text("port", &I::port, 200)
      .integer("baud", &I::baud, 0, 2000000, "baud")
      .number("rate", &I::rate, 1, 400, "Hz")
      .number("sync_out_hz", &I::sync_out_hz, -1, 400, "Hz")
      .number("sync_out_width_ms", &I::sync_out_width_ms, 0.1, 100, "ms")
      .number("processing_ms", &I::processing_ms, 0, 50, "ms")
      .numbers("lever_arm_m", &I::lever_arm_m, -100, 100, "m")
      .numbers("boresight_deg", &I::boresight_deg, -180, 180, "°");
}

Group comparison() {
  using C = ComparisonSettings;
  return Rows("comparison", &Configuration::comparison)
      .number("alignment_distance_m", &C::alignment_distance_m, 1, 100000, "m")
      .number("correlation_s", &C::correlation_s, 0.1, 3600, "s")
      .number("heading_sigma_deg", &C::heading_sigma_deg, 0, 180, "°")
      .number("max_gap_ms", &C::max_gap_ms, 1, 10000, "ms")
      .number("max_wait_ms", &C::max_wait_ms, 1, 3000, "ms");
}

Group odometry() {
  using O = OdometryOptions;
  Rows rows("odometry", &Configuration::odometry);
  rows.integer("features", &O::features, 50, 1000, "points")
      .choice("init_features", &O::init_features, {"corners", "surf"})
      .integer("pyramid_levels", &O::pyramid_levels, 2, 6, "levels")
      .number("band_px", &O::band_px, 0.5, 5, "px")
      .number("pixel_sigma", &O::pixel_sigma, 0.02, 5, "px")
      .number("parallax_sigma", &O::parallax_sigma, 0, 10, "px")
      .integer("window_keyframes", &O::window_keyframes, 3, 20, "keyframes")
      .number("extrinsic_rotation_sigma_rad", &O::extrinsic_rotation_sigma_rad, 0, 0.05, "rad")
      .integer("window_steps", &O::window_steps, 1, 30, "steps")
      .number("keyframe_parallax", &O::keyframe_parallax, 0.005, 0.3, "rad")
      .number("keyframe_tracked", &O::keyframe_tracked, 0.1, 1)
      .integer("min_inliers", &O::min_inliers, 6, 200, "points")
      .integer("ok_inliers", &O::ok_inliers, 6, 1000, "points")
      .integer("mlesac_hypotheses", &O::mlesac_hypotheses, 10, 1000)
      .integer("seed", &O::seed, 0, kLargestSeed);
  return rows.also(
      Rows("odometry", whole).choice("preset", &Configuration::preset, {"default", "small"}));
}

Group calibration_options() {
  using C = calibration::CalibrationOptions;
  return Rows("calibration", &Configuration::calibration)
      .integer("min_frames", &C::min_frames, 5, 150, "frames")
      .integer("max_frames", &C::max_frames, 10, 150, "frames")
      .integer("adopt_after", &C::adopt_after, 0, 1000, "frames")
      .integer("max_observations", &C::max_observations, 10'000, 1'000'000)
      .choice("intrinsics", &C::intrinsics, {"fixed", "focal", "full"})
      .number("focal_sigma_percent", &C::focal_sigma_percent, 0.001, 10, "%")
      .number("principal_point_sigma_px", &C::principal_point_sigma_px, 0.01, 50, "px")
      .number("lens_centre_sigma_px", &C::lens_centre_sigma_px, 0.01, 100, "px")
      .number("distortion_sigma", &C::distortion_sigma, 1e-5, 1)
      .number("tangential_sigma", &C::tangential_sigma, 1e-6, 0.1)
      .number("max_direction_deg", &C::max_direction_deg, 0.1, 180, "°")
      .number("max_rotation_deg", &C::max_rotation_deg, 0.1, 180, "°")
      .integer("min_near_points", &C::min_near_points, 0, 1000, "points")
      .number("near_baselines", &C::near_baselines, 5, 500, "baselines")
      .number("extrinsic_random_walk_mrad_per_sqrt_h", &C::extrinsic_random_walk_mrad_per_sqrt_h, 0,
              100, "mrad/√h")
      .number("max_depth_error_percent", &C::max_depth_error_percent, 0.1, 50, "%")
      .number("reference_depth_m", &C::reference_depth_m, 0.5, 500, "m")
      .number("good_depth_percent", &C::good_depth_percent, 0.01, 100, "%")
      .number("usable_depth_percent", &C::usable_depth_percent, 0.01, 100, "%")
      .also(Rows("calibration", whole).choice("online", &Configuration::online, {"off", "on"}));
}

Group monitor() {
  using M = calibration::MonitorOptions;
  return Rows("monitor", &Configuration::monitor)
      .number("threshold", &M::threshold, 20, 500)
      .number("bias_px", &M::bias_px, 0, 1, "px")
      .number("verified_bias_px", &M::verified_bias_px, 0, 2, "px")
      .number("unverified_bias_px", &M::unverified_bias_px, 0, 5, "px")
      .integer("min_matches", &M::min_matches, 12, 1000, "matches")
      .integer("short_window", &M::short_window, 1, 10, "frames")
      .integer("long_window", &M::long_window, 60, 1800, "frames")
      .integer("collapse_frames", &M::collapse_frames, 2, 60, "frames")
      .number("collapse_share", &M::collapse_share, 0.01, 0.9)
      .integer("collapse_expected", &M::collapse_expected, 10, 1000, "matches");
}

Group intrinsics_error() {
  using E = IntrinsicsErrorSettings;
  return Rows(
             "mock.intrinsics_error", [](auto& c) -> auto& { return c.mock.intrinsics_error; })
      .number("principal_point_px", &E::principal_point_px, 0, 50, "px")
      .number("focal_percent", &E::focal_percent, 0, 10, "%")
      .integer("seed", &E::seed, 0, kLargestSeed);
}

Group calibration_error() {
  using E = CalibrationErrorSettings;
  return Rows(
             "mock.calibration_error", [](auto& c) -> auto& { return c.mock.calibration_error; })
      .number("pitch_deg", &E::pitch_deg, -45, 45, "°")
      .number("yaw_deg", &E::yaw_deg, -45, 45, "°")
      .number("roll_deg", &E::roll_deg, -45, 45, "°")
      .number("x_m", &E::x_m, -1, 1, "m")
      .number("y_m", &E::y_m, -1, 1, "m")
      .number("z_m", &E::z_m, -1, 1, "m")
      .number("length_percent", &E::length_percent, -60, 200, "%");
}

Group mock() {
  using M = MockSettings;
  return Rows("mock", &Configuration::mock)
      .word("world", &M::world, {"suburb"})
      .choice("drive", &M::drive, {"loop", "figure-eight", "straight", "brief", "still"})
      .integer("seed", &M::seed, 0, kLargestSeed)
      .choice("pattern", &M::pattern, {"grey", "gbrg"})
      .choice("ins", &M::ins, {"noisy", "ideal"})
      .integer("texture_detail", &M::texture_detail, 0, 2)
      .integer("noise", &M::noise, 0, 1)
      .integer("blur_samples", &M::blur_samples, 1, 16)
      .number("speed", &M::speed, 0.01, 20, "m/s")
      .number("suspension", &M::suspension, 0, 3)
      .number("vibration", &M::vibration, 0, 5)
      .number("stop_s", &M::stop_s, 1, 3600, "s")
      .number("hill_deg", &M::hill_deg, 0, 5, "°")
      .number("clock_drift_ppm", &M::clock_drift_ppm, 0, 150, "ppm")
      .also(intrinsics_error())
      .also(calibration_error());
}

Group faults() {
  Group group;
  group.name = "faults";
  group.list = "faults.";
  for (std::size_t i = 0; i < kMaxFaults; ++i)
    group.keys.push_back(
        {"faults." + std::to_string(i), KeyType::text, "", 0, 200,
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

namespace {

/// The items of a list have the same keys: item 0 stands for all, as N.
std::string documented_name(const Group& group, const Key& key) {
  if (group.list.empty()) return key.name;
  const std::string first = group.list + "0";
  return key.name.starts_with(first) ? group.list + "N" + key.name.substr(first.size())
                                     : std::string();
}

}  // namespace

std::string refresh_document(const std::string& document) {
  constexpr std::array kTypes{"integer", "number", "text"};
  std::map<std::string, std::string> rows;
  for (const Group& group : schema())
    for (const Key& key : group.keys) {
      const std::string name = documented_name(group, key),
                        value = to_text(key.get(Configuration{}));
      rows[name] = fmt::format("| `{}` | {} | {} | {} | {} | ", name,
                               value.empty() ? "empty" : "`" + value + "`",
                               kTypes.at(static_cast<std::size_t>(key.type)),
                               key.unit.empty() ? "–" : key.unit, range_text(key));
    }
  rows.erase("");
  std::string page;
  std::istringstream lines(document);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("| `")) {
      const auto row = rows.extract(line.substr(3, line.find('`', 3) - 3));
      if (!row) continue;
      line = row.mapped() + line.substr(line.rfind(" | ") + 3);
    }
    page += line + "\n";
  }
  for (const auto& [name, row] : rows) page += row + "|\n";
  return page;
}

}  // namespace vergence::app
