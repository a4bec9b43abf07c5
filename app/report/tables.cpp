#include "app/report/tables.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "app/report/svg.hpp"
#include "core/math/angle.hpp"
#include "core/math/so3.hpp"

namespace vergence::app::report {
namespace {

constexpr std::size_t kMostRows = 40;  // of a group whose keys come from a file

/// Rows "name value" under heads; names of ours are plain text, all else is escaped by who adds it.
class Figures {
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

const char* name_of_skipped(const Session& s) {
  if (!s.summary.is_object()) return "missing by their numbers";
  return is_live(s) ? "never came, or were dropped" : "skipped (not readable)";
}

void frames_group(const Session& s, const Analysis& a, Figures* f) {
  f->group("Frames");
  f->row("read", grouped(a.read));
  if (a.read > a.unknown) {
    f->row("ok", grouped(a.ok));
    f->row("degraded", grouped(a.degraded));
    f->row("lost", grouped(a.lost));
  }
  if (s.summary.is_object() || a.skipped > 0) f->row(name_of_skipped(s), grouped(a.skipped));
  for (std::size_t i = 1; i < a.by_reason.size(); ++i)
    if (a.by_reason[i] > 0) f->row("reason " + s.reasons[i], grouped(a.by_reason[i]));
  if (a.interval_s > 0) f->row("frame interval", fmt::format("{:.1f} ms", a.interval_s * 1e3));
}

void error_group(const Analysis& a, Figures* f) {
  f->group(a.source == ErrorSource::ins ? "Against the INS" : "Against the reference");
  f->row("drift, " + a.drift_sentence, times(a.drift, 100), "{:.2f} %");
  f->row("KITTI segment error, with the INS's attitude", times(a.segment_error, 100), "{:.2f} %");
  f->row("horizontal error, rms", metres(a.horizontal.rms));
  f->row("horizontal error, largest", metres(a.horizontal.max));
  f->row("vertical error, rms", metres(a.vertical.rms));
  f->row("heading error, rms", a.heading.rms, "{:.2f}°");
  f->row("heading error, largest", a.heading.max, "{:.2f}°");
  f->row("rotation error", a.rotation_deg_per_m, "{:.4f} °/m");
  if (a.ate_m) f->row("whole path laid on it, rms (ATE)", metres(*a.ate_m));
  f->row("error at the end", times(a.end_error, 100), "{:.2f} % of the distance");
  f->row("scale (reference over ours)", a.scale, "{:.4f}");
}

/// What the drive itself has measured of the calibration in use.
void verification_rows(const Session& s, const Analysis& a, Figures* f) {
  if (const auto verified = flag_at(s.summary, "calibration.verified"))
    f->row("verified by the drive", *verified ? "yes" : "not verified");
  if (a.confirmed_s) f->row("first verified after", duration_text(*a.confirmed_s, 0.1));
  f->row("contradicted: depths were off by",
         number_at(s.summary, "calibration.contradicted.depth_percent"), "{:.1f} %");
  const auto newest =
      std::find_if(s.calibrations.rbegin(), s.calibrations.rend(),
                   [](const CalibrationRow& c) { return std::isfinite(c.depth_sigma_percent); });
  if (newest == s.calibrations.rend()) return;
  const std::string at = fmt::format(" at {:.0f} m, newest measurement", newest->judged_depth_m);
  f->row("depth sigma" + at, newest->depth_sigma_percent, "{:.2f} %");
  if (newest->depth_difference_percent > 0)
    f->row("what was in use differs" + at, newest->depth_difference_percent, "{:.2f} %");
}

void calibration_group(const Session& s, const Analysis& a, Figures* f) {
  f->group("Calibration at the end");
  if (const std::string source = text_at(s.summary, "calibration.source"); !source.empty())
    f->row("from", source);
  if (s.calibration) {
    const RigCalibration& rig = s.calibration->rig;
    for (std::size_t k = 1; k < static_cast<std::size_t>(rig.cameras); ++k) {
      const Vec3 phi = log_so3(rig.T_camera_left[k].R) * kDegreesPerRadian;
      const std::string camera = rig.cameras > 2 ? s.calibration->names[k] + ": " : "";
      f->row(camera + "baseline", fmt::format("{:.2f} mm", rig.T_camera_left[k].t.norm() * 1e3));
      f->row(camera + "rotation x, y, z",
             fmt::format("{:.4f}°, {:.4f}°, {:.4f}°", phi.x() + 0.0, phi.y() + 0.0, phi.z() + 0.0));
    }
  }
  if (const std::string word = text_at(s.summary, "calibration.word"); !word.empty())
    f->row("health", word);
  if (const std::string by = text_at(s.summary, "calibration.limited_by"); !by.empty())
    f->row("limited by", by);
  verification_rows(s, a, f);
}

/// Counters in full, other numbers with `digits`.
std::string number_text(const nlohmann::json& value, int digits) {
  if (value.is_number_unsigned()) return grouped(value.get<std::uint64_t>());
  if (value.is_number_integer()) {
    const auto v = value.get<std::int64_t>();
    return v < 0 ? "-" + grouped(std::uint64_t{0} - static_cast<std::uint64_t>(v))
                 : grouped(static_cast<std::uint64_t>(v));
  }
  return fmt::format("{:.{}g}", value.get<double>(), digits);
}

/// `1.2, -0.3, 4`; empty for anything but a short row of numbers.
std::string numbers_text(const nlohmann::json& value) {
  constexpr std::size_t kMostNumbers = 8;
  if (value.is_number()) return number_text(value, 5);
  std::string text;
  if (!value.is_array() || value.size() > kMostNumbers) return text;
  for (const auto& item : value) {
    if (!item.is_number()) return "";
    text += (text.empty() ? "" : ", ") + number_text(item, 3);
  }
  return text;
}

/// Numbers below an object, its keys as names; for blocks whose keys are not fixed. Beyond
/// kMostRows they are only counted.
// NOLINTNEXTLINE(misc-no-recursion): down to kDeepest
void flatten(const nlohmann::json& json, const std::string& prefix, int depth, std::size_t* rows,
             Figures* f) {
  constexpr int kDeepest = 3;
  if (!json.is_object() || depth > kDeepest) return;
  for (const auto& [key, value] : json.items()) {
    std::string name = prefix + key.substr(0, 60);
    std::replace(name.begin(), name.end(), '_', ' ');
    if (const std::string text = numbers_text(value); text.empty())
      flatten(value, name + " ", depth + 1, rows, f);
    else if (++*rows <= kMostRows)
      f->row(name, text);
  }
}

void block_group(const Session& s, const char* key, const char* head, Figures* f) {
  if (!s.summary.is_object() || !s.summary.contains(key)) return;
  f->group(head);
  std::size_t rows = 0;
  flatten(s.summary[key], "", 0, &rows, f);
  if (rows > kMostRows)
    f->row(fmt::format("… {} more in summary.json", grouped(rows - kMostRows)), "");
}

std::string event_time(const Session& s, Stamp stamp) {
  if (s.frames.empty()) return "";
  const Stamp first = s.frames.front().stamp;
  return stamp >= first ? time_label(seconds_between(first, stamp), 0.1)
                        : "−" + time_label(seconds_between(stamp, first), 0.1);
}

struct EventRun {
  const Event* first = nullptr;
  Stamp last{};
  std::size_t count = 0;
};

std::vector<EventRun> condensed(const std::vector<Event>& events) {
  std::vector<EventRun> runs;
  for (const Event& e : events) {
    if (!runs.empty() && runs.back().first->kind == e.kind &&
        runs.back().first->sentence == e.sentence) {
      ++runs.back().count;
      runs.back().last = e.stamp;
    } else {
      runs.push_back({&e, e.stamp, 1});
    }
  }
  return runs;
}

std::string event_row(const Session& s, const EventRun& run) {
  std::string when = event_time(s, run.first->stamp);
  if (run.count > 1) when += " … " + event_time(s, run.last);
  const std::string many = run.count > 1 ? " (" + grouped(run.count) + " times)" : "";
  return fmt::format("<tr><td class=\"t\">{}</td><td class=\"k\">{}</td><td>{}{}</td></tr>\n", when,
                     escape(run.first->kind, 60), escape(run.first->sentence), many);
}

}  // namespace

std::string grouped(std::size_t count) {
  const std::string digits = std::to_string(count);
  std::string text;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) text += ' ';
    text += digits[i];
  }
  return text;
}

