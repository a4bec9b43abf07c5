#include "app/checkerboard/board_report.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/math/angle.hpp"
#include "core/math/so3.hpp"

namespace vergence::app {
namespace {

int digits_for(double sigma) {
  return sigma > 0 ? std::clamp(static_cast<int>(std::ceil(1 - std::log10(sigma))), 1, 7) : 5;
}

std::vector<std::string> lens_numbers(const BoardReport& r) {
  const bool radtan = r.file.rig.intrinsics[0].kind == CameraModelKind::pinhole_radtan;
  std::vector<std::string> names{"fx, px", "fy, px", "cx, px", "cy, px"};
  if (radtan)
    names.insert(names.end(), {"k1", "k2", "p1", "p2"});
  else
    names.insert(names.end(), {"k1", "k2", "k3", "k4"});
  if (radtan && r.file.rig.intrinsics[0].distortion_sigma[4] > 0) names.emplace_back("k3");
  return names;
}

double lens_sigma(const Intrinsics& lens, std::size_t i) {
  return i < 4 ? lens.sigma[i] : lens.distortion_sigma[i - 4];
}

double lens_value(const Intrinsics& lens, std::size_t i) {
  const std::array first{lens.fx, lens.fy, lens.cx, lens.cy};
  return i < 4 ? first[i] : lens.distortion[i - 4];
}

std::string lens_table(const BoardReport& r) {
  const auto cameras = static_cast<std::size_t>(r.file.rig.cameras);
  std::string text = fmt::format("{:<14}", "");
  for (std::size_t k = 0; k < cameras; ++k) text += fmt::format("{:>36}", r.file.names[k]);
  text += "\n";
  const auto names = lens_numbers(r);
  for (std::size_t i = 0; i < names.size(); ++i) {
    text += fmt::format("{:<14}", names[i]);
    for (std::size_t k = 0; k < cameras; ++k) {
      const Intrinsics& lens = r.file.rig.intrinsics[k];
      const double sigma = lens_sigma(lens, i);
      const int digits = digits_for(sigma);
      text += fmt::format(
          "{:>36}", fmt::format("{:.{}f} ± {:.{}f}", lens_value(lens, i), digits, sigma, digits));
    }
    text += "\n";
  }
  const auto row = [&](const char* name, auto&& value) {
    text += fmt::format("{:<14}", name);
    for (std::size_t k = 0; k < cameras; ++k) text += fmt::format("{:>36}", value(k));
    text += "\n";
  };
  row("RMS of this camera, px",
      [&](std::size_t k) { return fmt::format("{:.4f}", r.found.cameras[k].alone_rms_px); });
  row("images", [&](std::size_t k) { return std::to_string(r.found.cameras[k].images); });
  return text;
}

std::string place_table(const BoardReport& r, std::size_t k) {
  const RigCalibration& rig = r.file.rig;
  const Vec3 turn = log_so3(rig.T_camera_left[k].R) * kDegreesPerRadian,
             t = rig.T_camera_left[k].t * 1e3;
  constexpr std::array kNames{"rotation x, °", "rotation y, °", "rotation z, °",
                              "t_x, mm",       "t_y, mm",       "t_z, mm"};
  std::string text = fmt::format("{} from {}: X_{} = R X_{} + t\n", r.file.names[k],
                                 r.file.names[0], r.file.names[k], r.file.names[0]);
  text += fmt::format("{:<16}{:>12}{:>12}{:>14}\n", "", "", "1 σ", "intrinsics fixed");
  for (std::size_t i = 0; i < 6; ++i) {
    const double unit = i < 3 ? kDegreesPerRadian : 1e3;
    const double sigma = unit * rig.sigma_total[k][i];
    const int digits = std::max(digits_for(sigma), i < 3 ? 4 : 3);
    const auto at = static_cast<Eigen::Index>(i % 3);
    // ° is one column and two bytes: fmt counts columns.
    text +=
        fmt::format("{:<16}{:>12.{}f}{:>12.{}f}{:>14.{}f}\n", kNames[i], i < 3 ? turn(at) : t(at),
                    digits, sigma, digits, unit * rig.sigma_noise[k][i], digits);
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
  text += lens_table(r) + "± 1 σ\n\n";
  for (std::size_t k = 1; k < static_cast<std::size_t>(rig.cameras); ++k)
    text += place_table(r, k) + "\n";
  if (rig.cameras > 1) text += baseline_message(r) + "\n";
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
