#include "app/session/replay_session.hpp"

#include <array>
#include <utility>

#include <fmt/format.h>

#include "app/datasets/foreign_calibration.hpp"
#include "app/session/drive_calibration.hpp"
#include "app/session/recorded_source.hpp"
#include "app/session/session_source.hpp"

namespace vergence::app {
namespace {

/// The truth that lies with the data set, for the stamps that its frames have; empty when there is
/// none.
Trajectory read_reference(const ReplayRequest& request, const StereoSequence& sequence) {
  // The layouts of these formats have no ground truth.
  if (request.format == SequenceFormat::kitti_raw || request.format == SequenceFormat::st_lucia ||
      is_bag(request.format) || request.format == SequenceFormat::session)
    return {};
  const std::filesystem::path truth = request.data / "truth.tum";
  std::error_code ignored;
  const auto file =
      request.format == SequenceFormat::folder && std::filesystem::exists(truth, ignored)
          ? std::optional(truth)
          : find_truth(request.data);
  if (!file) return {};
  std::vector<Stamp> times;
  times.reserve(sequence.pairs.size());
  for (const StereoPair& pair : sequence.pairs) times.push_back(pair.stamp);
  return read_trajectory_file(*file, {.times = times}).poses;
}

/// Replaces the initial calibration by one from the sequence itself; where nothing is found
/// that stays, and a warning gives the reason.
bool calibrate_first(const ReplayRequest& request, const SignalGuard& signals,
                     const StereoSequence& sequence, StartingCalibration* begin) {
  Progress progress = Progress::on_stderr(request.session.quiet);
  const DriveCalibration found = calibrate_with_progress(
      {sequence, request.configuration, request.start, request.count_of(sequence), {}, {}}, *begin,
      signals, &progress);
  if (!found.rig) {
    progress.print("vergence: no calibration from the sequence: " + found.why);
    return false;
  }
  if (!request.session.quiet) progress.print(describe(found));
  begin->file.rig = *found.rig;
  begin->file.source = begin->source = "the sequence itself";
  begin->cause = "whole_drive";
  begin->trust = CalibrationTrust::given;
  return true;
}

/// Lenses are found from a beginning that is near enough. With nothing known about it: no
/// distortion, then that of a usual lens of 80 to 100 degrees.
void calibrate_unknown(ReplayRequest request, const SignalGuard& signals, StereoSequence* sequence,
                       StartingCalibration* begin) {
  if (calibrate_first(request, signals, *sequence, begin) || signals.stop_requested()) return;
  if (!request.known || request.known->model != CameraModelKind::pinhole_radtan) return;
  if (!request.session.quiet)
    fmt::print(stderr, "vergence: retrying with the initial distortion of a wide lens\n");
  request.known->wide = true;
  StereoSequence wide = open_drive(request);
  StartingCalibration other = replayed_calibration(request.configuration, wide, true);
  if (!calibrate_first(request, signals, wide, &other)) return;
  *sequence = std::move(wide);
  *begin = std::move(other);
}

/// Initial calibration of a recorded session, if requested to differ from the recorded one.
std::optional<StartingCalibration> other_beginning(const ReplayRequest& request,
                                                   const RecordedSession& session) {
  if (!request.calibration && !request.from_scratch && !request.baseline) return std::nullopt;
  const CalibrationUse use{request.from_scratch, request.baseline.value_or(0)};
  StartingCalibration begin = recorded_beginning(session.description(), request.data.string());
  if (request.calibration) {
    const Intrinsics& lens = begin.file.rig.intrinsics[0];
    const int recorded = begin.file.rig.cameras;
    begin.file = read_any_calibration(*request.calibration, ImageSize{lens.width, lens.height},
                                      &begin.remarks, use);
    if (begin.file.rig.cameras != recorded)
      throw InputError(fmt::format(
          "{}: has {} cameras, but {} was recorded with {}; use the calibration of that rig",
          *request.calibration, begin.file.rig.cameras, request.data.string(), recorded));
    begin.source = std::filesystem::path(*request.calibration).filename().string();
    for (const std::string& message : begin.remarks)
      if (!request.session.quiet) fmt::print(stderr, "vergence: {}\n", message);
  } else {
    apply_use(use, &begin.file.rig);
  }
  begin.trust = request.from_scratch ? CalibrationTrust::none : CalibrationTrust::given;
  begin.cause = "given";
  if (request.from_scratch) begin.source = "none";
  begin.nominal =
      nominal_geometry(begin.file.rig, begin.file.rig, request.configuration.calibration);
  return begin;
}

ExitCode replay_recording(const ReplayRequest& request) {
  RecordedSession session = RecordedSession::open(request.data);
  if (request.start >= session.frames().size())
    throw InputError(
        fmt::format("--start {} is beyond the end: {} has {} frames; choose a smaller index",
                    request.start, request.data.string(), session.frames().size()));
  auto other = other_beginning(request, session);
  const auto source = with_plain_errors(
      [&] { return session_source(request, std::move(session), std::move(other)); });
  const SignalGuard signals;
  return run_session(*source, request.configuration, request.session, signals);
}

}  // namespace

StereoSequence open_drive(const ReplayRequest& request) {
  std::vector<std::string> remarks;
  SequenceOptions o;
  o.use = {request.from_scratch || request.known, request.baseline.value_or(0)};
  o.cameras = {request.configuration.kitti_raw.left, request.configuration.kitti_raw.right};
  o.topics = request.topics;
  if (request.known) o.calibration = given_calibration(*request.known);
  if (request.calibration) o.calibration = given_calibration(*request.calibration, o.use, &remarks);
  StereoSequence sequence = open_sequence(request.format, request.data, o);
  if (!request.session.quiet)
    for (const std::string& message : remarks) fmt::print(stderr, "vergence: {}\n", message);
  return sequence;
}

std::vector<std::string> recorded_settings(const std::filesystem::path& session) {
  // Settings that affect poses; those of the simulated rig and the recording stay as recorded.
  constexpr std::array kept{"odometry.",        "calibration.",       "monitor.", "comparison.",
                            "ins.lever_arm_m.", "ins.boresight_deg.", "rig.name="};
  std::vector<std::string> settings = RecordedSession::open(session).description().settings;
  std::erase_if(settings, [&](const std::string& s) {
    const bool mask = s.starts_with("cameras.") && s.find(".mask=") != std::string::npos;
    return !mask &&
           std::ranges::none_of(kept, [&](const char* group) { return s.starts_with(group); });
  });
  return settings;
}

ExitCode run_replay(const ReplayRequest& request) {
  // With another calibration a recorded session is a sequence of images like any other.
  if (request.format == SequenceFormat::session && !request.calibrate_first && !request.known)
    return replay_recording(request);
  StereoSequence sequence = open_drive(request);
  if (request.start >= sequence.pairs.size())
    throw InputError(
        fmt::format("--start {} is beyond the end: {} has {} frames; choose a smaller index",
                    request.start, request.data.string(), sequence.pairs.size()));
  check_image_sizes(sequence, request.start, request.frames.value_or(sequence.pairs.size()));
  StartingCalibration begin =
      replayed_calibration(request.configuration, sequence, request.from_scratch || request.known);
  Trajectory truth = read_reference(request, sequence);
  ReplayedIns ins = replayed_ins(request, sequence);
  // One for both: who stops the calibration does not want the drive.
  const SignalGuard signals;
  if (request.calibrate_first) calibrate_unknown(request, signals, &sequence, &begin);
  if (const auto stopped = signals.stop_code()) return *stopped;
  const auto source = with_plain_errors([&] {
    return recorded_source(request, std::move(sequence), std::move(begin), std::move(truth),
                           std::move(ins));
  });
  return run_session(*source, request.configuration, request.session, signals);
}

}  // namespace vergence::app
