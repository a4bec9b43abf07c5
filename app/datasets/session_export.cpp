#include "app/datasets/session_export.hpp"

#include <cmath>
#include <system_error>

#include "app/datasets/image_writer.hpp"
#include "app/datasets/reference_track.hpp"
#include "app/datasets/text_file.hpp"
#include "app/runtime/durable_file.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/transform_rows.hpp"

namespace vergence::app {
namespace {

namespace fs = std::filesystem;

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw InputError(folder.string() + ": cannot be created (" + error.message() + ")");
}

std::string sensor_yaml(const RigCalibration& rig, std::size_t k) {
  const Intrinsics& lens = rig.intrinsics[k];
  const auto& d = lens.distortion;
  const bool radtan = lens.kind == CameraModelKind::pinhole_radtan;
  return fmt::format(
      "sensor_type: camera\ncomment: {} camera; the body is the left camera\nT_BS:\n  cols: 4\n"
      "  rows: 4\n  data: [{},0,0,0,1]\nresolution: [{}, {}]\ncamera_model: pinhole\n"
      "intrinsics: [{}, {}, {}, {}]\ndistortion_model: {}\ndistortion_coefficients: [{}, {}, {}, "
      "{}{}]\n",
      k == 0 ? "left" : "right", fmt::join(rows_of(rig.T_camera_left[k].inverse()), ","),
      lens.width, lens.height, lens.fx, lens.fy, lens.cx, lens.cy,
      radtan ? "radial-tangential" : "equidistant", d[0], d[1], d[2], d[3],
      radtan && d[4] != 0 ? fmt::format(", {}", d[4]) : "");
}

/// Writes the images and text files of a layout.
class Writer {
 public:
  explicit Writer(const ExportRequest& request) : request_(request) {
    const RigCalibration& rig = request.calibration.rig;
    const Transform& T = rig.T_camera_left[1];
    if (request.format == ExportFormat::kitti &&
        (rig.intrinsics[0].has_distortion() || rig.intrinsics[1].has_distortion() ||
         !T.R.isApprox(Mat3::Identity(), 1e-9) || std::abs(T.t.y()) > 1e-9 ||
         std::abs(T.t.z()) > 1e-9))
      throw InputError(
          "--format kitti cannot store distortion and rotated cameras, which this rig has; use "
          "euroc or folder");
    for (std::size_t k = 0; k < 2; ++k) make_folder(images(k));
  }
  [[nodiscard]] fs::path image(std::size_t index, Stamp stamp, std::size_t camera) const {
    return images(camera) / (request_.format == ExportFormat::euroc
                                 ? fmt::format("{}.png", stamp.ns())
                                 : fmt::format("{:06}.png", index));
  }
  void add(Stamp stamp, const std::optional<Transform>& truth) {
    stamps_.push_back(stamp);
    if (truth) truth_.push_back({stamp, *truth});
  }

  /// Writes the text files after all images.
  void finish() const {
    const fs::path& out = request_.out;
    std::string projections;
    switch (request_.format) {
      case ExportFormat::folder:
        replace_durably(out / "times.txt",
                        lines([](Stamp stamp) { return fmt::format("{}", stamp.ns()); }));
        write_calibration(out / "calibration.yaml", request_.calibration);
        return write_tum();
      case ExportFormat::euroc:
        for (std::size_t k = 0; k < 2; ++k) {
          const fs::path camera = images(k).parent_path();
          replace_durably(camera / "data.csv",
                          "#timestamp [ns],filename\n" + lines([](Stamp stamp) {
                            return fmt::format("{0},{0}.png", stamp.ns());
                          }));
          replace_durably(camera / "sensor.yaml", sensor_yaml(request_.calibration.rig, k));
        }
        break;
      case ExportFormat::kitti:
        for (std::size_t k = 0; k < 2; ++k) {
          const Intrinsics& i = request_.calibration.rig.intrinsics[k];
          const double x = request_.calibration.rig.T_camera_left[k].t.x();
          projections += fmt::format("P{}: {} 0 {} {} 0 {} {} 0 0 0 1 0\n", k, i.fx, i.cx, i.fx * x,
                                     i.fy, i.cy);
        }
        replace_durably(out / "times.txt", lines([this](Stamp stamp) {
                          return format_seconds((stamp - stamps_.front()).ns());
                        }));
        replace_durably(out / "calib.txt", projections);
        break;
    }
    write_truth();
  }

 private:
  [[nodiscard]] fs::path images(std::size_t k) const {
    constexpr std::array<std::array<const char*, 2>, 3> kFolders{
        {{"left", "right"}, {"mav0/cam0/data", "mav0/cam1/data"}, {"image_0", "image_1"}}};
    return request_.out / kFolders[static_cast<std::size_t>(request_.format)][k];
  }

