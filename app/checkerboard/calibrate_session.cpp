#include "app/checkerboard/calibrate_session.hpp"

#include <chrono>
#include <cmath>
#include <iostream>

#include <nlohmann/json.hpp>

#include "app/checkerboard/board_detector.hpp"
#include "app/checkerboard/board_images.hpp"
#include "app/checkerboard/coverage.hpp"
#include "app/config/calibration_checks.hpp"
#include "app/datasets/image_writer.hpp"
#include "app/devices/drive_devices.hpp"
#include "app/devices/rig_settings.hpp"
#include "app/runtime/nearest.hpp"
#include "app/runtime/signals.hpp"
#include "core/math/angle.hpp"
#include "core/math/so3.hpp"
#include "drivers/clock.hpp"

namespace vergence::app {
namespace {

/// Report of a target calibration.
struct BoardReport {
  const BoardCalibration& found;
  /// Names, and the rig as written.
  const CalibrationFile& file;
  const BoardPattern& board;
  const Coverage& coverage;
  /// In m.
  std::optional<double> measured_baseline{};
};

/// Value and sigma with the digits that the sigma permits.
std::string measured(double value, double sigma) {
  const int digits =
      sigma > 0 ? std::clamp(static_cast<int>(std::ceil(1 - std::log10(sigma))), 1, 7) : 5;
  return fmt::format("{:.{}f} ± {:.{}f}", value, digits, sigma, digits);
}

std::string describe_lens(const BoardReport& r, std::size_t k) {
  const Intrinsics& lens = r.file.rig.intrinsics[k];
  const bool radtan = lens.kind == CameraModelKind::pinhole_radtan;
  constexpr std::array kFirst{"fx", "fy", "cx", "cy"};
  constexpr std::array kRadtan{"k1", "k2", "p1", "p2", "k3"},
      kEquidistant{"k1", "k2", "k3", "k4", ""};
  const std::array first{lens.fx, lens.fy, lens.cx, lens.cy};
  std::string text = fmt::format("{}: {} images, {:.4f} px RMS alone\n ", r.file.names[k],
                                 r.found.cameras[k].images, r.found.cameras[k].alone_rms_px);
  for (std::size_t i = 0; i < first.size(); ++i)
    text += fmt::format(" {} {}", kFirst[i], measured(first[i], lens.sigma[i]));
  text += " px\n ";
  for (std::size_t i = 0; i < lens.distortion.size(); ++i)
    if (i < 4 || lens.distortion_sigma[i] > 0)
      text += fmt::format(" {} {}", radtan ? kRadtan[i] : kEquidistant[i],
                          measured(lens.distortion[i], lens.distortion_sigma[i]));
  return text + "\n";
}

std::string describe_place(const BoardReport& r, std::size_t k) {
  const RigCalibration& rig = r.file.rig;
  const Vec3 turn = log_so3(rig.T_camera_left[k].R) * kDegreesPerRadian,
             t = rig.T_camera_left[k].t * 1e3;
  std::string text =
      fmt::format("{0} from {1}: X_{0} = R X_{1} + t, ± 1 σ (with fixed intrinsics)\n",
                  r.file.names[k], r.file.names[0]);
  for (std::size_t i = 0; i < 6; ++i) {
    const double unit = i < 3 ? kDegreesPerRadian : 1e3;
    const auto axis = static_cast<Eigen::Index>(i % 3);
    text += fmt::format("  {} {}: {} {} ({:.2g})\n", i < 3 ? "rotation" : "t", "xyz"[axis],
                        measured(i < 3 ? turn(axis) : t(axis), unit * rig.sigma_total[k][i]),
                        i < 3 ? "°" : "mm", unit * rig.sigma_noise[k][i]);
  }
  return text;
}

std::string describe_baseline(const BoardReport& r) {
  const RigCalibration& rig = r.file.rig;
  std::string text = fmt::format("baseline {:.3f} ± {:.3f} mm", 1e3 * rig.T_camera_left[1].t.norm(),
                                 1e3 * rig.baseline_sigma);
  if (r.measured_baseline) {
    const double off = rig.T_camera_left[1].t.norm() - *r.measured_baseline;
    text += fmt::format("; measured {:.3f} mm, {:+.3f} mm ({:+.2f} %) off",
                        1e3 * *r.measured_baseline, 1e3 * off, 100 * off / *r.measured_baseline);
    if (std::abs(off) > 3 * rig.baseline_sigma)
      text += fmt::format(
          ", more than 3 sigma: squares of {:.4g} mm would agree; measure the target over all its "
          "squares",
          1e3 * r.board.square * *r.measured_baseline / rig.T_camera_left[1].t.norm());
  }
  return text + "\n";
}

/// Text for a terminal: intrinsics and extrinsics with sigmas, rejected views, missing coverage.
std::string format_report(const BoardReport& r) {
  const RigCalibration& rig = r.file.rig;
  const auto refused =
      std::ranges::count_if(r.found.views, [](const BoardViewResult& v) { return !v.used; });
  std::string text = fmt::format("{} views of a target with {} of {:g} mm: {} used, {} rejected\n",
                                 r.found.views.size(), r.board.describe(), 1e3 * r.board.square,
                                 rig.frames, refused);
  for (const BoardViewResult& v : r.found.views)
    if (!v.used) text += fmt::format("  rejected: {}, {:.3g} px RMS\n", v.name, v.rms_px);
  text += fmt::format("reprojection {:.4f} px RMS\n\n", rig.reprojection_px);
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k)
    text += describe_lens(r, k) + (k > 0 ? describe_place(r, k) : "");
  if (rig.cameras > 1) text += describe_baseline(r);
  const auto needs = r.coverage.needs();
  text += needs.empty() ? "Nothing is missing: every part of the images, tilts and distances.\n"
                        : fmt::format("Still missing: {}.\n", fmt::join(needs, "; "));
  return text;
}

/// Report as JSON; every key has its unit (docs/calibration.md).
nlohmann::ordered_json json_report(const BoardReport& r) {
  using Json = nlohmann::ordered_json;
  const RigCalibration& rig = r.file.rig;
  constexpr std::array kKinds = {"checkerboard", "aprilgrid", "charuco"};
  Json board{{"kind", kKinds[static_cast<std::size_t>(r.board.kind)]},
             {"columns", r.board.columns},
             {"rows", r.board.rows},
             {"square_m", r.board.square}};
  if (r.board.kind == BoardKind::aprilgrid) board["spacing"] = r.board.spacing;
  if (r.board.kind == BoardKind::charuco) {
    board["marker"] = r.board.marker;
    board["dictionary"] = std::string(kMarkerDictionaries[r.board.dictionary]);
  }
  Json json{{"board", std::move(board)}, {"reprojection_px", rig.reprojection_px}};
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k) {
    const Intrinsics& lens = rig.intrinsics[k];
    const BoardCameraResult& c = r.found.cameras[k];
    Json camera{{"name", r.file.names[k]},
                {"size", {lens.width, lens.height}},
                {"model", lens.kind == CameraModelKind::pinhole_radtan ? "pinhole-radtan"
                                                                       : "pinhole-equidistant"},
                {"images", c.images},
                {"alone_rms_px", c.alone_rms_px},
                {"intrinsics", {lens.fx, lens.fy, lens.cx, lens.cy}},
                {"intrinsics_sigma", lens.sigma},
                {"distortion", lens.distortion},
                {"distortion_sigma", lens.distortion_sigma}};
    if (k > 0) {
      const Transform& T = rig.T_camera_left[k];
      const Vec3 turn = log_so3(T.R) * kDegreesPerRadian;
      std::array<double, 6> sigma{}, held{};
      for (std::size_t i = 0; i < 6; ++i) {
        const double unit = i < 3 ? kDegreesPerRadian : 1e3;
        sigma[i] = unit * rig.sigma_total[k][i], held[i] = unit * rig.sigma_noise[k][i];
      }
      camera["place"] = {{"rotation_deg", {turn.x(), turn.y(), turn.z()}},
                         {"t_mm", {1e3 * T.t.x(), 1e3 * T.t.y(), 1e3 * T.t.z()}},
                         {"sigma_deg_mm", sigma},
                         {"sigma_lenses_held_deg_mm", held}};
    }
    json["cameras"].push_back(camera);
  }
  if (rig.cameras > 1) {
    json["baseline"] = {{"m", rig.T_camera_left[1].t.norm()}, {"sigma_m", rig.baseline_sigma}};
    if (r.measured_baseline) json["baseline"]["measured_m"] = *r.measured_baseline;
  }
  for (const BoardViewResult& v : r.found.views) {
    Json view{{"name", v.name}, {"used", v.used}};
    view["rms_px"] = std::isfinite(v.rms_px) ? Json(v.rms_px) : Json(nullptr);
    json["views"].push_back(view);
  }
  json["missing"] = r.coverage.needs();
  return json;
}

