#include "app/checkerboard/board_report.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/math/angle.hpp"
#include "core/math/so3.hpp"

namespace vergence::app {
namespace {

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

std::string baseline_message(const BoardReport& r) {
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

}  // namespace

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
  if (rig.cameras > 1) text += baseline_message(r);
  const auto needs = r.coverage.needs();
  text += needs.empty() ? "Nothing is missing: every part of the images, tilts and distances.\n"
                        : fmt::format("Still missing: {}.\n", fmt::join(needs, "; "));
  return text;
}

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

}  // namespace vergence::app
