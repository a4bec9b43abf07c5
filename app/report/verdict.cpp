#include "app/report/verdict.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "app/report/advice.hpp"
#include "app/report/calibration_findings.hpp"
#include "app/report/outages.hpp"
#include "app/report/usability.hpp"

namespace vergence::app::report {
namespace {

// Limits of drift, the same as of the depth error's words (METHOD §3): 2 % is good, beyond 5 %
// something is wrong with the rig.
constexpr double kGoodDrift = 0.02, kWorstDrift = 0.05;
// A length measured by the rig against the reference's; 2 % is where the comparison says
// scale_disagrees.
constexpr double kGoodScale = 0.02, kWorstScale = 0.05;
// Share of frames without a pose: a handful is a bump; a tenth are holes that no one can drive by.
constexpr double kFewLost = 0.002, kManyLost = 0.10;
constexpr double kFewDegraded = 0.05;
constexpr double kFewOverBudget = 0.01;  // the 99th percentile is what the summary keeps
constexpr double kPercent = 100.0;

std::string percent(double share) {
  return fmt::format("{:.{}f} %", share * kPercent, share < 0.0995 ? 1 : 0);
}

void judge_frames(const Session& s, const Analysis& a, const Usability& use, Findings* j) {
  const bool posed =
      std::any_of(s.frames.begin(), s.frames.end(), [](const Frame& f) { return f.posed; });
  if (!posed && (!a.ok_share || a.ok > 0)) return j->find(Grade::bad, "there never was a pose");
  if (!a.ok_share) return j->find(Grade::care, "the status of the frames is not known");
  if (use.use != Use::ok) {
    j->find(use.use == Use::unverified ? Grade::care : Grade::bad, use.reason);
    if (use.use == Use::nothing) return j->give_up(use.reason, use.advice);
  }
  const auto all = static_cast<double>(a.read + a.skipped);
  const double lost = static_cast<double>(a.lost + a.skipped) / all,
               degraded = static_cast<double>(a.degraded - a.waited) / all;
  if (lost > kFewLost)
    j->find(lost > kManyLost ? Grade::bad : Grade::care,
            fmt::format("{} of the frames have no pose", percent(lost)));
  if (use.use == Use::ok && degraded > kFewDegraded)
    j->find(Grade::care, fmt::format("{} of the frames are degraded", percent(degraded)));
}

/// `broken`: outages broke the way.
void judge_drift(const Session& s, const Analysis& a, bool broken, Findings* j) {
  if (a.ins_unplaced) {
    j->find(Grade::care,
            "nothing says how far it drifted: the drive was not placed on the earth with its INS");
    j->advise(
        "Errors are shown from comparison.placement_m (100 m) driven with a valid fix on: drive "
        "further, or set it lower.");
    return;
  }
  if (a.source == ErrorSource::none) {
    j->find(Grade::care, "nothing says how far it drifted: there was no reference");
    // Two cameras alone cannot tell a wrong unit: everything is too long or too short alike.
    if (s.calibration)
      if (const std::string doubt = baseline_doubt(s.calibration->rig); !doubt.empty()) {
        j->find(Grade::care, doubt);
        j->advise("Compare the baseline with the rig: all lengths are wrong by as much as it is.");
      }
    j->advise(
        "For a judgement of the drift record with an INS, or compare with a reference: vergence "
        "evaluate SESSION REFERENCE.");
    return;
  }
  if (!a.drift)
    j->find(Grade::care, "the drive is too short to measure its drift");
  else if (*a.drift > kGoodDrift)
    j->find(*a.drift > kWorstDrift ? Grade::bad : Grade::care,
            fmt::format("it drifts by {} of the distance{}{}", percent(*a.drift),
                        a.source == ErrorSource::ins ? " against the INS" : "",
                        broken ? ", across outages" : ""));
  const double off = a.scale ? std::abs(*a.scale - 1) : 0;
  if (off > kGoodScale && !broken) {
    j->find(
        off > kWorstScale ? Grade::bad : Grade::care,
        fmt::format("lengths come out {} too {}", percent(off), *a.scale < 1 ? "long" : "short"));
    j->advise(
        "Lengths disagree with the reference: measure the baseline again, then calibrate again.");
  }
}

void judge_session(const Session& s, const Analysis& a, Findings* j) {
  if (!s.missing.empty()) j->find(Grade::care, "the session's files are not whole");
  if (!s.left_out.empty())
    j->find(Grade::care, "the drive is longer than the report reads: this is of its beginning");
  if (!s.summary.is_object() && !s.missing.empty())
    j->advise(
        "The session was not closed: stop with Ctrl-C and wait for the last message; check power "
        "and the disk's free space.");
  const double lines = number_at(s.summary, "drops.lines").value_or(0) +
                       number_at(s.summary, "drops.records").value_or(0);
  if (lines > 0) {
    j->find(Grade::care, fmt::format("{:.0f} lines did not get to the disk", lines));
    j->advise("The disk did not keep up or was full: make room, or record to a faster one.");
  }
  if (const auto allocations = number_at(s.summary, "allocations_after_seal");
      allocations && *allocations > 0)
    j->advise(fmt::format(
        "Memory was taken {:.0f} times during the drive, which must not happen: report it "
        "with this session.",
        *allocations));
  const double p99 = number_at(s.summary, "timing_ms.p99").value_or(0) * 1e-3;
  const double slow =
      static_cast<double>(std::count_if(s.frames.begin(), s.frames.end(), [&a](const Frame& f) {
        return f.estimate_ms * 1e-3 > a.interval_s;
      }));
  if (a.interval_s > 0 &&
      (p99 > a.interval_s || slow > kFewOverBudget * static_cast<double>(a.read)))
    j->advise(
        "More than one frame in a hundred took longer than the frame interval: live, work would be "
        "dropped; lower the rate or odometry's "
        "features.");
}

void advise_by_reasons(const Session& s, const Analysis& a, Findings* j) {
  for (const Advice& skip : skip_advice())
    if (const auto n = std::count_if(s.events.begin(), s.events.end(),
                                     [&skip](const Event& e) { return e.kind == skip.word; });
        n > 0)
      j->advise(fmt::format("{} ({} frame{} skipped): {}", skip.word, n, n == 1 ? "" : "s",
                            skip.sentence));
  const bool changed = std::any_of(s.events.begin(), s.events.end(),
                                   [](const Event& e) { return e.kind == "rig_changed"; });
  for (const Advice& advice : pose_advice()) {
    // Frames that were doubted for a moment, or a calibration that was asked for, are no knock.
    if (advice.word == std::string_view("recalibrating") && !changed) continue;
    const auto found = std::find(s.reasons.begin(), s.reasons.end(), advice.word);
    if (found == s.reasons.end()) continue;
    const auto i = static_cast<std::size_t>(found - s.reasons.begin());
    const std::size_t frames =
        a.by_reason[i] - (i < a.waited_by_reason.size() ? a.waited_by_reason[i] : 0);
    if (frames > 0)
      j->advise(fmt::format("{} ({} frame{}): {}", advice.word, frames, frames == 1 ? "" : "s",
                            advice.sentence));
  }
}

}  // namespace

void Findings::find(Grade grade, std::string reason) {
  found_.push_back({grade, std::move(reason)});
  verdict_.grade = std::max(verdict_.grade, grade);
}

void Findings::give_up(const std::string& reason, const std::string& advice) {
  verdict_.usable = false;
  if (verdict_.main_reason.empty())
    verdict_.main_reason = reason + (advice.empty() ? "" : ". " + advice);
}

Verdict Findings::verdict() const {
  std::vector<Found> sorted = found_;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Found& a, const Found& b) { return a.grade > b.grade; });
  Verdict verdict = verdict_;
  for (Found& f : sorted) verdict.reasons.push_back(std::move(f.reason));
  return verdict;
}

