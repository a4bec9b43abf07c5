#include "tests/system/faults/fault_drive.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence::test {
namespace {

constexpr Stamp kStart{1'577'836'800'000'000'000};  // of every --fast drive
constexpr Duration kLongestDrive = Duration::seconds(86400.0);

/// Of the drive with this first pose: in real time that is where it begins.
Stamp start_of(Stamp first) { return first - kStart > kLongestDrive ? first : kStart; }

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream in(line);
  for (std::string cell; std::getline(in, cell, ',');) cells.push_back(cell);
  return cells;
}

PoseStatus status_of(const std::string& word) {
  return word == "ok" ? PoseStatus::ok : word == "lost" ? PoseStatus::lost : PoseStatus::degraded;
}

void read_poses(const std::filesystem::path& file, double from_s, FaultDrive* d) {
  enum Column : std::size_t { stamp_ns = 1, status = 3, reason = 4, x = 5, columns = 12 };
  std::ifstream in(file);
  std::string line;
  Stamp start = kStart;    // in real time it is the first pose's
  std::getline(in, line);  // the head
  while (std::getline(in, line)) {
    const std::vector<std::string> cells = cells_of(line);
    if (cells.size() < columns) continue;
    JudgedPose pose{Stamp(std::stoll(cells[stamp_ns])), status_of(cells[status]), {}};
    if (pose.status != PoseStatus::lost) {
      std::array<double, 7> n{};
      for (std::size_t i = 0; i < n.size(); ++i) n[i] = std::stod(cells[x + i]);
      pose.T_world_left.t = {n[0], n[1], n[2]};
      pose.T_world_left.R =
          Eigen::Quaterniond(n[6], n[3], n[4], n[5]).normalized().toRotationMatrix();
    }
    if (d->poses.empty()) start = start_of(pose.stamp);
    const double at = (pose.stamp - start).to_seconds();
    if (at >= from_s && pose.status != PoseStatus::ok) ++d->reasons[cells[reason]];
    d->poses.push_back(pose);
    d->at_s.push_back(at);
  }
}

void read_events(const std::filesystem::path& file, double from_s, FaultDrive* d) {
  std::ifstream in(file);
  Stamp start = kStart;
  if (!d->poses.empty()) start = start_of(d->poses.front().stamp);
  for (std::string line; std::getline(in, line);) {
    const auto event = nlohmann::json::parse(line);
    const Stamp stamp(event["stamp_ns"].get<std::int64_t>());
    if ((stamp - start).to_seconds() >= from_s) ++d->events[event["kind"].get<std::string>()];
  }
}

}  // namespace

FaultDrive drive_with_faults(const FaultCase& c) {
  const TemporaryFolder folder;
  const auto session = folder / "s";
  std::string arguments = fmt::format(
      "run '{}/app/config/mock_board.yaml' {} --quiet --duration {} --out '{}' "
      "--set cameras.0.size=[320,240] --set cameras.1.size=[320,240] {}",
      VERGENCE_SOURCE_DIR, c.system.empty() ? "--fast" : "", c.duration_s, session.string(),
      c.more);
  for (const std::string& fault : c.faults) arguments += " --fault '" + fault + "'";
  const Outcome outcome = run_vergence(
      arguments,
      c.system.empty() ? "" : fmt::format("{} LD_PRELOAD='{}'", c.system, VERGENCE_FAULTY_SYSTEM));
  FaultDrive d;
  d.code = outcome.code;
  d.err = outcome.err;
  if (!std::filesystem::exists(session / "poses.csv")) return d;
  d.whole = std::filesystem::exists(session / "summary.json") &&
            std::filesystem::exists(session / "report.html");
  read_poses(session / "poses.csv", c.from_s, &d);
  read_events(session / "events.jsonl", c.from_s, &d);
  if (std::filesystem::exists(session / "truth.tum"))
    d.truth = app::read_tum(session / "truth.tum");
  // An error without truth beside it would be none.
  d.whole = d.whole && !d.truth.empty() && !d.poses.empty() &&
            d.truth.back().stamp + Duration::seconds(1) >= d.poses.back().stamp;
  if (d.whole) {
    std::ifstream in(session / "summary.json");
    d.skipped = nlohmann::json::parse(in)["frames"]["skipped"].get<int>();
  }
  return d;
}

FaultResult judge(const FaultCase& c, const FaultDrive& drive, const NormalError& normal) {
  FaultResult r;
  if (drive.truth.empty()) return r;
  const Duration later =
      drive.poses.empty() ? Duration{} : start_of(drive.poses.front().stamp) - kStart;
  const NormalError there = [&](Stamp at, std::size_t frames) {
    return normal(at - later, frames);
  };
  r.honesty = judge_honesty(drive.poses, there, drive.truth);
  std::size_t first = 0, run = 0;
  for (std::size_t i = 0; i < drive.poses.size() && run < kHonestyFrames; ++i) {
    run = drive.poses[i].status == PoseStatus::ok && drive.at_s[i] >= c.until_s ? run + 1 : 0;
    if (run == 1) first = i;
  }
  if (run < kHonestyFrames) return r;
  r.recovery_s = drive.at_s[first] - c.until_s;
  const std::vector<JudgedPose> after(drive.poses.begin() + static_cast<std::ptrdiff_t>(first),
                                      drive.poses.end());
  r.error_after = judge_honesty(after, there, drive.truth).most_full;
  return r;
}

JudgedDrive drive_until_recovered(FaultCase c, const NormalError& normal) {
  constexpr double kMinute = 60;
  for (;;) {  // twice at most
    JudgedDrive d;
    d.drive = drive_with_faults(c);
    d.result = judge(c, d.drive, normal);
    if (d.result.recovery_s || c.duration_s >= kMinute) return d;
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
  return fmt::format("| {} | {} | {} | {} | {:.1f} | {} | {} |\n", c.name, faults, seen, after,
                     result.error_after, result.honesty.wrong, drive.code);
}

}  // namespace vergence::test
