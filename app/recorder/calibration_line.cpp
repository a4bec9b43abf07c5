#include "app/recorder/calibration_line.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <string_view>

#include <fmt/format.h>

#include "core/math/so3.hpp"

namespace vergence::app {
namespace {

/// A comma and a number for each; commas alone where all are zero, which stands for "not given".
template <std::size_t N>
void append_sigmas(std::string* line, const std::array<double, N>& values) {
  const bool given = std::any_of(values.begin(), values.end(), [](double v) { return v > 0; });
  for (const double v : values)
    if (given)
      fmt::format_to(std::back_inserter(*line), ",{:.9f}", v);
    else
      *line += ',';
}

/// The first four coefficients and their sigmas.
void append_distortion(std::string* line, const Intrinsics& lens) {
  std::array<double, 4> sigma{};
  std::copy_n(lens.distortion_sigma.begin(), sigma.size(), sigma.begin());
  for (std::size_t i = 0; i < sigma.size(); ++i)
    fmt::format_to(std::back_inserter(*line), ",{:.9f}", lens.distortion[i]);
  append_sigmas(line, sigma);
}

/// A comma, and a word or sentence as one field.
void append_field(std::string* line, std::string_view text) {
  *line += ',';
  for (const char c : text) *line += c == ',' || c == '\n' || c == '"' ? ';' : c;
}

}  // namespace

void format_calibration(const CalibrationRecord& c, int camera, std::string* line) {
  const auto k = static_cast<std::size_t>(camera);
  const RigCalibration rig = c.rig.rig();
  line->clear();
  const auto out = std::back_inserter(*line);
  fmt::format_to(out, "{},{}", c.stamp.ns(),
                 c.accepted ? "accepted"
                 : c.learnt ? "kept"
                            : "rejected");
  append_field(line, c.cause);
  append_field(line, c.why());
  fmt::format_to(out, ",{}", rig.frames);
  if (c.decided)
    fmt::format_to(out, ",{},{},{:.4f},{:.4f},{:.4f},{:.6f}", c.latency_frames, c.onset_frame,
                   rig.reprojection_px, c.held_out_before_px, c.held_out_after_px, rig.scale_sigma);
  else
    fmt::format_to(out, ",,,{:.4f},,,{:.6f}", rig.reprojection_px, rig.scale_sigma);
  const Transform& T = rig.T_camera_left[k];
  const Vec3 phi = log_so3(T.R);
  fmt::format_to(out, ",{}", k);
  for (const double v : {phi.x(), phi.y(), phi.z(), T.t.x(), T.t.y(), T.t.z()})
    fmt::format_to(out, ",{:.9f}", v);
  append_sigmas(line, rig.sigma_noise[k]);
  append_sigmas(line, rig.sigma_wide[k]);
  const Intrinsics& lens = rig.intrinsics[k];
  fmt::format_to(out, ",{:.5f},{:.5f},{:.5f},{:.5f}", lens.fx, lens.fy, lens.cx, lens.cy);
  append_sigmas(line, lens.sigma);
  append_distortion(line, lens);
  append_distortion(line, rig.intrinsics[0]);
  if (c.decided && c.judged_depth_m > 0)
    fmt::format_to(out, ",{:.2f},{:.4f},{:.4f},{:d},{:d}", c.judged_depth_m, c.depth_sigma_percent,
                   c.depth_difference_percent, c.verified, c.lenses);
  else
    *line += ",,,,,";
  *line += '\n';
}

}  // namespace vergence::app
