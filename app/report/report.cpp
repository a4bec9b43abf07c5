#include "app/report/report.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "app/report/page_css.hpp"
#include "app/report/plots.hpp"
#include "app/report/svg.hpp"
#include "app/runtime/durable_file.hpp"
#include "core/math/angle.hpp"

namespace vergence::app {
namespace report {
namespace {

/// 12 400: a space between thousands.
std::string grouped(std::size_t count) {
  const std::string digits = std::to_string(count);
  std::string text;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) text += ' ';
    text += digits[i];
  }
  return text;
}

/// Length such as `0.004 m` or `54.34 m`, in millimetres below a decimetre.
std::string metres(double value) { return fmt::format("{:.{}f} m", value, value < 0.0995 ? 3 : 2); }

/// Table rows "name value" under group headings. Names and values are escaped here.
class MetricTable {
 public:
  void group(const char* head) { pending_ = head; }
  void row(std::string_view name, const std::string& value) {
    if (!pending_.empty())
      out_ += fmt::format(R"(<tr class="group"><th colspan="2" scope="colgroup">{}</th></tr>)",
                          pending_);
    pending_.clear();
    out_ += fmt::format(R"(<tr><th scope="row">{}</th><td class="n">{}</td></tr>)", escape(name),
                        escape(value));
    out_ += '\n';
  }
  void row(std::string_view name, std::optional<double> value, const char* format) {
    if (value && std::isfinite(*value)) row(name, fmt::format(fmt::runtime(format), *value));
  }
  [[nodiscard]] std::string finish() && { return "<table>" + out_ + "</table>\n"; }

 private:
  std::string out_, pending_;
};

std::optional<double> times(std::optional<double> value, double factor) {
  return value ? std::optional(*value * factor) : std::nullopt;
}

std::string event_time(const Session& s, Stamp stamp) {
  if (s.frames.empty()) return "";
  const Stamp first = s.frames.front().stamp;
  // Duration in s below which a time is printed as 0.0 without a sign.
  constexpr double kRounds = 0.05;
  const double before = stamp < first ? seconds_between(stamp, first) : 0;
  return before < kRounds ? time_label(before > 0 ? 0 : seconds_between(first, stamp), 0.1)
                          : "−" + time_label(before, 0.1);
}

/// Successive events of one kind and message.
using EventRun = std::span<const Event>;

std::vector<EventRun> condensed(std::span<const Event> events) {
  std::vector<EventRun> runs;
  while (!events.empty()) {
    const auto other = std::ranges::find_if(events, [&](const Event& e) {
      return e.kind != events[0].kind || e.message != events[0].message;
    });
    runs.push_back(events.first(static_cast<std::size_t>(other - events.begin())));
    events = events.subspan(runs.back().size());
  }
  return runs;
}

std::string event_row(const Session& s, EventRun run) {
  std::string when = event_time(s, run.front().stamp), many;
  if (run.size() > 1) {
    when += " … " + event_time(s, run.back().stamp);
    many = " (" + grouped(run.size()) + " times)";
  }
  return fmt::format("<tr><td class=\"t\">{}</td><td class=\"k\">{}</td><td>{}{}</td></tr>\n", when,
                     escape(run.front().kind, 60), escape(run.front().message), many);
}

/// Counts, errors, times, calibration, memory, drops; a figure that does not exist has no row.
std::string metrics_table(const Session& session, const Analysis& analysis) {
  MetricTable f;
  f.group("Session");
  if (analysis.duration_s > 0) f.row("duration", duration_text(analysis.duration_s, 0.1));
  f.row("distance travelled", fmt::format("{:.1f} m", analysis.path_m));
  if (analysis.interval_s > 0)
    f.row("frame interval", fmt::format("{:.1f} ms", analysis.interval_s * 1e3));
  for (std::size_t i = 1; i < analysis.by_reason.size(); ++i)
    if (analysis.by_reason[i] > 0)
      f.row(fmt::format("frames with {}", to_string(static_cast<Reason>(i))),
            grouped(analysis.by_reason[i]));
  if (analysis.source != ErrorSource::none) {
    f.group(analysis.source == ErrorSource::ins ? "Errors against the INS"
                                                : "Errors against the reference");
    f.row("drift, " + analysis.drift_message, times(analysis.drift, 100), "{:.2f} %");
    f.row("KITTI segment error (with the INS attitude)", times(analysis.segment_error, 100),
          "{:.2f} %");
    f.row("horizontal error, RMS", metres(analysis.horizontal.rms));
    f.row("horizontal error, maximum", metres(analysis.horizontal.max));
    f.row("vertical error, RMS", metres(analysis.vertical.rms));
    f.row("heading error, RMS", analysis.heading.rms, "{:.2f}°");
    f.row("heading error, maximum", analysis.heading.max, "{:.2f}°");
    f.row("rotation error", analysis.rotation_deg_per_m, "{:.4f} °/m");
    if (analysis.ate_m) f.row("ATE (RMS after SE(3) alignment)", metres(*analysis.ate_m));
    f.row("error at the end", times(analysis.end_error, 100), "{:.2f} % of the distance travelled");
    f.row("scale (reference / estimate)", analysis.scale, "{:.4f}");
  }
  f.group("Depth error (1 σ) predicted by the calibration");
  for (const auto& [name, path] :
       {std::pair{"at the start", "calibration.initial."}, {"at the end", "calibration."}})
    for (const char* depth : {"5", "20"})
      f.row(fmt::format("{} m, {}", depth, name),
            number_at(session.summary, std::string(path) + "depth_error_percent." + depth),
            "{:.2f} %");
  f.group("Processing time per frame, ms");
  for (const char* key : {"mean", "p50", "p99", "max"})
    f.row(key, number_at(session.summary, std::string("timing_ms.") + key), "{:.2f}");
  return std::move(f).finish();
}

/// Successive events of one kind and message are one row; of very many the first and the last.
std::string events_table(const Session& session) {
  constexpr std::size_t kEachEnd = 80;
  const std::vector<EventRun> runs = condensed(session.events);
  std::string out =
      "<table class=\"stack\"><tr><th>time, s</th><th>kind</th><th>message</th></tr>\n";
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (i == kEachEnd && runs.size() > 2 * kEachEnd) {
      i = runs.size() - kEachEnd;
      out += fmt::format(
          "<tr><td></td><td></td><td>… {} rows omitted; all are in events.jsonl …</td></tr>\n",
          grouped(i - kEachEnd));
    }
    out += event_row(session, runs[i]);
  }
  return out + "</table>\n";
}