const char* to_words(Grade grade) noexcept {
  switch (grade) {
    case Grade::good:
      return "Good";
    case Grade::care:
      return "Usable with care";
    case Grade::bad:
      return "Do not use";
  }
  return "";
}

Verdict judge(const Session& session, const Analysis& analysis) {
  Findings j;
  const Usability use = usability_of(session, analysis);
  const std::vector<Outage> outages = outages_of(session.events);
  const bool broken = break_the_way(outages, session, analysis);
  judge_outages(outages, session, analysis, &j);
  judge_mistake(session, analysis, &j);
  judge_focal_length(session, &j);
  if (analysis.read > 0 || outages.empty()) judge_frames(session, analysis, use, &j);
  if (analysis.source != ErrorSource::none) judge_drift(session, analysis, broken, &j);
  judge_calibration(session, use, &j);
  // Of a drive without a frame nothing else is to be asked.
  if (analysis.read > 0) judge_verification(session, analysis, use, &j);
  advise_on_events(session, &j);
  judge_session(session, analysis, &j);
  if (analysis.source == ErrorSource::none && analysis.read > 0)
    judge_drift(session, analysis, broken, &j);
  advise_by_reasons(session, analysis, &j);
  Verdict v = j.verdict();
  for (const std::string& reason : v.reasons)
    v.sentence += (v.sentence.empty() ? "" : "; ") + reason;
  if (v.reasons.empty())
    v.sentence = fmt::format(
        "every check passed: drift of {} on a drive of {:.0f} m, {} of {} frames ok{}",
        percent(analysis.drift.value_or(0)), analysis.path_m, analysis.ok,
        analysis.read + analysis.skipped,
        analysis.waited > 0
            ? fmt::format(", {} before the drive had confirmed its calibration", analysis.waited)
            : "");
  v.sentence.front() =
      static_cast<char>(std::toupper(static_cast<unsigned char>(v.sentence.front())));
  v.sentence += '.';
  return v;
}

}  // namespace vergence::app::report
