#include "app/report/page.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <string_view>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "app/report/plots.hpp"
#include "app/report/style.hpp"
#include "app/report/svg.hpp"
#include "app/report/tables.hpp"

namespace vergence::app::report {
namespace {

std::string figure(std::string_view caption, const std::string& picture) {
  return fmt::format("<section><figure><h3>{}</h3>{}</figure></section>\n", caption, picture);
}

std::string section(std::string_view css, std::string_view head, const std::string& body) {
  return fmt::format("<section class=\"{}\"><h2>{}</h2>{}</section>\n", css, head, body);
}

std::string list(const std::vector<std::string>& sentences) {
  constexpr std::size_t kMost = 30;
  std::string out = "<ul>";
  for (std::size_t i = 0; i < std::min(sentences.size(), kMost); ++i)
    out += "<li>" + escape(sentences[i], 500) + "</li>\n";
  if (sentences.size() > kMost)
    out += fmt::format("<li>… and {} more</li>", sentences.size() - kMost);
  return out + "</ul>";
}

/// `2026-03-01 10:15:00 UTC`; empty for stamps that count from a drive's start.
std::string date_of(Stamp stamp) {
  constexpr std::int64_t kYear2000 = 946'684'800, kYear2200 = 7'258'118'400;  // s since 1970
  const std::int64_t seconds = stamp.ns() / 1'000'000'000;
  if (seconds < kYear2000 || seconds > kYear2200) return "";
  return fmt::format("{:%Y-%m-%d %H:%M:%S} UTC", fmt::gmtime(static_cast<std::time_t>(seconds)));
}

std::string title_line(const Session& s, const Analysis& a) {
  std::string line = "Session " + s.name;
  if (!s.frames.empty())
    if (const std::string date = date_of(s.frames.front().stamp); !date.empty())
      line += " · " + date;
  line += a.path_m >= 1000 ? fmt::format(" · {:.2f} km", a.path_m / 1000)
                           : fmt::format(" · {:.0f} m", a.path_m);
  if (a.duration_s > 0) line += " in " + duration_text(a.duration_s, 1);
  return line;
}

std::string number_card(const std::string& value, const std::string& name,
                        const std::string& note) {
  return fmt::format(
      "<div class=\"number\"><span>{}</span><b>{}</b><span class=\"soft\">{}</span></div>\n", name,
      escape(value), escape(note));
}

std::string drift_card(const Analysis& a) {
  const char* name = a.source == ErrorSource::ins         ? "Drift against the INS"
                     : a.source == ErrorSource::reference ? "Drift against the reference"
                                                          : "Drift";
  if (a.drift) return number_card(fmt::format("{:.2f} %", *a.drift * 100), name, a.drift_sentence);
  if (a.source == ErrorSource::none) return number_card("not known", name, "no reference");
  return number_card("not known", name, "the drive is too short");
}

std::string error_card(const Analysis& a) {
  const std::string name =
      a.source == ErrorSource::ins ? "Error to the INS" : "Error to the reference";
  if (a.source == ErrorSource::none) return number_card("not known", name, "no reference");
  return number_card(metres(a.horizontal.rms), name,
                     "horizontal, rms; " + metres(a.horizontal.max) + " at most");
}

std::string ok_card(const Session& s, const Analysis& a) {
  if (!a.ok_share)
    return number_card("not known", "Frames ok",
                       a.read > 0 ? "poses.csv is missing" : "there was no frame");
  // Rounded down: 100 % is said of nothing less.
  const double percent = std::floor(*a.ok_share * 1000) / 10;
  const std::string skipped = a.skipped > 0 ? fmt::format(", {} {}", grouped(a.skipped),
                                                          is_live(s) ? "never came" : "skipped")
                                            : "";
  const std::string waited =
      a.waited > 0 ? fmt::format(" ({} until the calibration was confirmed)", grouped(a.waited))
                   : "";
  return number_card(fmt::format("{:.{}f} %", percent, percent == 100 ? 0 : 1), "Frames ok",
                     fmt::format("of {}: {} degraded{}, {} lost{}", grouped(a.read + a.skipped),
                                 grouped(a.degraded), waited, grouped(a.lost), skipped));
}

std::string verdict_section(const Session& s, const Analysis& a, const Verdict& v) {
  constexpr std::array<const char*, 3> kTones{"tone-good", "tone-care", "tone-bad"};
  constexpr std::array<const char*, 3> kMarks{"✔", "!", "✖"};
  const auto i = static_cast<std::size_t>(v.grade);
  return fmt::format(
      "<section class=\"verdict {}\"><p class=\"word\">{} {}</p><p>{}</p><div "
      "class=\"numbers\">{}{}{}</div></section>\n",
      kTones[i], kMarks[i], to_words(v.grade), escape(v.sentence, 600), drift_card(a),
      error_card(a), ok_card(s, a));
}

std::string map_section(const Session& s, const Analysis& a) {
  const std::string map = map_picture(a, s.frames);
  if (map.empty()) return section("", "Map", "<p>There is no pose to draw.</p>");
  const bool theirs =
      std::any_of(a.theirs_x.begin(), a.theirs_x.end(), [](double v) { return std::isfinite(v); });
  std::string legend =
      "<p class=\"soft legend\"><span><i class=\"key k-ours\"></i>ours (● start, ■ end)</span>";
  if (theirs)
    legend += fmt::format("<span><i class=\"key k-theirs\"></i>{}</span>",
                          a.map_is_enu ? "INS" : "reference");
  if (a.degraded > 0) legend += "<span><i class=\"key k-care\"></i>ours, degraded</span>";
  if (a.lost > 0) legend += "<span>× no pose from here</span>";
  if (a.map_is_enu) legend += "<br/>Ours begins where the drive was placed on the earth";
  if (a.map_is_enu) legend += a.placed_s.size() > 1 ? ", and anew where it was placed again." : ".";
  return section("tall", "Map", map + legend + "</p>");
}

void error_plots(const Session& s, const Analysis& a, std::string* out) {
  struct Kind {
    const char* caption;
    const std::vector<double>* values;
    const char* css;
    bool from_zero;
  };
  const std::array kinds{
      Kind{"Horizontal error, m", &a.horizontal_m, "curve s-ours", true},
      Kind{"Vertical error, m (ours above is positive)", &a.vertical_m, "curve s-theirs", false},
      Kind{"Heading error, degrees (clockwise is positive)", &a.heading_deg, "curve s-third",
           false}};
  for (const Kind& k : kinds) {
    if (const std::string plot =
            curve_plot({k.caption, *k.values, k.css, k.from_zero}, a, s.frames);
        !plot.empty())
      *out += figure(std::string(k.caption) + " · over time", plot);
  }
}

std::string errors_head(const Analysis& a) {
  return section("wide", "Errors",
                 "<p>" + escape(a.source_sentence, 500) + "</p>" +
                     (a.lost > 0 && a.source != ErrorSource::none
                          ? "<p class=\"soft\">Red stripes: frames without a pose. Curves stop "
                            "there and are not carried across.</p>"
                          : ""));
}

void running_plots(const Session& s, const Analysis& a, std::string* out) {
  if (const std::string bands = bands_picture(s, a); !bands.empty())
    *out += figure("Status and state · over time", bands);
  std::vector<double> inliers, times;
  for (const Frame& f : s.frames) {
    inliers.push_back(f.inliers >= 0 && f.posed ? f.inliers : kNone);
    times.push_back(f.estimate_ms);
  }
  for (const auto& [caption, values] : {std::pair{"Inliers (points that hold the pose)", &inliers},
                                        std::pair{"Time a frame, ms", &times}})
    if (const std::string plot = curve_plot({caption, *values, "curve s-ours", true}, a, s.frames);
        !plot.empty())
      *out += figure(std::string(caption) + " · over time", plot);
}

/// A single one that the drive began with is no curve.
bool changed(const Session& s, int camera) {
  return std::any_of(s.calibrations.begin(), s.calibrations.end(),
                     [camera](const CalibrationRow& c) { return c.camera == camera && c.decided; });
}

void calibration_sections(const Session& s, const Analysis& a, std::string* out) {
  constexpr std::array<const char*, 6> kNames{"rotation x, degrees", "rotation y, degrees",
                                              "rotation z, degrees", "translation x, mm",
                                              "translation y, mm",   "translation z, mm"};
  std::string plots;
  for (int camera = 1; camera < kMaxCameras; ++camera) {
    if (!changed(s, camera)) continue;
    const std::string whose = camera == 1 ? "Right camera" : fmt::format("Camera {}", camera);
    for (const int component : {0, 3, 1, 4, 2, 5})  // rotation and translation side by side
      plots += figure(fmt::format("{}: {}", whose, kNames[static_cast<std::size_t>(component)]),
                      calibration_plot(s, a, camera, component));
  }
  std::string body = health_table(s);
  if (s.calibrations.empty())
    body += "<p>No calibration was recorded.</p>";
  else if (plots.empty())
    body += "<p>One calibration throughout; it did not change.</p>" + calibrations_table(s);
  else
    body +=
        "<p class=\"soft\">Where the other cameras sit relative to the left one, as it was in use; "
        "the band is ± 2 σ (wide, with uncertain "
        "intrinsics). Hollow red marks were rejected; hollow grey ones are what the drive measured "
        "while it kept what was in use.</p>" +
        calibrations_table(s);
  *out += section("wide long", "Calibration", body) + plots;
}

std::string footer(const Session& s) {
  const std::string version = text_at(s.summary, "version"),
                    hash = text_at(s.summary, "configuration_hash");
  std::string line =
      "Made by vergence from the session's own files; <code>vergence report SESSION</code> makes "
      "it again.";
  if (!version.empty()) line += " Recorded with version " + escape(version, 60) + ".";
  if (!hash.empty()) line += " Configuration " + escape(hash, 60) + ".";
  return "<p class=\"soft\" style=\"margin-top:12px\">" + line + "</p>\n";
}

}  // namespace

std::string page_html(const Session& session, const Analysis& analysis, const Verdict& verdict) {
  const std::string title = escape(title_line(session, analysis), 400);
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/>"
      "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"/>"
      "<link rel=\"icon\" href=\"data:,\"/><title>" +
      title + "</title><style>" + style_sheet() + "</style></head><body><main>\n";
  out += "<h1>" + title + "</h1>\n" + verdict_section(session, analysis, verdict) +
         "<div class=\"grid\">\n";
  if (!verdict.advice.empty()) out += section("wide", "What to do next", list(verdict.advice));
  if (const std::vector<std::string> missing = session.not_had(); !missing.empty())
    out += section("wide", "What is missing in this session", list(missing));
  out += map_section(session, analysis);
  std::string running;
  running_plots(session, analysis, &running);
  out += running + errors_head(analysis);
  if (analysis.source != ErrorSource::none) error_plots(session, analysis, &out);
  calibration_sections(session, analysis, &out);
  out += section("wide long", "Events",
                 session.events.empty() ? "<p>None was recorded.</p>" : events_table(session));
  out += section("wide long", "Figures",
                 "<div class=\"two\">" + figures_table(session, analysis) + "</div>");
  out += "</div>\n" + footer(session) + "</main></body></html>\n";
  return out;
}

}  // namespace vergence::app::report
