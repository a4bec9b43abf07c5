#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "app/report/csv.hpp"
#include "app/report/detail/session_parts.hpp"

/// calibrations.csv and residuals.csv of a session.
namespace vergence::app::report {
namespace {

namespace fs = std::filesystem;

bool read_six(const CsvRows& rows, const char* prefix, std::array<double, 6>* out) {
  constexpr std::array<const char*, 6> kAxes{"rx", "ry", "rz", "tx", "ty", "tz"};
  for (std::size_t i = 0; i < 6; ++i) {
    const auto v = rows.number(rows.column(std::string(prefix) + kAxes[i]));
    if (!v || std::abs(*v) > 1e6) return false;
    (*out)[i] = *v;
  }
  return true;
}

void read_lens(const CsvRows& rows, CalibrationRow* c) {
  constexpr std::array<const char*, 8> kNames{"fx", "fy", "cx", "cy", "d0", "d1", "d2", "d3"};
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    c->lens[i] = rows.number(rows.column(kNames[i])).value_or(kNone);
    c->lens_sigma[i] = rows.number(rows.column(std::string("sigma_") + kNames[i])).value_or(kNone);
  }
}

/// Nothing: a number is missing or makes no rectangle of an image.
std::optional<ResidualRow> parse_residual(const CsvRows& rows) {
  ResidualRow r;
  r.at_the_end = rows.text(rows.column("calibration")) == "end";
  const auto camera = rows.integer(rows.column("camera"));
  const auto left = rows.number(rows.column("left_px")), top = rows.number(rows.column("top_px"));
  const auto width = rows.number(rows.column("width_px")),
             height = rows.number(rows.column("height_px"));
  const auto mean = rows.number(rows.column("mean_px"));
  if (!camera || *camera < 1 || *camera >= kMaxCameras || !left || !top || !width || !height ||
      !mean)
    return std::nullopt;
  constexpr double kLargest = 1e5;  // px
  const bool inside = *left >= 0 && *top >= 0 && *width > 0 && *height > 0 &&
                      *left + *width <= kLargest && *top + *height <= kLargest;
  if (!inside || !(std::abs(*mean) <= kLargest)) return std::nullopt;
  r.camera = static_cast<int>(*camera);
  r.left = *left, r.top = *top, r.width = *width, r.height = *height;
  r.mean_px = *mean;
  r.matches = std::clamp(rows.number(rows.column("matches")).value_or(0.0), 0.0, 1e9);
  r.scatter_px = std::clamp(rows.number(rows.column("scatter_px")).value_or(0.0), 0.0, kLargest);
  return r;
}

}  // namespace

void read_calibrations(const fs::path& folder, Session* session) {
  auto lines =
      open_part(folder / "calibrations.csv", "how the calibration changed is not known", session);
  if (!lines) return;
  CsvRows rows([&lines](std::string_view* line) { return lines->next(line); });
  std::size_t unreadable = 0;
  while (rows.next()) {
    if (session->calibrations.size() == kMostCalibrations) {
      leave_out("calibrations.csv", kMostCalibrations, session);
      break;
    }
    CalibrationRow c;
    const auto stamp = rows.integer(rows.column("stamp_ns"));
    const auto camera = rows.integer(rows.column("camera"));
    if (!stamp || !camera || *camera < 1 || *camera >= kMaxCameras ||
        !read_six(rows, "", &c.value)) {
      ++unreadable;
      continue;
    }
    c.stamp = Stamp(*stamp);
    c.camera = static_cast<int>(*camera);
    c.accepted = rows.text(rows.column("outcome")) == "accepted";
    c.kept = rows.text(rows.column("outcome")) == "kept";
    c.cause = rows.text(rows.column("cause")).substr(0, kLongestText);
    c.reason = rows.text(rows.column("reason")).substr(0, kLongestText);
    c.frames = rows.integer(rows.column("frames")).value_or(0);
    c.latency_frames = rows.number(rows.column("latency_frames")).value_or(kNone);
    c.decided = std::isfinite(c.latency_frames);
    c.held_out_before_px = rows.number(rows.column("held_out_before_px")).value_or(kNone);
    c.held_out_after_px = rows.number(rows.column("held_out_after_px")).value_or(kNone);
    read_lens(rows, &c);
    c.judged_depth_m = rows.number(rows.column("judged_depth_m")).value_or(kNone);
    c.depth_sigma_percent = rows.number(rows.column("depth_sigma_percent")).value_or(kNone);
    c.depth_difference_percent =
        rows.number(rows.column("depth_difference_percent")).value_or(kNone);
    c.has_sigma = read_six(rows, "wide_", &c.sigma) || read_six(rows, "sigma_", &c.sigma);
    session->calibrations.push_back(std::move(c));
  }
  report_damage("calibrations.csv", *lines, rows.torn_rows() + unreadable, 0, session);
}

void read_residuals(const fs::path& folder, Session* session) {
  std::error_code error;
  if (!fs::exists(folder / "residuals.csv", error)) return;
  auto lines = open_part(folder / "residuals.csv",
                         "how the calibration fits the images is not known", session);
  if (!lines) return;
  CsvRows rows([&lines](std::string_view* line) { return lines->next(line); });
  std::size_t unreadable = 0;
  while (rows.next() && session->residuals.size() < kMostResiduals) {
    if (const auto row = parse_residual(rows))
      session->residuals.push_back(*row);
    else
      ++unreadable;
  }
  report_damage("residuals.csv", *lines, rows.torn_rows() + unreadable, 0, session);
}

}  // namespace vergence::app::report
