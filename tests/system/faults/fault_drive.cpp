#include "tests/system/faults/fault_drive.hpp"

#include <algorithm>
#include <cstdint>

#include <fmt/format.h>

#include "app/report/session.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence::test {
namespace {

/// Start of every --fast run.
constexpr Stamp kStart{1'577'836'800'000'000'000};
constexpr Duration kLongestDrive = Duration::seconds(86400.0);
constexpr double kMinute = 60;
/// A run in real time may be this old in s before its first pose.
constexpr double kStarting = 6;

/// Ground truth of the drive with this first pose: in real time it begins there.
Stamp start_of(Stamp first) { return first - kStart > kLongestDrive ? first : kStart; }

}  // namespace

FaultDrive drive_with_faults(const FaultCase& c) {
  const TemporaryFolder folder;
  std::string arguments = fmt::format(
      "run '{}/app/config/mock_board.yaml' {} --quiet --duration {} --out '{}' "
      "--set cameras.0.size=[320,240] --set cameras.1.size=[320,240] {}",
      VERGENCE_SOURCE_DIR, c.system.empty() ? "--fast" : "", c.duration_s, (folder / "s").string(),
      c.more);
  for (const std::string& fault : c.faults) arguments += " --fault '" + fault + "'";
  const Outcome outcome = run_vergence(
      arguments,
      c.system.empty() ? "" : fmt::format("{} LD_PRELOAD='{}'", c.system, VERGENCE_FAULTY_SYSTEM));
  FaultDrive d{.code = outcome.code, .err = outcome.err};
  if (!std::filesystem::exists(folder / "s" / "poses.csv")) return d;
  const app::report::Session session = app::report::read_session(folder / "s");
  // In real time, the run starts at its first pose.
  const Stamp start = session.frames.empty() ? kStart : start_of(session.frames.front().stamp);
  for (const app::report::Frame& frame : session.frames) {
    d.poses.push_back({frame.stamp, frame.status, frame.T_world_left});
    d.at_s.push_back((frame.stamp - start).to_seconds());
    if (d.at_s.back() >= c.from_s && frame.status != PoseStatus::ok)
      ++d.reasons[std::string(to_string(frame.reason))];
  }
  for (const app::report::Event& event : session.events)
    if ((event.stamp - start).to_seconds() >= c.from_s) ++d.events[event.kind];
  if (std::filesystem::exists(folder / "s" / "truth.tum"))
    d.truth = app::read_tum(folder / "s" / "truth.tum");
  d.summary = session.summary;
  // An error without truth beside it would be none.
  d.whole = session.missing.empty() && std::filesystem::exists(folder / "s" / "report.html") &&
            !d.truth.empty() && !d.poses.empty() &&
            d.truth.back().stamp + Duration::seconds(1) >= d.poses.back().stamp &&
            d.at_s.back() >= c.duration_s - (c.system.empty() ? 1 : kStarting);
  return d;
}

FaultResult evaluate(const FaultCase& c, const FaultDrive& drive, const NormalError& normal) {
  FaultResult r;
  if (drive.truth.empty()) return r;
  const Duration later =
      drive.poses.empty() ? Duration{} : start_of(drive.poses.front().stamp) - kStart;
  const NormalError there = [&](Stamp from, Stamp to) { return normal(from - later, to - later); };
  r.integrity = evaluate_integrity(drive.poses, there, drive.truth);
  std::size_t first = 0, run = 0;
  for (std::size_t i = 0; i < drive.poses.size() && run < kIntegrityFrames; ++i) {
    run = drive.poses[i].status == PoseStatus::ok && drive.at_s[i] >= c.until_s ? run + 1 : 0;
    if (run == 1) first = i;
  }
  if (run < kIntegrityFrames) return r;
  r.recovery_s = drive.at_s[first] - c.until_s;
  const std::vector<EvaluatedPose> after(drive.poses.begin() + static_cast<std::ptrdiff_t>(first),
                                         drive.poses.end());
  r.error_after = evaluate_integrity(after, there, drive.truth).max_full;
  return r;
}

