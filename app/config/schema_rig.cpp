#include <cstddef>
#include <iterator>
#include <string>
#include <utility>

#include "app/config/detail/schema_groups.hpp"

namespace vergence::app::groups {
namespace {

std::vector<std::pair<std::string, trigger_board::Edge>> edges() {
  using trigger_board::Edge;
  return {{"none", Edge::none}, {"rising", Edge::rising}, {"falling", Edge::falling}};
}

std::vector<std::pair<std::string, SyncMode>> sync_modes() {
  std::vector<std::pair<std::string, SyncMode>> modes;
  for (const SyncMode mode :
       {SyncMode::board, SyncMode::ins_syncout, SyncMode::master_strobe, SyncMode::bus,
        SyncMode::ptp, SyncMode::one_picture, SyncMode::counter, SyncMode::software})
    modes.emplace_back(to_string(mode), mode);
  return modes;
}

}  // namespace

Group rig() {
  using R = RigSettings;
  return Rows<R>(
             "rig", "The rig as a whole.", [](auto& c) -> auto& { return c.rig; })
      .text("name", &R::name, 64, "Name of the rig in the calibration.yaml that a session writes.")
      .number("nominal.baseline_m", &R::baseline_m, 0.02, 10, "m",
              "Distance of the right camera from the left one, to its right.")
      .number("nominal.focal_px", &R::focal_px, 0, 20000, "px",
              "Focal length of every camera; 0: 0.72 of the image's width.")
      .number("nominal.k1", &R::k1, -1, 1, "",
              "First radial coefficient of every lens, of the model that it has.")
      .number("nominal.k2", &R::k2, -1, 1, "", "Second radial coefficient of every lens.")
      .text(
          "state_dir", &R::state_dir, 400,
          "Folder of `calibration_state.yaml`, the last calibration accepted or confirmed: written "
          "at once, where the next `run` begins. Empty: "
          "`$XDG_STATE_HOME/vergence/NAME`, without that variable "
          "`~/.local/state/vergence/NAME`; `none`: there is none.")
      .done();
}

Group cameras() {
  using C = CameraSettings;
  Group all;
  for (std::size_t k = 0; k < kMaxCameras; ++k) {
    Group one =
        Rows<C>(
            "cameras." + std::to_string(k), "The cameras, a list; the first is the left one.",
            [k](auto& c) -> auto& { return c.cameras[k]; })
            .text("driver", &C::driver, 16,
                  "What talks to it: `mock`, `gige`, `iidc-usb`, `iidc-1394` or `v4l2`. Empty: "
                  "there is no such camera.")
            .text("name", &C::name, 32, "How it is called in messages and in calibration.yaml.")
            .text("serial", &C::serial, 64,
                  "Which one, where there are several; empty: the next one. GigE: or its address.")
            .choice<PictureHalf>(
                "half", &C::half,
                {{"whole", PictureHalf::whole},
                 {"left", PictureHalf::left},
                 {"right", PictureHalf::right}},
                "Of a camera that gives both images side by side in one picture: which one this "
                "is. Two entries with one `serial` then are one camera of twice the `size.0`.")
            .integer("size.0", &C::width, 64, 4096, "px", "Width of the image in pixels.")
            .integer("size.1", &C::height, 48, 4096, "px", "Height of the image in pixels.")
            .integer("offset.0", &C::offset_x, 0, 16384, "px",
                     "Left edge of the region that is read out, on the sensor.")
            .integer("offset.1", &C::offset_y, 0, 16384, "px", "Upper edge of that region.")
            .text("pixel_format", &C::pixel_format, 32,
                  "The device's own name (`Mono8`, `BayerGB8`, `GREY`); empty: the cheapest that "
                  "gives grey.")
            .choice<CameraTrigger>(
                "trigger", &C::trigger,
                {{"hardware", CameraTrigger::hardware},
                 {"software", CameraTrigger::software},
                 {"free", CameraTrigger::free}},
                "What makes it expose: `hardware`, a pulse at its input; `software`, a command "
                "at `trigger.rate`; `free`, its own "
                "clock. All cameras alike.")
            .options(
                "options", &C::options, 400,
                "What only this kind of camera has (docs/cameras): `NAME=VALUE …`, or a group: "
                "`{packet_size: 9000}`.")
            .number("exposure_us", &C::exposure_us, 10, 1e6, "µs",
                    "Time of an exposure; 8000 is daylight in the mock's world.")
            .number("trigger_delay_us", &C::trigger_delay_us, 0, 20000, "µs",
                    "From a pulse's edge to the start of the exposure: of the input (10 to 100 µs "
                    "if it is opto-coupled) and of the camera. "
                    "With `sync.mode` `board`, `ins_syncout` or `master_strobe` it goes into every "
                    "stamp, unless `trigger.feedback` measures it.")
            .number("stamp_jitter_us", &C::stamp_jitter_us, 0, 5000, "µs",
                    "By how much its stamps may be off the pulses; 0: what this driver's stamps "
                    "have (20, of a camera that only the host "
                    "stamps 1000). With more than half of `trigger.vary_us` only a pause proves "
                    "the pairing.")
            .number("gain_db", &C::gain_db, 0, 40, "dB", "Gain of the sensor's amplifier.")
            .text("mask", &C::mask, 400,
                  "PNG or PGM of the image's size, 0 where nothing is to be looked for: the "
                  "vehicle itself, dirt. A relative path begins "
                  "at this file's folder.")
            .choice<CameraModelKind>(
                "model", &C::model,
                {{"pinhole-radtan", CameraModelKind::pinhole_radtan},
                 {"pinhole-equidistant", CameraModelKind::pinhole_equidistant}},
                "What its lens is like: `pinhole-radtan`, k1 k2 p1 p2 k3; `pinhole-equidistant`, a "
                "fisheye lens, k1 k2 k3 k4.")
            .numbers("intrinsics", &C::intrinsics, 0, 20000, "px",
                     {"Focal length along x of this camera's lens; all four 0: the lens is that of "
                      "`rig.nominal`.",
                      "Focal length along y.", "Principal point of that lens, x.",
                      "Principal point of that lens, y."})
            .numbers("distortion", &C::distortion, -2, 2, "",
                     {"With `intrinsics`: first radial coefficient, k1.",
                      "Second radial coefficient, k2.",
                      "First tangential coefficient, p1; of an equidistant lens k3.",
                      "Second tangential coefficient, p2; of an equidistant lens k4.",
                      "Third radial coefficient, k3; an equidistant lens has none."})
            .numbers(
                "T_camera_left", &C::T_camera_left, -20, 20, "1, m",
                {"Where the camera sits, X_camera = R X_left + t, as rows of [R t]: r11. All zero: "
                 "parallel, N baselines to "
                 "the right.",
                 "The same transform: r12 of its rotation.",
                 "The same transform: r13 of its rotation.", "The same transform: t1 in metres.",
                 "The same transform: r21 of its rotation.",
                 "The same transform: r22 of its rotation.",
                 "The same transform: r23 of its rotation.", "The same transform: t2 in metres.",
                 "The same transform: r31 of its rotation.",
                 "The same transform: r32 of its rotation.",
                 "The same transform: r33 of its rotation.", "The same transform: t3 in metres."})
            .done();
    all.name = one.name;
    all.meaning = one.meaning;
    std::move(one.keys.begin(), one.keys.end(), std::back_inserter(all.keys));
  }
  all.list = "cameras.";
  return all;
}

Group exposure() {
  using E = ExposureSettings;
  return Rows<E>(
             "exposure",
             "Exposure and gain of all cameras together, while driving (docs/cameras.md).",
             [](auto& c) -> auto& { return c.exposure; })
      .choice("mode", &E::mode, {"fixed", "auto"},
              "`fixed`: as `cameras` says. `auto`: by the brightness of camera 0's images, the "
              "same for all cameras; they begin with camera "
              "0's.")
      .number("target", &E::target, 20, 200, "grey levels",
              "Mean of the image aimed at, of what its mask shows.")
      .number("saturated_percent", &E::saturated_percent, 0, 50, "%",
              "Share of the pixels that may be at the end of the scale.")
      .number("min_us", &E::min_us, 5, 100000, "µs", "Shortest exposure that is chosen.")
      .number("max_us", &E::max_us, 10, 200000, "µs",
              "Longest exposure, for the sake of motion blur; what is missing then comes from the "
              "gain.")
      .number("max_gain_db", &E::max_gain_db, 0, 40, "dB", "Largest gain that is chosen.")
      .integer(
          "settle_frames", &E::settle_frames, 2, 60, "frames",
          "Images after a change until one is judged again: one more than the cameras take for it.")
      .done();
}

Group trigger() {
  using T = TriggerSettings;
  return Rows<T>(
             "trigger", "What makes the cameras expose together.",
             [](auto& c) -> auto& { return c.trigger; })
      .text("driver", &T::driver, 16,
            "What makes the pulses: `board`, a trigger board on a serial port "
            "(docs/trigger_board.md); `mock`, with mock cameras; `none`: "
            "something that reports nothing, or nothing at all.")
      .text("port", &T::port, 200,
            "Serial port of the board, `/dev/ttyACM0`, or its serial number. Empty: the only board "
            "there is.")
      .integer("baud", &T::baud, 0, 3000000, "baud",
               "Rate of that line where it has one; 0: found by asking.")
      .number("rate", &T::rate, 1, 200, "Hz", "Pulses, and so images of every camera, a second.")
      .number("width_us", &T::width_us, 1, 100000, "µs",
              "Length of a pulse; what the cameras' inputs need.")
      .number("vary_us", &T::vary_us, 0, 20000, "µs",
              "Every interval is longer or shorter by this, in an order that does not repeat: the "
              "cameras' own stamps then prove at any time "
              "which frame is of which pulse. 0: even intervals, a pause proves it.")
      .integer("lines", &T::lines, 0, 15, "",
               "Outputs that are pulsed, a mask: bit k is line k, wired to camera k. 0: one for "
               "each camera.")
      .integer("active_low", &T::active_low, 0, 15, "",
               "Of these, the ones whose pulse is low: a mask.")
      .integer("feedback", &T::feedback, 0, 15, "",
               "Inputs that the cameras' exposure-active outputs are wired to, a mask: stamps are "
               "then the measured middle of the exposure.")
      .integer("feedback_active_low", &T::feedback_active_low, 0, 15, "",
               "Of these, the ones that are low while a camera exposes.")
      .choice(
          "pps", &T::pps, edges(),
          "Edge of the GNSS receiver's pulse per second at the board: `none` is wired, `rising` "
          "or `falling`.")
      .choice("ins", &T::ins, edges(),
              "Edge of the INS's SyncOut at the board: `none` is wired, `rising` or `falling`.")
      .done();
}

Group sync() {
  using S = SyncSettings;
  return Rows<S>(
             "sync", "How images are paired.", [](auto& c) -> auto& { return c.sync; })
      .choice<SyncMode>(
          "mode", &S::mode, sync_modes(),
          "By what images are paired, and what proves it (docs/time.md). Proven: `board`, by a "
          "trigger board's pulses; `ins_syncout`, by "
          "the INS's; `master_strobe`, camera 0 triggers the others; `bus`, stamps of one IEEE "
          "1394 cycle timer; `ptp`, stamps of one PTP "
          "clock; `one_picture`, both images come in one (`cameras.N.half`). Not proven: "
          "`counter`, exposure n of every camera belongs together; "
          "`software`, what was exposed within "
          "`tolerance_ms` by the host's clock, for cameras that nothing triggers.")
      .number("hold_ms", &S::hold_ms, 1, 10000, "ms",
              "How long the images of a pulse wait for one that is late.")
      .number("tolerance_ms", &S::tolerance_ms, 0.01, 1000, "ms",
              "With `software`, `bus`, `ptp` and `one_picture`: the farthest that exposures of one "
              "set are apart.")
      .done();
}

}  // namespace vergence::app::groups