  template <class Line>
  [[nodiscard]] std::string lines(const Line& line) const {
    std::string text;
    for (const Stamp stamp : stamps_) text += line(stamp) + "\n";
    return text;
  }

  void write_tum() const {
    std::string tum;
    for (const StampedPose& pose : request_.truth) {
      const Eigen::Quaterniond q = quaternion(pose.T_world_body.R);
      const Vec3& t = pose.T_world_body.t;
      tum += fmt::format("{} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
                         format_seconds(pose.stamp.ns()), t.x(), t.y(), t.z(), q.x(), q.y(), q.z(),
                         q.w());
    }
    if (!tum.empty()) replace_durably(request_.out / "truth.tum", tum);
  }

  void write_truth() const {
    if (truth_.empty()) return;
    const fs::path folder = request_.out / "mav0/state_groundtruth_estimate0";
    std::string kitti,
        euroc =
            "#timestamp,p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],"
            "q_RS_z []\n";
    for (const StampedPose& pose : truth_) {
      const Eigen::Quaterniond q = quaternion(pose.T_world_body.R);
      const Vec3& t = pose.T_world_body.t;
      kitti += fmt::format("{}\n", fmt::join(rows_of(pose.T_world_body), " "));
      euroc += fmt::format("{},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f}\n", pose.stamp.ns(),
                           t.x(), t.y(), t.z(), q.w(), q.x(), q.y(), q.z());
    }
    if (request_.format == ExportFormat::kitti)
      return replace_durably(request_.out / "poses.txt", kitti);
    make_folder(folder);
    replace_durably(folder / "data.csv", euroc);
  }

  const ExportRequest& request_;
  std::vector<Stamp> stamps_;
  // Ground truth of these frames.
  Trajectory truth_;
};

/// Returns false if one image of the pair is missing.
bool load_pair(const RecordedSession& session, const RecordedFrame& frame,
               std::array<std::vector<std::uint8_t>, 2>* pixels) {
  for (std::size_t k = 0; k < 2; ++k) {
    const RecordedImage& image = frame.images[k];
    const auto width = static_cast<std::size_t>(image.width);
    (*pixels)[k].resize(width * static_cast<std::size_t>(image.height));
    if (!session.read(frame, k, (*pixels)[k].data(), width)) return false;
  }
  return true;
}

}  // namespace

ExportResult export_session(const RecordedSession& session, ExportRequest request,
                            const std::function<void(std::size_t)>& progress) {
  ExportResult result{.remarks = session.remarks()};
  const auto& frames = session.frames();
  const auto first = std::ranges::find_if(frames, [](const RecordedFrame& f) {
    return f.images[0].offset != 0 && f.images[1].offset != 0;
  });
  if (first == frames.end())
    throw InputError(
        "the recording has no frame with both images, so nothing is exported; record with record: "
        "[images]");
  for (std::size_t k = 0; k < 2; ++k) {
    const RecordedImage& image = first->images[k];
    const Intrinsics& lens = request.calibration.rig.intrinsics[k];
    if (image.width != lens.width || image.height != lens.height)
      throw InputError(
          "the {} camera's images have {}x{} pixels, but the calibration is for {}x{}; use the "
          "calibration that belongs to these images",
          k == 0 ? "left" : "right", image.width, image.height, lens.width, lens.height);
  }
  if (first->given.cameras > 2)
    result.remarks.push_back(fmt::format(
        "{} cameras were recorded; the first two are exported, because the format has only two",
        first->given.cameras));
  request.calibration.rig.cameras = 2;
  Writer writer(request);
  const ReferenceTrack track(request.truth);
  std::array<std::vector<std::uint8_t>, 2> pixels;
  std::size_t done = 0, without_truth = 0;
  for (const RecordedFrame& frame : frames) {
    progress(done++);
    if (!load_pair(session, frame, &pixels)) {
      ++result.left_out;
      continue;
    }
    const auto truth = track.at(frame.given.stamp);
    without_truth += truth ? 0 : 1;
    // KITTI has a pose for every frame.
    if (request.format == ExportFormat::kitti && !request.truth.empty() && !truth) continue;
    for (std::size_t k = 0; k < 2; ++k) {
      const RecordedImage& image = frame.images[k];
      write_png(writer.image(result.frames, frame.given.stamp, k),
                {pixels[k].data(), image.width, image.height, image.width});
    }
    writer.add(frame.given.stamp, truth);
    ++result.frames;
  }
  if (without_truth > 0 && !request.truth.empty())
    result.remarks.push_back(
        fmt::format("{} frames have no ground truth{}", without_truth,
                    request.format == ExportFormat::kitti ? " and are left out" : ""));
  if (result.frames == 0)
    throw InputError(
        "no frame has two readable images and a ground truth, so nothing is exported; check that "
        "the recording is complete");
  writer.finish();
  return result;
}

}  // namespace vergence::app
