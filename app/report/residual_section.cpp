#include "app/report/residual_section.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "app/report/plots.hpp"
#include "app/report/svg.hpp"

namespace vergence::app::report {
namespace {

constexpr int kShades = 5;       // of either sign; a shade is a class of the style sheet
constexpr double kLeast = 0.05;  // px: the scale of a field that is nothing but noise
constexpr double kFoot = 40;     // of the paper: room for the scale
constexpr double kTallest = 330;
constexpr std::array kPositive{"f-ours o1", "f-ours o2", "f-ours o3", "f-ours o4", "f-ours o5"};
constexpr std::array kNegative{"f-theirs o1", "f-theirs o2", "f-theirs o3", "f-theirs o4",
                               "f-theirs o5"};

using Field = std::vector<ResidualRow>;

Field field_of(const Session& s, int camera, bool at_the_end) {
  Field field;
  for (const ResidualRow& r : s.residuals)
    if (r.camera == camera && r.at_the_end == at_the_end) field.push_back(r);
  return field;
}

/// Root mean square of the cells' means.
double rms(const Field& field) {
  double sum = 0;
  for (const ResidualRow& r : field) sum += r.mean_px * r.mean_px;
  return std::sqrt(sum / static_cast<double>(field.size()));
}

double largest(const Field& field, double least) {
  for (const ResidualRow& r : field) least = std::max(least, std::abs(r.mean_px));
  return least;
}

/// The class for a value; grey: too little to be seen.
const char* shade(double value, double scale) {
  const auto i = static_cast<int>(std::lround(std::min(1.0, std::abs(value) / scale) * kShades));
  if (i == 0) return "track";
  const auto at = static_cast<std::size_t>(i - 1);
  return value > 0 ? kPositive[at] : kNegative[at];
}

std::string signed_px(double value) {
  const double shown = std::abs(value) < 9.95 ? std::round(value * 100) / 100 : std::round(value);
  if (shown == 0) return "0";
  return fmt::format("{}{:.{}f}", shown < 0 ? "−" : "+", std::abs(shown),
                     std::abs(shown) < 9.95 ? 2 : 0);
}

void draw_scale(double scale, double y, Svg* svg) {
  constexpr double kBox = 16, kTall = 10;
  const double middle = kPlotWidth / 2, half = (kShades + 0.5) * kBox;
  for (int i = -kShades; i <= kShades; ++i)
    svg->rect(shade(i * scale / kShades, scale), middle + (i - 0.5) * kBox, y, kBox - 1, kTall);
  svg->text("", Anchor::end, middle - half - 6, y + kTall, signed_px(-scale) + " px");
  svg->text("", Anchor::start, middle + half + 6, y + kTall, signed_px(scale) + " px");
}

std::string picture(const Field& field, double scale) {
  double width = 1, height = 1;
  for (const ResidualRow& r : field)
    width = std::max(width, r.left + r.width), height = std::max(height, r.top + r.height);
  const double unit = std::min(kPlotWidth / width, (kTallest - kFoot) / height),
               left = (kPlotWidth - width * unit) / 2;
  Svg svg(kPlotWidth, height * unit + kFoot,
          "Mean distance of matches to their epipolar lines over the left image");
  svg.rect("sheet", left, 0, width * unit, height * unit);
  for (const ResidualRow& r : field) {
    const double x = left + r.left * unit, y = r.top * unit, w = r.width * unit,
                 h = r.height * unit;
    svg.rect(shade(r.mean_px, scale), x, y, w - 1, h - 1);
    constexpr double kReadable = 42, kTall = 15;  // room for a number
    if (w >= kReadable && h >= kTall)
      svg.text("cell", Anchor::middle, x + w / 2, y + h / 2 + 4.5, signed_px(r.mean_px));
  }
  draw_scale(scale, height * unit + 18, &svg);
  return std::move(svg).finish();
}

std::string figure_of(const std::string& whose, const char* when, const Field& field,
                      double scale) {
  return fmt::format("<section><figure><h3>{}, {} · rms {:.2f} px</h3>{}</figure></section>\n",
                     whose, when, rms(field), picture(field, scale));
}

}  // namespace

std::string residual_section(const Session& session) {
  std::string figures;
  for (int camera = 1; camera < kMaxCameras; ++camera) {
    const Field begin = field_of(session, camera, false), end = field_of(session, camera, true);
    const double scale = largest(end, largest(begin, kLeast));
    const std::string whose = camera == 1 ? "Right camera" : fmt::format("Camera {}", camera);
    if (!begin.empty()) figures += figure_of(whose, "calibration of the start", begin, scale);
    if (!end.empty()) figures += figure_of(whose, "calibration of the end", end, scale);
  }
  if (figures.empty()) return "";
  return "<section class=\"wide\"><h2>How the calibration fits the images</h2><p "
         "class=\"soft\">Mean signed distance of matches in the "
         "other "
         "image to the epipolar lines of their points in the left one, by where these lie in it. "
         "Below its line is positive (to the left, "
         "of cameras one above the other). A true calibration leaves noise, zero on average "
         "everywhere; a pattern is what it does not "
         "describe. Empty places: no tracks.</p></section>\n" +
         figures;
}

}  // namespace vergence::app::report