/// Why the views say too little of the lenses: half a message; empty: they do not.
std::string undetermined(const BoardCalibration& found) {
  constexpr std::size_t kFewest = 4;
  // Maximum sigma as a fraction of the focal length.
  constexpr double kMaxSigma = 0.02;
  // Views whose boards lie differently: by 2 degrees, or 3 % of their distance. One view many times
  // over says no more than once.
  constexpr double kTurn = 2 * kRadiansPerDegree, kShift = 0.03;
  std::vector<Transform> distinct;
  for (std::size_t v = 0; v < found.views.size(); ++v) {
    const Transform& T = found.T_left_board[v];
    const bool seen = std::ranges::any_of(distinct, [&](const Transform& other) {
      return rotation_angle(T.R * other.R.transpose()) < kTurn &&
             (T.t - other.t).norm() < kShift * T.t.norm();
    });
    if (found.views[v].used && !seen) distinct.push_back(T);
  }
  if (distinct.size() < kFewest)
    return fmt::format(
        "only {} of {} views differ from each other; at least {} are needed, 15 are better: move "
        "and tilt the target between the images",
        distinct.size(), found.views.size(), kFewest);
  for (std::size_t k = 0; k < static_cast<std::size_t>(found.rig.cameras); ++k) {
    const Intrinsics& lens = found.rig.intrinsics[k];
    if (lens.sigma[0] > kMaxSigma * lens.fx)
      return fmt::format(
          "the views do not determine the intrinsics of camera {}: the focal length {:.0f} px has "
          "a sigma of {:.0f} px ({:.1f} %; at most {:.0f} % is accepted): tilt the target more, "
          "and show it nearer and farther",
          k, lens.fx, lens.sigma[0], 100 * lens.sigma[0] / lens.fx, 100 * kMaxSigma);
  }
  return "";
}