std::string metres(double value) { return fmt::format("{:.{}f} m", value, value < 0.0995 ? 3 : 2); }

std::string figures_table(const Session& session, const Analysis& analysis) {
  Figures f;
  f.group("Drive");
  if (analysis.duration_s > 0) f.row("duration", duration_text(analysis.duration_s, 0.1));
  f.row("way", fmt::format("{:.1f} m", analysis.path_m));
  frames_group(session, analysis, &f);
  if (analysis.source != ErrorSource::none) error_group(analysis, &f);
  block_group(session, "timing_ms", "Time a frame, ms", &f);
  calibration_group(session, analysis, &f);
  block_group(session, "truth", "Against the truth of the mock drive (metres, radians)", &f);
  block_group(session, "devices", "Devices", &f);
  block_group(session, "comparison", "Comparison with the INS", &f);
  block_group(session, "time", "Clocks and pairing", &f);
  block_group(session, "memory", "Memory", &f);
  f.row("allocations after the seal", number_at(session.summary, "allocations_after_seal"),
        "{:.0f}");
  block_group(session, "drops", "Drops", &f);
  return std::move(f).finish();
}

namespace {

/// One row of words about a calibration; empty when nothing is known of it.
std::string health_row(const nlohmann::json& summary, const char* name, const std::string& path) {
  const std::string word = text_at(summary, path + "word");
  if (word.empty()) return "";
  std::string row =
      fmt::format("<tr><th scope=\"row\">{}</th><td class=\"k\">{}</td>", name, escape(word, 60));
  for (const char* z : {"1", "5", "10", "20", "50"}) {
    const auto percent = number_at(summary, path + "depth_error_percent." + z);
    row += percent
               ? fmt::format("<td class=\"n\">{:.{}f} %</td>", *percent, *percent < 0.995 ? 2 : 1)
               : "<td></td>";
  }
  return row + "</tr>\n";
}

std::string held_out_text(const CalibrationRow& c) {
  if (!std::isfinite(c.held_out_after_px) || !(c.held_out_after_px > 0)) return "";
  if (!(c.held_out_before_px > 0)) return fmt::format("{:.2f} px", c.held_out_after_px);
  return fmt::format("{:.2f} → {:.2f} px", c.held_out_before_px, c.held_out_after_px);
}

/// `± 0.26 % at 20 m, was off 1.4 %` as parts that no line breaks; empty where nothing was
/// measured.
std::string depth_text(const CalibrationRow& c) {
  if (!(c.judged_depth_m > 0) || !std::isfinite(c.depth_sigma_percent)) return "";
  const bool off = c.depth_difference_percent > 0;
  std::string text = fmt::format("<span class=\"w\">± {:.2f} % at {:.0f} m{}</span>",
                                 c.depth_sigma_percent, c.judged_depth_m, off ? "," : "");
  if (off)
    text += fmt::format(" <span class=\"w\">was off {:.2f} %</span>", c.depth_difference_percent);
  return text;
}

}  // namespace

