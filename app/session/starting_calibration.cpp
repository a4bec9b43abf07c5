#include "app/session/starting_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <system_error>

#include "app/config/calibration_state.hpp"
#include "app/datasets/foreign_calibration.hpp"
#include "app/devices/rig_settings.hpp"
#include "app/runtime/errors.hpp"
#include "core/math/angle.hpp"
#include "core/math/so3.hpp"

namespace vergence::app {

namespace {

/// Ours is one file: a pair or a folder of them is refused with the other formats.
bool is_foreign(const std::string& in) {
  std::error_code ignored;
  return !std::filesystem::is_regular_file(in, ignored) || !is_own_calibration(in);
}

/// The device's own serial says which camera it is: what the configuration finds it by may be an
/// address, behind which it can be exchanged. A mock's camera is the one asked for.
std::string expected_serial(const CameraSettings& camera, const std::string& own) {
  return own.empty() || (camera.driver == "mock" && !camera.serial.empty()) ? camera.serial : own;
}

/// The configuration's words around the numbers, and the cameras that are there.
void name_cameras(const Configuration& c, const std::vector<std::string>& serials,
                  CalibrationFile* file) {
  if (!c.rig.name.empty()) file->rig_name = c.rig.name;
  for (std::size_t k = 0; k < static_cast<std::size_t>(file->rig.cameras); ++k) {
    if (!c.cameras[k].name.empty()) file->names[k] = c.cameras[k].name;
    const std::string serial = expected_serial(c.cameras[k], k < serials.size() ? serials[k] : "");
    if (!serial.empty()) file->serials[k] = serial;
  }
}

/// Returns true if the configuration states the cameras' transforms. The mock's rig always is the
/// configured one, defaults included.
bool placed_by_configuration(const Configuration& c, int cameras) {
  for (std::size_t k = 1; k < static_cast<std::size_t>(cameras); ++k) {
    const auto& T = c.cameras[k].T_camera_left;
    if (c.cameras[k].driver != "mock" && std::ranges::all_of(T, [](double v) { return v == 0; }))
      return false;
  }
  return true;
}

/// Refuses a calibration of other cameras; of other serials it is a remark, for a camera may have
/// been replaced by its like.
void check_same_rig(const std::string& name, const CalibrationFile& file,
                    const CalibrationFile& configured, std::vector<std::string>* remarks) {
  if (const std::string other = other_images(file.rig, configured.rig); !other.empty())
    throw InputError(name + ": " + other + "; use the calibration of this rig and image size");
  for (std::size_t k = 0; k < static_cast<std::size_t>(file.rig.cameras); ++k)
    if (!file.serials[k].empty() && !configured.serials[k].empty() &&
        file.serials[k] != configured.serials[k])
      remarks->push_back(
          fmt::format("{}: is of a camera {} with the serial \"{}\", but the connected one has "
                      "\"{}\"; check that it is the right calibration",
                      name, k, file.serials[k], configured.serials[k]));
  // Images show no length.
  const double found_m = file.rig.baseline, expected_m = configured.rig.baseline;
  if (std::abs(found_m - expected_m) >= kOtherLength * expected_m)
    remarks->push_back(fmt::format(
        "{}: has a baseline of {:g} m, but the configuration {:g} m; the file's baseline is used",
        name, found_m, expected_m));
}

}  // namespace

GivenCalibration given_calibration(const std::string& in, const CalibrationUse& use,
                                   std::vector<std::string>* remarks) {
  return {in, [in, use, remarks](const StereoSequence& sequence) {
            // The images are only looked at for a file that may lack their size.
            const std::optional<ImageSize> size =
                is_foreign(in) ? std::optional(first_image_size(sequence, 0)) : std::nullopt;
            return read_any_calibration(in, size, remarks, use);
          }};
}

GivenCalibration given_calibration(const AssumedIntrinsics& known) {
  return {"--focal", [known](const StereoSequence& sequence) {
            const ImageSize size = first_image_size(sequence, 0);
            CalibrationFile file{.rig = {.cameras = 2, .baseline = known.baseline},
                                 .source = "given"};
            Intrinsics lens{.kind = known.model};
            lens.width = size.width, lens.height = size.height;
            lens.fx = lens.fy = known.focal;
            lens.cx = (size.width - 1) / 2.0, lens.cy = (size.height - 1) / 2.0;
            if (known.wide) lens.distortion = {-0.28, 0.07, 0, 0, 0};
            file.rig.intrinsics = {lens, lens};
            make_parallel(&file.rig);
            return file;
          }};
}

RigCalibration nominal_geometry(const RigCalibration& given, const RigCalibration& mounted,
                                const calibration::CalibrationOptions& options) {
  RigCalibration nominal = given;
  apply_use({.length_only = true}, &nominal);
  const double length = mounted.T_camera_left[1].t.norm();
  // The user may have measured another baseline.
  const double factor = length > 0 ? given.baseline / length : 1;
  for (std::size_t k = 1; k < static_cast<std::size_t>(nominal.cameras); ++k) {
    const Transform& T = mounted.T_camera_left[k];
    if (log_so3(T.R).norm() > options.max_rotation_deg * kRadiansPerDegree ||
        angle_between(T.t, nominal.T_camera_left[k].t) >
            options.max_direction_deg * kRadiansPerDegree)
      nominal.T_camera_left[k] = {T.R, factor * T.t};
  }
  return nominal;
}

StartingCalibration starting_calibration(const Configuration& c, const CalibrationSource& source,
                                         const std::vector<std::string>& serials) {
  CalibrationFile configured{.rig = nominal_rig(c), .source = "given"};
  name_cameras(c, serials, &configured);
  configured.configured = configured_rig(c);
  StartingCalibration start{
      .file = configured, .source = "the configuration", .state = state_file(c.rig)};

  const bool from_scratch =
      source.from_scratch || (!source.file && !placed_by_configuration(c, configured.rig.cameras));
  if (source.file) {
    const ImageSize size{configured.rig.intrinsics[0].width, configured.rig.intrinsics[0].height};
    start.file = read_any_calibration(source.file->string(), size, &start.remarks,
                                      {.length_only = source.from_scratch});
    check_same_rig(source.file->string(), start.file, configured, &start.remarks);
    name_cameras(c, serials, &start.file);
    start.source = source.file->filename().string();
  } else if (!source.from_scratch && start.state) {
    CalibrationState state = read_state(*start.state, configured);
    if (!state.message.empty()) start.remarks.push_back(std::move(state.message));
    if (state.calibration) {
      start.file = std::move(*state.calibration);
      name_cameras(c, serials, &start.file);
      start.trust = CalibrationTrust::state_file;
      start.cause = "state_file";
      start.source = start.state->string();
    }
  }
  if (from_scratch && start.trust != CalibrationTrust::state_file) {
    apply_use({.length_only = true}, &start.file.rig);
    start.trust = CalibrationTrust::none;
    start.source = "none";
  }
  start.file.configured = configured.configured;
  start.nominal = nominal_geometry(start.file.rig, mounted_rig(c), c.calibration);
  return start;
}

StartingCalibration replayed_calibration(const Configuration& c, const StereoSequence& sequence,
                                         bool from_scratch) {
  StartingCalibration start{
      .file = {.rig = sequence.calibration, .rig_name = c.rig.name, .source = "given"},
      .source = from_scratch ? "none" : sequence.calibration_source};
  name_cameras(c, {}, &start.file);
  if (from_scratch) start.trust = CalibrationTrust::none;
  start.nominal = nominal_geometry(sequence.calibration, sequence.calibration, c.calibration);
  return start;
}

EstimatorOptions estimator_options(const Configuration& c, CalibrationTrust trust,
                                   Adoption adoption,
                                   const std::array<ImageView, kMaxCameras>& masks,
                                   Duration frame_budget) {
  return {.odometry = c.odometry,
          .calibration = c.calibration,
          .monitor = c.monitor,
          .trust = trust,
          .adoption = adoption,
          .masks = masks,
          .frame_budget = frame_budget,
          .online = c.online != 0};
}

}  // namespace vergence::app