/// With k3 where that explains the corners better: every camera's k3 is far from 0, and the
/// residuals shrink.
BoardCalibration calibrate_with_k3(const std::vector<BoardView>& views,
                                   BoardCalibrationOptions options, BoardCalibration without,
                                   Progress* progress) {
  // Limits relative to the residuals without the change.
  constexpr double kSigmas = 5, kBetter = 0.97;
  if (options.sixth_order || options.model != CameraModelKind::pinhole_radtan ||
      !without.error.empty())
    return without;
  options.sixth_order = true;
  BoardCalibration with = calibrate_boards(views, options);
  if (!with.error.empty() || with.rig.reprojection_px > kBetter * without.rig.reprojection_px)
    return without;
  for (std::size_t k = 0; k < static_cast<std::size_t>(with.rig.cameras); ++k) {
    const Intrinsics& lens = with.rig.intrinsics[k];
    if (!(std::abs(lens.distortion[4]) > kSigmas * lens.distortion_sigma[4])) return without;
  }
  progress->print(
      "vergence: k3 is also estimated: the residuals are {:.3f} px with it and {:.3f} px without",
      with.rig.reprojection_px, without.rig.reprojection_px);
  return with;
}

/// Takes views of the target from the cameras' images.
///
/// Threads  One; another one stops the source when a signal comes.
class Collection {
 public:
  Collection(const CalibrateRequest& request, const std::vector<std::string>& names,
             ViewCollector collector, Acquisition* source, Progress* progress)
      : request_(request),
        names_(names),
        source_(source),
        progress_(progress),
        collector_(std::move(collector)) {}

  /// Until the source ends, nothing is missing, or a signal comes.
  void run(const SignalGuard& signals) {
    const std::jthread stopper([this, &signals](const std::stop_token& ended) {
      while (!ended.stop_requested() && !signals.stop_requested())
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      source_->stop();
    });
    for (Acquired item; source_->next(&item);) {
      if (const auto* event = std::get_if<DeviceEvent>(&item)) report(*event);
      const auto* frame = std::get_if<AcquiredFrame>(&item);
      if (frame == nullptr) continue;
      if (!collector_.complete()) offer(frame->rig);
      source_->release(*frame);
      if (collector_.complete()) source_->stop();
    }
  }
  [[nodiscard]] const std::vector<BoardView>& views() const noexcept { return collector_.views(); }

