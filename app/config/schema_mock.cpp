#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <variant>

#include "app/config/detail/schema_groups.hpp"

namespace vergence::app::groups {
namespace {

Group intrinsics_error() {
  using E = IntrinsicsErrorSettings;
  constexpr std::int64_t kLargestSeed = std::numeric_limits<std::int64_t>::max();
  return Rows<E>(
             "mock.intrinsics_error", "", [](auto& c) -> auto& { return c.mock.intrinsics_error; })
      .number("principal_point_px", &E::principal_point_px, 0, 50, "px",
              "Sigma of the error of each principal point coordinate that the estimator is given; "
              "what is rendered stays exact.")
      .number("focal_percent", &E::focal_percent, 0, 10, "%",
              "Sigma of the error of the focal length that it is given, one draw a camera.")
      .integer("seed", &E::seed, 0, kLargestSeed, "",
               "Of these errors: the same seed, the same errors.")
      .done();
}

Group calibration_error() {
  using E = CalibrationErrorSettings;
  return Rows<E>(
             "mock.calibration_error", "",
             [](auto& c) -> auto& { return c.mock.calibration_error; })
      .number("pitch_deg", &E::pitch_deg, -45, 45, "°",
              "Camera 1 of the transform that the estimator is given, against the true one: turned "
              "about its x axis.")
      .number("yaw_deg", &E::yaw_deg, -45, 45, "°", "The same, turned about its y axis.")
      .number("roll_deg", &E::roll_deg, -45, 45, "°", "The same, turned about its z axis.")
      .number("x_m", &E::x_m, -1, 1, "m", "The same, shifted along its x axis.")
      .number("y_m", &E::y_m, -1, 1, "m", "The same, shifted along its y axis.")
      .number("z_m", &E::z_m, -1, 1, "m", "The same, shifted along its z axis.")
      .number("length_percent", &E::length_percent, -60, 200, "%",
              "By how much every length that it is given is too long, the baseline's included; "
              "images alone cannot show it.")
      .done();
}

}  // namespace

Group mock() {
  using M = MockSettings;
  using Kind = vergence::mock::DriveKind;
  constexpr std::int64_t kLargestSeed = std::numeric_limits<std::int64_t>::max();
  return Rows<M>(
             "mock", "The world and the vehicle of the mock drivers; see docs/mock.md.",
             [](auto& c) -> auto& { return c.mock; })
      .text("world", &M::world, 16, "What is driven through: `suburb`.")
      .choice("drive", &M::drive,
              {{"loop", Kind::loop},
               {"figure-eight", Kind::figure_eight},
               {"straight", Kind::straight},
               {"brief", Kind::brief},
               {"still", Kind::still}},
              "Where: `loop` (1 km), `figure-eight`, `straight`, `brief` (120 m) or `still`.")
      .integer("seed", &M::seed, 0, kLargestSeed, "",
               "Of the town, the vehicle's unrest and all noise: the same seed, the same drive.")
      .choice("pattern", &M::pattern,
              {{"grey", vergence::mock::Pattern::grey}, {"gbrg", vergence::mock::Pattern::gbrg}},
              "Sensors: `grey`, or `gbrg` (Bayer).")
      .choice("ins", &M::ins, {{"noisy", M::Ins::noisy}, {"ideal", M::Ins::ideal}},
              "Errors of the INS: `noisy` as an MTi-G, or `ideal`.")
      .integer("texture_detail", &M::texture_detail, 0, 2, "",
               "Resolution of the facades: 4.7, 2.3 or 1.2 cm a texel (8, 32, 128 MB).")
      .integer("noise", &M::noise, 0, 1, "", "1: shot and read noise of the sensors; 0: none.")
      .integer("blur_samples", &M::blur_samples, 1, 16, "",
               "Poses averaged over an exposure: 1 is no motion blur; time grows with it.")
      .number("speed", &M::speed, 0.01, 20, "m/s", "Speed on the straights.")
      .number("suspension", &M::suspension, 0, 3, "",
              "Gain on pitch, roll and heave of the springs.")
      .number("vibration", &M::vibration, 0, 5, "", "Gain on the shake at 6 to 12 Hz.")
      .number(
          "stop_s", &M::stop_s, 1, 3600, "s",
          "Length of each stop, and of the standing start and end, which last a minute at most.")
      .number("hill_deg", &M::hill_deg, 0, 5, "°", "Steepest slope of the streets.")
      .number("clock_drift_ppm", &M::clock_drift_ppm, 0, 150, "ppm",
              "Largest drift of the devices' clocks; each has its own.")
      .also(intrinsics_error())
      .also(calibration_error())
      .done();
}

Group faults() {
  Group group;
  group.name = "faults";
  group.list = "faults.";
  group.meaning =
      "What goes wrong in the mock, a list; docs/mock.md has the kinds and their parameters.";
  for (std::size_t i = 0; i < kMostFaults; ++i)
    group.keys.push_back(
        {"faults." + std::to_string(i), KeyType::text, "", 0, 200,
         "`KIND@SECONDS NAME=NUMBER …`, or the same as a group: `{at: 42, kind: knock, camera: 1, "
         "pitch_deg: 0.2}`.",
         [i](Configuration& c, const KeyValue& v) { c.faults[i] = std::get<std::string>(v); },
         [i](const Configuration& c) -> KeyValue { return c.faults[i]; }});
  return group;
}

}  // namespace vergence::app::groups