/// A plot with its title and, below it, one sentence that says how to read it.
std::string figure(std::string_view caption, const std::string& drawing, std::string_view note) {
  return fmt::format("<section><figure><h3>{}</h3>{}<p class=\"soft\">{}</p></figure></section>\n",
                     caption, drawing, note);
}

std::string section(std::string_view css, std::string_view head, const std::string& body) {
  return fmt::format("<section class=\"{}\"><h2>{}</h2>{}</section>\n", css, head, body);
}

std::string list(const std::vector<std::string>& messages) {
  std::string out = "<ul>";
  for (const std::string& message : messages) out += "<li>" + escape(message, 500) + "</li>\n";
  return out + "</ul>";
}

/// `2026-03-01 10:15:00 UTC`; empty for stamps that count from a drive's start.
std::string format_date(Stamp stamp) {
  // Seconds since 1970.
  constexpr std::int64_t kYear2000 = 946'684'800, kYear2200 = 7'258'118'400;
  const std::int64_t seconds = stamp.ns() / 1'000'000'000;
  if (seconds < kYear2000 || seconds > kYear2200) return "";
  return fmt::format("{:%Y-%m-%d %H:%M:%S} UTC", fmt::gmtime(static_cast<std::time_t>(seconds)));
}

std::string title_line(const Session& s, const Analysis& a) {
  std::string line = "Session " + s.name;
  if (!s.frames.empty())
    if (const std::string date = format_date(s.frames.front().stamp); !date.empty())
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

std::string error_cards(const Analysis& a) {
  if (a.source == ErrorSource::none)
    return number_card("unknown", "Drift", "no reference") +
           number_card("unknown", "Error against the reference", "no reference");
  const std::string reference = a.source == ErrorSource::ins ? "the INS" : "the reference";
  return number_card(a.drift ? fmt::format("{:.2f} %", *a.drift * 100) : "unknown",
                     "Drift against " + reference, a.drift ? a.drift_message : "path too short") +
         number_card(metres(a.horizontal.rms), "Error against " + reference,
                     "horizontal RMS; maximum " + metres(a.horizontal.max));
}

std::string ok_card(const Session& s, const Analysis& a) {
  if (!a.ok_share) return number_card("unknown", "Frames ok", "no frame was received");
  // Only what devices give has metrics of their clocks.
  const bool live = s.summary.is_object() && s.summary.value("time", nlohmann::json()).is_object();
  // Rounded down, so that 100 % means every frame.
  const double percent = std::floor(*a.ok_share * 1000) / 10;
  const std::string skipped =
      a.skipped > 0 ? fmt::format(", {} {}", grouped(a.skipped), live ? "not received" : "skipped")
                    : "";
  const std::string waited =
      a.waited > 0 ? fmt::format(" ({} before the calibration was verified)", grouped(a.waited))
                   : "";
  return number_card(fmt::format("{:.{}f} %", percent, percent == 100 ? 0 : 1), "Frames ok",
                     fmt::format("of {}: {} degraded{}, {} lost{}", grouped(a.read + a.skipped),
                                 grouped(a.degraded), waited, grouped(a.lost), skipped));
}

std::string assessment_section(const Session& s, const Analysis& a, const Assessment& v) {
  constexpr std::array<const char*, 3> kTones{"tone-good", "tone-care", "tone-bad"};
  constexpr std::array<const char*, 3> kMarks{"✔", "!", "✖"};
  const auto i = static_cast<std::size_t>(v.grade);
  return fmt::format(
      "<section class=\"assessment {}\"><p class=\"word\">{} {}</p><p>{}</p><div "
      "class=\"numbers\">{}{}</div></section>\n",
      kTones[i], kMarks[i], spaced(v.grade), escape(v.message, 600), error_cards(a), ok_card(s, a));
}

std::string map_section(const Session& s, const Analysis& a) {
  const std::string map = map_plot(a, s.frames);
  if (map.empty()) return section("", "Map", "<p>No pose to draw.</p>");
  const bool has_reference =
      std::ranges::any_of(a.reference_x, [](double v) { return std::isfinite(v); });
  std::string legend =
      "<p class=\"soft legend\"><span><i class=\"key k-ours\"></i>estimate (● start, ■ end)</span>";
  if (has_reference)
    legend += fmt::format("<span><i class=\"key k-theirs\"></i>{}</span>",
                          a.map_is_enu ? "INS" : "reference");
  if (a.degraded > 0) legend += "<span><i class=\"key k-care\"></i>estimate, degraded</span>";
  legend += a.map_is_enu
                ? "<br/>View from above, north up; the bar is the scale. The estimate starts at "
                  "the ENU alignment."
                : "<br/>View from above; the bar is the scale. Gaps between the lines are errors.";
  return section("tall", "Map", map + legend + "</p>");
}

/// A curve over time with its caption; empty if no frame has a value.
std::string curve_figure(const CurvePlot& plot, const char* note, const Session& s,
                         const Analysis& a) {
  const std::string drawing = curve_plot(plot, a, s.frames);
  return drawing.empty() ? "" : figure(plot.description + " · over time", drawing, note);
}

std::string running_plots(const Session& s, const Analysis& a) {
  std::string out;
  if (const std::string bands = bands_plot(s, a); !bands.empty())
    out = figure("Status and state · over time", bands,
                 "Upper rows: status of each frame. Lower rows: state of the estimator. Ticks: "
                 "events, listed below.");
  std::vector<double> inliers, times;
  for (const Frame& f : s.frames) {
    inliers.push_back(f.inliers >= 0 && f.posed ? f.inliers : kNone);
    times.push_back(f.estimate_ms);
  }
  return out +
         curve_figure({"Inliers, points", inliers, "curve s-ours", true},
                      "Points that constrain the pose; few of them make a pose degraded or lost.",
                      s, a) +
         curve_figure({"Processing time per frame, ms", times, "curve s-ours", true},
                      "Time of the estimator, from the decoded images to the pose; it must stay "
                      "below the frame interval.",
                      s, a);
}

std::string calibration_sections(const Session& s, const Analysis& a) {
  constexpr std::array<const char*, 6> kNames{"rotation x, degrees", "rotation y, degrees",
                                              "rotation z, degrees", "translation x, mm",
                                              "translation y, mm",   "translation z, mm"};
  std::string plots;
  for (int camera = 1; camera < kMaxCameras; ++camera) {
    // A single one that the drive began with is no curve.
    if (std::ranges::none_of(s.calibrations, [camera](const CalibrationRow& c) {
          return c.camera == camera && c.decided;
        }))
      continue;
    const std::string whose = camera == 1 ? "Right camera" : fmt::format("Camera {}", camera);
    // Rotation and translation are shown side by side.
    for (const int component : {0, 3, 1, 4, 2, 5})
      plots += figure(fmt::format("{}: {}", whose, kNames[static_cast<std::size_t>(component)]),
                      calibration_plot(s, a, camera, component),
                      "Value in use with ± 2 σ; a step is a change of the calibration.");
  }
  const std::string rating = text_at(s.summary, "calibration.rating");
  std::string body = "<p>";
  if (!rating.empty()) body += "Rating at the end: <b>" + escape(rating, 60) + "</b>. ";
  if (s.calibrations.empty())
    body += "No calibration in this session.";
  else if (plots.empty())
    body += "One calibration was used throughout.";
  else
    body +=
        "Each plot shows one component of T_camera_left over time. The line is the value in use, "
        "the band ± 2 σ (sigma_total). Hollow red marks are rejected calibrations; hollow grey "
        "marks are online estimates that left the calibration unchanged; calibrations.csv has them "
        "all.";
  body += "</p>";
  return section("wide long", "Calibration", body) + plots;
}

std::string footer(const Session& s) {
  const std::string version = text_at(s.summary, "version"),
                    hash = text_at(s.summary, "configuration_hash");
  return fmt::format(
      "<p class=\"soft\" style=\"margin-top:12px\"><code>vergence report SESSION</code> "
      "regenerates this page from the session's files.{}{}</p>\n",
      version.empty() ? "" : " Recorded with version " + escape(version, 60) + ".",
      hash.empty() ? "" : " Configuration " + escape(hash, 60) + ".");
}

/// Complete report.html: one document, also well-formed XML, without scripts or external content.
std::string page_html(const Session& session, const Analysis& analysis,
                      const Assessment& assessment) {
  const std::string title = escape(title_line(session, analysis), 400);
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/><meta name=\"viewport\" "
      "content=\"width=device-width,initial-scale=1\"/><link rel=\"icon\" "
      "href=\"data:,\"/><title>" +
      title + "</title><style>" + kPalette + kPageCss + "</style></head><body><main>\n";
  out += "<h1>" + title + "</h1>\n" + assessment_section(session, analysis, assessment) +
         "<div class=\"grid\">\n";
  if (!assessment.advice.empty())
    out += section("wide", "What to do next", list(assessment.advice));
  if (!session.missing.empty())
    out += section("wide", "What is missing in this session", list(session.missing));
  out += map_section(session, analysis);
  out += running_plots(session, analysis) +
         section("wide", "Errors",
                 "<p>" + escape(analysis.source_message, 500) + "</p>" +
                     (analysis.lost > 0 && analysis.source != ErrorSource::none
                          ? "<p class=\"soft\">Red stripes are frames without a pose; curves are "
                            "interrupted there.</p>"
                          : ""));
  if (analysis.source != ErrorSource::none)
    for (const auto& [plot, note] :
         {std::pair{CurvePlot{"Horizontal error, m", analysis.horizontal_m, "curve s-ours", true},
                    "Distance to the reference in the ground plane; a steady rise is drift."},
          {CurvePlot{"Vertical error, m", analysis.vertical_m, "curve s-theirs", false},
           "Positive where the estimate is above the reference."},
          {CurvePlot{"Heading error, degrees", analysis.heading_deg, "curve s-third", false},
           "Positive where the estimate is rotated clockwise."}})
      out += curve_figure(plot, note, session, analysis);
  out += calibration_sections(session, analysis) +
         section("wide long", "Events",
                 session.events.empty() ? "<p>No events.</p>" : events_table(session));
  out += section("wide long", "Metrics",
                 "<div class=\"two\">" + metrics_table(session, analysis) +
                     "</div><p class=\"soft\">Other metrics are in summary.json.</p>");
  out += "</div>\n" + footer(session) + "</main></body></html>\n";
  return out;
}

/// The first of them, and how many more there are: a line of a terminal has no room for all.
std::string first_message(const std::vector<std::string>& messages, const char* none) {
  if (messages.empty()) return none;
  if (messages.size() == 1) return messages.front();
  return fmt::format("{} (and {} more in the report)", messages.front(), messages.size() - 1);
}

}  // namespace
}  // namespace report

ReportOutcome write_report(const std::filesystem::path& session_folder) {
  const report::Session session = report::read_session(session_folder);
  const report::Analysis analysis = report::analyse(session);
  ReportOutcome outcome{.page = session_folder / "report.html",
                        .assessment = report::assess(session, analysis),
                        .missing = session.missing};
  replace_durably(outcome.page, report::page_html(session, analysis, outcome.assessment));
  return outcome;
}

std::array<std::string, 3> closing_lines(const ReportOutcome& outcome) {
  const report::Assessment& a = outcome.assessment;
  const std::string why = a.usable
                              ? fmt::format("{}: {}", report::spaced(a.grade),
                                            report::first_message(a.reasons, a.message.c_str()))
                              : "do not use these poses: " + a.main_reason;
  return {"result: " + why, "to do: " + report::first_message(a.advice, "nothing"),
          "report: " + outcome.page.string()};
}

}  // namespace vergence::app