 private:
  void report(const DeviceEvent& event) {
    const bool disconnected = event.kind == DeviceEvent::Kind::camera_disconnected;
    if (disconnected || event.kind == DeviceEvent::Kind::camera_reconnected)
      progress_->print(
          "vergence: camera {} {}", event.camera,
          disconnected ? "is disconnected; check its cable. Waiting for it" : "is reconnected");
  }

  void offer(const RigFrame& frame) {
    BoardView seen;
    const std::size_t number = collector_.views().size();
    seen.name = fmt::format("view {}", number);
    for (std::size_t k = 0; k < names_.size(); ++k)
      seen.corners[k] = find_board(frame.images[k], request_.calibration.board, BoardSearch::quick,
                                   seen.corners[0]);
    const OfferResult result = collector_.offer(seen);
    if (result == OfferResult::accepted && request_.keep_views) keep(frame, number);
    constexpr std::array kPhrases{"taken", "target not seen by all cameras", "hold it still",
                                  "already covered"};
    const auto needs = collector_.coverage().needs();
    state_.state = "calibrate";
    ++state_.frame;
    state_.activity = fmt::format(
        "{} views · {}{}", collector_.views().size(), kPhrases.at(static_cast<std::size_t>(result)),
        needs.empty() ? "" : fmt::format(" · missing: {}", fmt::join(needs, "; ")));
    progress_->update(state_);
  }

  void keep(const RigFrame& frame, std::size_t number) {
    for (std::size_t k = 0; k < names_.size(); ++k) {
      if (frame.images[k].empty()) continue;
      try {
        write_png(*request_.keep_views / fmt::format("{}_{:03}.png", names_[k], number),
                  frame.images[k]);
      } catch (const InputError& e) {
        progress_->print("vergence: {}; the view is used nevertheless", e.what());
      }
    }
  }

  const CalibrateRequest& request_;
  const std::vector<std::string>& names_;
  Acquisition* source_;
  Progress* progress_;
  ProgressState state_{};
  ViewCollector collector_;
};

}  // namespace

ExitCode conclude_calibration(const CalibrateRequest& request, const std::vector<ImageSize>& sizes,
                              CalibrationFile file, const std::vector<BoardView>& views,
                              Progress* progress) {
  BoardCalibrationOptions options = request.calibration;
  options.sizes = sizes;
  // Squares of real boards have between 2 mm and half a metre.
  if (const double square = options.board.square; square < 0.002 || square > 0.5)
    progress->print(
        "vergence: --square is {:g} m, unusually {}; check that it is in metres, because the "
        "baseline scales with it",
        square, square < 0.002 ? "small" : "large");
  const BoardCalibration found =
      calibrate_with_k3(views, options, calibrate_boards(views, options), progress);
  const std::string why = found.error.empty() ? undetermined(found) : found.error;
  if (!why.empty()) {
    progress->print("vergence: no calibration: " + why);
    return ExitCode::not_usable;
  }
  file.rig = found.rig;
  file.rig.found =
      Stamp(std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count());
  file.source = "checkerboard";
  write_calibration(request.out, file);
  Coverage coverage(options.board, {file.names.begin(), file.names.begin() + file.rig.cameras},
                    sizes, file.rig.intrinsics[0].fx);
  for (std::size_t v = 0; v < views.size(); ++v)
    if (found.views[v].used) coverage.add(views[v]);
  const BoardReport report{found, file, options.board, coverage, request.measured_baseline};
  std::cout << (request.json ? json_report(report).dump(1) + "\n" : format_report(report));
  if (file.rig.cameras > 1) {
    progress->print("vergence: " + baseline_message(file.rig));
    if (const std::string warning = baseline_warning(file.rig); !warning.empty())
      progress->print("vergence: " + warning);
  }
  progress->print("{}: written{}", request.out.string(),
                  file.rig.cameras == 1 ? "; it has one camera: copy its intrinsics into a "
                                          "configuration or into a calibration.yaml of the rig"
                                        : "");
  return ExitCode::done;
}