std::string health_table(const Session& session) {
  const std::string rows = health_row(session.summary, "at the start", "calibration.before.") +
                           health_row(session.summary, "at the end", "calibration.");
  if (rows.empty()) return "";
  return "<div class=\"scroll\"><table class=\"health\"><tr><th></th><th>calibration</th><th "
         "class=\"n\">1 m</th><th class=\"n\">5 "
         "m</th><th class=\"n\">10 "
         "m</th>"
         "<th class=\"n\">20 m</th><th class=\"n\">50 m</th></tr>\n" +
         rows +
         "</table></div>\n<p class=\"soft\">Predicted error of a depth at that distance, one "
         "sigma, from what the calibration leaves "
         "open.</p>\n";
}

std::string calibrations_table(const Session& session) {
  constexpr std::size_t kMost = 60;
  std::string out =
      "<table "
      "class=\"stack\"><tr><th>time</th><th>outcome</th><th>cause</th><th>after</th><th>held-out "
      "error</th><th>depth</th><th>why</th></tr>\n";
  std::vector<const CalibrationRow*> rows;  // one for all cameras: they are decided together
  for (const CalibrationRow& c : session.calibrations)
    if (c.camera == 1) rows.push_back(&c);
  const std::size_t n = rows.size();
  if (n > kMost)
    out += fmt::format("<tr><td colspan=\"7\">{} earlier ones are in calibrations.csv</td></tr>",
                       grouped(n - kMost));
  for (std::size_t i = n > kMost ? n - kMost : 0; i < n; ++i) {
    const CalibrationRow& c = *rows[i];
    std::string cause = c.cause;
    std::replace(cause.begin(), cause.end(), '_', ' ');
    const std::string after = c.decided ? fmt::format("{:.0f} frames", c.latency_frames) : "";
    const std::string from = c.frames > 0 ? fmt::format("from {} frames", c.frames) : "";
    const std::string why =
        from.empty() || c.reason.empty() ? from + c.reason : from + "; " + c.reason;
    const char* outcome = c.accepted ? "accepted" : c.kept ? "kept" : "rejected";
    out += fmt::format(
        "<tr><td class=\"t\">{}</td> <td class=\"k\">{}</td> <td class=\"w\">{}</td> <td "
        "class=\"w\">{}</td> <td "
        "class=\"w\">{}</td> <td>{}</td> <td>{}</td></tr>\n",
        event_time(session, c.stamp), outcome, escape(cause, 60), after, held_out_text(c),
        depth_text(c), escape(why));
  }
  return out + "</table>\n";
}

std::string events_table(const Session& session) {
  constexpr std::size_t kEachEnd = 80;
  const std::vector<EventRun> runs = condensed(session.events);
  std::string out = "<table class=\"stack\"><tr><th>time</th><th>kind</th><th>what</th></tr>\n";
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const bool many = runs.size() > 2 * kEachEnd;
    if (many && i == kEachEnd) {
      const std::size_t left_out = runs.size() - 2 * kEachEnd;
      out += fmt::format(
          "<tr><td></td><td></td><td>… {} rows are left out here; events.jsonl has them "
          "…</td></tr>\n",
          grouped(left_out));
      i += left_out;
    }
    out += event_row(session, runs[i]);
  }
  if (session.events_dropped > 0)
    out += fmt::format("<tr><td></td><td></td><td>… and {} more in events.jsonl</td></tr>\n",
                       grouped(session.events_dropped));
  return out + "</table>\n";
}

}  // namespace vergence::app::report
