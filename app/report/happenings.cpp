#include "app/report/happenings.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "app/report/advice.hpp"
#include "app/report/outages.hpp"
#include "app/report/svg.hpp"
#include "app/report/tables.hpp"

namespace vergence::app::report {
namespace {

struct Word {
  std::string_view word;
  const char* said;
};

/// Reasons of poses.csv and kinds of events.jsonl as a person would say them.
constexpr std::array kSaid{
    Word{"no_image", "a camera delivered no image"},
    Word{"image_dark", "images without structure: dark, covered or saturated"},
    Word{"image_repeated", "a camera delivered an older image again"},
    Word{"few_features", "too little texture"},
    Word{"no_stereo_matches", "left and right did not fit the calibration"},
    Word{"cameras_swapped", "left and right swapped, or T_camera_left inverted"},
    Word{"few_inliers", "the pose rested on few points"},
    Word{"one_camera", "only one camera supported the pose"},
    Word{"no_pose", "tracking failed"},
    Word{"time_gap", "frames were missing"},
    Word{"scene_restarted", "the motion across a gap was extrapolated"},
    Word{"weak_geometry", "points that hold the pose weakly"},
    Word{"moving_scene", "much of the picture moved by itself"},
    Word{"unconfirmed", "waiting until the drive confirms the last drive's calibration"},
    Word{"unverified_calibration", "waiting until the drive confirms its calibration"},
    Word{"recalibrating", "the rig did not fit its calibration, a new one was sought"},
    Word{"uncalibrated", "no calibration yet"},
    Word{"out_of_step", "a camera's images were of another instant"},
    Word{"needs_motion", "no calibration: the rig stood still"},
    Word{"needs_near_structure", "no calibration: nothing near enough"},
    Word{"needs_texture", "no calibration: nothing to match"},
    Word{"unproven_pairing", "what proves the pairing contradicted itself"},
    Word{"time_backwards", "skipped: time not later than before"},
    Word{"time_ahead", "skipped: time later than after"},
    Word{"image_missing", "skipped: an image is missing"},
    Word{"image_torn", "skipped: an image file is torn"},
    Word{"image_size", "skipped: an image of another size"},
    Word{"image_unreadable", "skipped: a file that is no picture"},
};

/// Events of which one is worth a row.
constexpr std::array<std::string_view, 6> kTold{"rig_changed",
                                                "calibration_contradicted",
                                                "calibration_rejected",
                                                "scale_disagrees",
                                                "ins_jump",
                                                "disk_full"};

struct Row {
  std::string what;
  std::size_t count = 0;
  double from_s = 0, to_s = 0;
  bool frames = true;
};

std::string said(std::string_view word) {
  for (const Word& w : kSaid)
    if (w.word == word) return w.said;
  std::string text(word);
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

double since_start(const Session& s, Stamp stamp) {
  return s.frames.empty() || stamp < s.frames.front().stamp
             ? 0
             : seconds_between(s.frames.front().stamp, stamp);
}

std::vector<Row> rows_of_frames(const Session& s, const Analysis& a) {
  std::vector<Row> rows(s.reasons.size());
  for (std::size_t i = 0; i < s.frames.size(); ++i) {
    const Frame& f = s.frames[i];
    if (f.reason == 0 || !f.status || *f.status == PoseStatus::ok) continue;
    Row& row = rows[f.reason];
    if (row.count++ == 0) row.from_s = a.time_s[i];
    row.to_s = a.time_s[i];
  }
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].what = said(s.reasons[i]);
  return rows;
}

/// Events of one kind as one row; `sentence`: say what the first one says.
Row row_of_events(const Session& s, std::string_view kind, bool sentence) {
  Row row;
  row.frames = !sentence;
  for (const Event& e : s.events) {
    if (e.kind != kind) continue;
    if (row.count++ == 0) {
      row.from_s = since_start(s, e.stamp);
      row.what = sentence ? e.sentence : said(kind);
    }
    row.to_s = since_start(s, e.stamp);
  }
  return row;
}

/// Devices that were away, a row for those that went together.
std::vector<Row> rows_of_outages(const Session& s, const Analysis& a) {
  std::vector<Row> rows;
  for (const OutageSum& sum : summed(outages_of(s.events))) {
    const double to_s = sum.to ? since_start(s, *sum.to) : a.duration_s;
    const double from_s = since_start(s, sum.from);
    rows.push_back({gone_sentence(sum.devices) + (sum.to ? "" : " to the end"), sum.count, from_s,
                    std::max(from_s, to_s), false});
  }
  return rows;
}

std::string when(const Row& row) {
  const std::string from = time_label(row.from_s, 0.1), to = time_label(row.to_s, 0.1);
  return (from == to ? from : from + " … " + to) + (row.to_s < 60 ? " s" : "");
}

}  // namespace

std::string happenings_table(const Session& session, const Analysis& analysis) {
  constexpr std::size_t kMost = 10;
  const std::vector<Row> outages = rows_of_outages(session, analysis);
  std::vector<Row> rows = rows_of_frames(session, analysis);
  for (const Advice& skip : skip_advice()) rows.push_back(row_of_events(session, skip.word, false));
  std::erase_if(rows, [](const Row& r) { return r.count == 0; });
  std::stable_sort(rows.begin(), rows.end(),
                   [](const Row& a, const Row& b) { return a.count > b.count; });
  rows.insert(rows.begin(), outages.begin(), outages.end());  // the cause of many others
  for (const std::string_view kind : kTold) rows.push_back(row_of_events(session, kind, true));
  std::erase_if(rows, [](const Row& r) { return r.count == 0; });
  if (rows.empty()) return "";
  std::string out =
      "<table class=\"stack\"><tr><th>what</th><th>how often</th><th>when</th></tr>\n";
  for (std::size_t i = 0; i < std::min(kMost, rows.size()); ++i) {
    const Row& r = rows[i];
    const std::string often = r.frames ? grouped(r.count) + (r.count == 1 ? " frame" : " frames")
                              : r.count == 1 ? "once"
                                             : grouped(r.count) + " times";
    out += fmt::format("<tr><td>{}</td> <td class=\"w\">{}</td> <td class=\"w\">{}</td></tr>\n",
                       escape(r.what), often, when(r));
  }
  return out + "</table>\n";
}

}  // namespace vergence::app::report