ExitCode calibrate_images(const CalibrateRequest& request,
                          const std::vector<std::vector<std::string>>& patterns) {
  constexpr std::array kOptions{"--left", "--right", "--camera", "--camera"};
  Progress progress = Progress::on_stderr(request.quiet);
  std::vector<std::vector<std::filesystem::path>> files;
  for (std::size_t k = 0; k < patterns.size(); ++k)
    files.push_back(matching_files(patterns[k], kOptions[k]));
  std::vector<std::string> remarks;
  const auto views = group_views(files, &remarks);
  BoardImages images =
      read_board_images(views, request.calibration.board, [&](std::size_t done, std::size_t found) {
        progress.update({.state = "calibrate",
                         .frame = done,
                         .frames = views.size(),
                         .activity = fmt::format("{} with the target", found)});
      });
  progress.finish();
  for (const std::string& message : remarks) progress.print("vergence: " + message);
  // By kind of board.
  constexpr std::array kHowToCount{"count the points where four squares meet",
                                   "at least four tags of the family 36h11 must be visible",
                                   "count squares of both colours; at least four markers must be "
                                   "visible, and --dictionary must match them"};
  // One message per view would hide the message that helps.
  if (images.views.empty())
    throw InputError("no view shows the target with {}{}; {} ({})",
                     request.calibration.board.describe(),
                     patterns.size() > 1 ? " in two cameras" : "",
                     kHowToCount.at(static_cast<std::size_t>(request.calibration.board.kind)),
                     images.remarks.empty() ? "there are no images" : images.remarks.front());
  for (const std::string& message : images.remarks) progress.print("vergence: " + message);
  return conclude_calibration(request, images.sizes, {}, images.views, &progress);
}

ExitCode calibrate_live(const CalibrateRequest& request, const Configuration& configuration) {
  const SignalGuard signals;
  if (const auto& folder = request.keep_views) {
    std::error_code error;
    std::filesystem::create_directories(*folder, error);
    if (!std::filesystem::is_directory(*folder, error) ||
        !std::filesystem::is_empty(*folder, error))
      throw InputError(folder->string() +
                       ": is not empty or cannot be created; --keep-views needs a new or empty "
                       "directory");
  }
  const Configuration c = capture_configuration(configuration);
  DriveDevices devices(c, {}, false, std::nullopt);
  Progress progress = Progress::on_stderr(request.quiet);
  for (const std::string& message : devices.remarks()) progress.print("vergence: " + message);
  CalibrationFile file{.rig_name = c.rig.name};
  std::vector<ImageSize> sizes;
  for (std::size_t k = 0; k < devices.cameras().size(); ++k) {
    const CameraSettings& camera = c.cameras[k];
    if (!camera.name.empty()) file.names[k] = camera.name;
    file.serials[k] = devices.cameras()[k]->info().serial;
    sizes.push_back({camera.width, camera.height});
  }
  // The files of --keep-views are named after the cameras.
  const std::vector<std::string> names =
      distinct_names({file.names.begin(), file.names.begin() + std::ssize(sizes)});
  std::ranges::copy(names, file.names.begin());
  const BoardPattern& board = request.calibration.board;
  Coverage coverage(board, names, sizes, nominal_rig(c).intrinsics[0].fx);
  Acquisition::Options options = devices.acquisition_options();
  options.tie_host = monotonic_now();
  Acquisition source(devices.cameras(), devices.ins(), devices.trigger(), options);
  Collection collection(request, names, ViewCollector(std::move(coverage), sizes[0].width), &source,
                        &progress);
  start_acquisition(&source);
  collection.run(signals);
  source.join();
  progress.finish();
  const auto stopped = signals.stop_code();
  for (const int camera : source.missing())
    progress.print("vergence: camera {} did not reconnect; check its cable and power", camera);
  if (collection.views().size() < kMinViews) {
    progress.print(
        "vergence: no calibration: {} views of the target were taken, at least {} are needed; "
        "check that it is {}, complete and well lit in every image",
        collection.views().size(), kMinViews, board.describe());
    return stopped.value_or(source.missing().empty() ? ExitCode::not_usable
                                                     : ExitCode::device_failed);
  }
  const ExitCode code =
      conclude_calibration(request, sizes, std::move(file), collection.views(), &progress);
  if (!source.missing().empty() && !stopped) return ExitCode::device_failed;
  return stopped.value_or(code);
}

}  // namespace vergence::app