Untouched untouched_drive() {
  // The untouched drive of a minute is normally off by 4.0 cm over 20 frames, 1067 of its 1184
  // poses are `ok`, and none is lost. A judge that takes for normal what is worse sees less.
  constexpr double kNormal = 0.05;
  constexpr int kOk = 1000;
  FaultCase none;
  none.name = "none";
  none.duration_s = kMinute;
  Untouched u{.drive = drive_with_faults(none)};
  const auto& poses = u.drive.poses;
  const auto count = [&poses](PoseStatus status) {
    return std::count_if(poses.begin(), poses.end(),
                         [status](const EvaluatedPose& p) { return p.status == status; });
  };
  u.normal = normal_error_there(poses, u.drive.truth);
  const double usual = normal_errors(poses, u.drive.truth)[kIntegrityFrames].shift_m;
  if (u.drive.code != 0 || !u.drive.whole || count(PoseStatus::lost) > 0 ||
      count(PoseStatus::ok) < kOk || !(usual > 0) || usual > kNormal)
    u.unfit = fmt::format("the untouched drive: exit {}, {}, {} ok, {} lost, {:.3f} m off\n{}",
                          u.drive.code, u.drive.whole ? "whole" : "not whole",
                          count(PoseStatus::ok), count(PoseStatus::lost), usual, u.drive.err);
  return u;
}

std::string unsaid(const FaultCase& c, const FaultDrive& drive, const FaultDrive& untouched) {
  if (c.said.empty()) {
    // The untouched drive has no later poses.
    if (c.from_s >= kMinute) return "";
    for (std::size_t i = 0; i < std::min(drive.poses.size(), untouched.poses.size()); ++i)
      if (drive.at_s[i] >= c.from_s &&
          drive.poses[i].T_world_left.t != untouched.poses[i].T_world_left.t)
        return "";
    return "any difference from the untouched drive";
  }
  std::string missing;
  for (const std::string& what : c.said) {
    const bool seen =
        what.starts_with('/')
            ? drive.summary.is_object() &&
                  drive.summary.value(nlohmann::json::json_pointer(what), std::int64_t{0}) > 0
            : drive.events.count(what) > 0 || drive.reasons.count(what) > 0 ||
                  drive.err.find(what + "\n") != std::string::npos;
    if (!seen) missing += (missing.empty() ? "" : ", ") + what;
  }
  return missing;
}

bool is_bad(const FaultDrive& drive, const FaultResult& result) {
  // Exit 1: the drive ended before a pose was usable again.
  const bool failed = drive.code != 0 && !(drive.code == 1 && !result.recovery_s);
  return failed || !drive.whole || result.integrity.wrong > 0 || result.integrity.not_evaluated > 0;
}

EvaluatedDrive drive_until_recovered(FaultCase c, const NormalError& normal) {
  // The loop runs twice at most.
  for (;;) {
    EvaluatedDrive d{.drive = drive_with_faults(c)};
    d.result = evaluate(c, d.drive, normal);
    if (is_bad(d.drive, d.result) || d.result.recovery_s || c.duration_s >= kMinute) return d;
    c.duration_s = kMinute;
  }
}

std::string fault_table_head() {
  return "| fault | `--fault` | what the user sees: events, frames by reason | `ok` again after | "
         "error then | wrong `ok` | exit |\n|---|---|---|---|---|---|---|\n";
}

std::string fault_table_line(const FaultCase& c, const FaultDrive& drive,
                             const FaultResult& result) {
  std::string faults, seen;
  for (const std::string& fault : c.faults)
    faults += fmt::format("{}`{}`", faults.empty() ? "" : " ", fault);
  for (const std::string& more : {c.more, c.system})
    if (!more.empty()) faults += fmt::format("{}`{}`", faults.empty() ? "" : " ", more);
  for (const auto& [kind, count] : drive.events) {
    if (kind == "fault" || kind == "state") continue;
    seen += fmt::format("{}`{}`{}", seen.empty() ? "" : ", ", kind,
                        count > 1 ? fmt::format(" {}", count) : "");
  }
  std::string reasons;
  for (const auto& [reason, count] : drive.reasons)
    reasons += fmt::format("{}{} {}", reasons.empty() ? "" : ", ", reason, count);
  if (!reasons.empty()) seen += (seen.empty() ? "" : "; ") + reasons;
  const std::string after =
      result.recovery_s ? fmt::format("{:.2f} s", *result.recovery_s) : "not any more";
  std::string wrong = std::to_string(result.integrity.wrong);
  if (result.integrity.not_evaluated > 0)
    wrong += fmt::format(", {} where there is no truth", result.integrity.not_evaluated);
  if (result.integrity.wrong_over_all > 0)
    wrong += fmt::format(" ({} over `degraded` ones)", result.integrity.wrong_over_all);
  return fmt::format("| {} | {} | {} | {} | {:.1f} | {} | {} |\n", c.name, faults, seen, after,
                     result.error_after, wrong, drive.code);
}

}  // namespace vergence::test
