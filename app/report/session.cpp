#include "app/report/session.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "app/datasets/text_file.hpp"
#include "app/report/csv.hpp"
#include "app/report/detail/session_parts.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app::report {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLargestSummary = std::size_t{16} << 20U;  // bytes
constexpr std::size_t kLongestEventLine = std::size_t{64} << 10U;

std::optional<Event> parse_event(std::string_view line) {
  if (line.size() > kLongestEventLine) return std::nullopt;
  const auto json = nlohmann::json::parse(line, nullptr, false);
  if (!json.is_object()) return std::nullopt;
  Event e;
  if (const auto stamp = json.find("stamp_ns"); stamp != json.end() && stamp->is_number_integer())
    e.stamp = Stamp(stamp->get<std::int64_t>());
  e.kind = text_at(json, "kind");
  e.sentence = text_at(json, "sentence");
  return e;
}

void read_events(const fs::path& folder, Session* session) {
  auto lines =
      open_part(folder / "events.jsonl", "what happened during the drive is not known", session);
  if (!lines) return;
  std::size_t damaged = 0;
  for (std::string_view line; lines->next(&line);) {
    if (session->events.size() == kMostEvents) {
      ++session->events_dropped;
    } else if (auto event = parse_event(line)) {
      session->events.push_back(std::move(*event));
    } else {
      ++damaged;
    }
  }
  report_damage("events.jsonl", *lines, damaged, 0, session);
}

void read_summary(const fs::path& folder, Session* session) {
  const auto text = read_part(folder / "summary.json", kLargestSummary,
                              "the session was not closed (killed, or the power went); figures are "
                              "reckoned again from the other files",
                              session);
  if (!text) return;
  session->summary = nlohmann::json::parse(*text, nullptr, false);
  if (session->summary.is_object()) return;
  session->summary = nullptr;
  session->missing.emplace_back(
      "summary.json is torn; figures are reckoned again from the other files");
}

/// A drive that never found a calibration has none to write; its calibrations.csv and its summary
/// say so.
bool without_calibration(const Session& session) {
  return session.summary.is_object() &&
         std::none_of(session.calibrations.begin(), session.calibrations.end(),
                      [](const CalibrationRow& c) { return c.accepted; });
}

void read_calibration_file(const fs::path& folder, Session* session) {
  std::error_code error;
  if (!fs::exists(folder / "calibration.yaml", error) && without_calibration(*session)) return;
  const auto text = read_part(folder / "calibration.yaml", std::size_t{1} << 20U,
                              "the calibration in use at the end is not known", session);
  if (!text) return;
  try {
    session->calibration = parse_calibration(*text, "calibration.yaml");
  } catch (const InputError& e) {
    session->missing.push_back(
        fmt::format("{}; the calibration in use at the end is not known", e.what()));
  }
}

bool looks_like_a_session(const fs::path& folder) {
  std::error_code error;
  for (const char* name : {"poses.csv", "trajectory.tum", "summary.json", "events.jsonl"})
    if (fs::exists(folder / name, error)) return true;
  return false;
}

const nlohmann::json* find_path(const nlohmann::json& json, std::string_view path) {
  const nlohmann::json* at = &json;
  while (!path.empty()) {
    const std::size_t dot = path.find('.');
    const std::string key(path.substr(0, dot));
    path.remove_prefix(dot == std::string_view::npos ? path.size() : dot + 1);
    if (!at->is_object()) return nullptr;
    const auto found = at->find(key);
    if (found == at->end()) return nullptr;
    at = &*found;
  }
  return at;
}

/// What `read` gives, or a sentence in `missing`.
template <class Read>
auto part_of(const fs::path& file, const char* consequence, Session* session, const Read& read)
    -> std::optional<decltype(read())> {
  std::error_code error;
  if (!fs::exists(file, error)) {
    session->missing.push_back(
        fmt::format("{} is missing: {}", file.filename().string(), consequence));
    return std::nullopt;
  }
  try {
    return read();
  } catch (const InputError& e) {
    session->missing.push_back(fmt::format("{}; {}", e.what(), consequence));
    return std::nullopt;
  }
}

}  // namespace

std::optional<std::string> read_part(const fs::path& file, std::size_t limit,
                                     const char* consequence, Session* session) {
  return part_of(file, consequence, session, [&] { return read_text(file, limit); });
}

std::optional<FileLines> open_part(const fs::path& file, const char* consequence,
                                   Session* session) {
  return part_of(file, consequence, session, [&] { return FileLines(file); });
}

void leave_out(const char* file, std::size_t most, Session* session) {
  session->left_out.push_back(
      fmt::format("{} has more than {} lines; the rest is left out", file, most));
}

void report_damage(const char* file, const FileLines& lines, std::size_t rows,
                   std::size_t disordered, Session* session) {
  if (rows > 0)
    session->missing.push_back(
        fmt::format("{}: {} damaged line{} left out", file, rows, rows == 1 ? "" : "s"));
  if (lines.failed())
    session->missing.push_back(
        fmt::format("{}: reading it failed half way; the rest is left out", file));
  else if (lines.torn())
    session->missing.push_back(fmt::format(
        "{}: the last line is torn and was left out; the session was not closed", file));
  if (disordered > 0)
    session->missing.push_back(
        fmt::format("{}: {} line{} left out whose stamp is not later than the one before", file,
                    disordered, disordered == 1 ? "" : "s"));
}

std::optional<double> number_at(const nlohmann::json& json, std::string_view path) {
  const nlohmann::json* at = find_path(json, path);
  if (at == nullptr || !at->is_number()) return std::nullopt;
  const auto value = at->get<double>();
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

std::optional<bool> flag_at(const nlohmann::json& json, std::string_view path) {
  const nlohmann::json* at = find_path(json, path);
  return at != nullptr && at->is_boolean() ? std::optional(at->get<bool>()) : std::nullopt;
}

std::string text_at(const nlohmann::json& json, std::string_view path) {
  const nlohmann::json* at = find_path(json, path);
  return at != nullptr && at->is_string()
             ? at->get_ref<const std::string&>().substr(0, kLongestText)
             : std::string();
}

bool is_live(const Session& session) {
  // Only what devices give has figures of their clocks.
  return session.summary.is_object() && session.summary.contains("time") &&
         session.summary["time"].is_object();
}

Session read_session(const fs::path& folder, std::size_t most_frames) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw InputError(
        folder.string() +
        ": is no folder; give the session folder that --out named when it was recorded");
  if (!looks_like_a_session(folder))
    throw InputError(folder.string() +
                     ": has none of a session's files (poses.csv, trajectory.tum, summary.json, "
                     "events.jsonl); " +
                     "give the folder that --out named when it was recorded");
  Session session;
  session.name = fs::weakly_canonical(folder, error).filename().string();
  read_summary(folder, &session);
  if (!read_poses(folder, most_frames, &session) || session.frames.empty())
    frames_from_trajectory(folder, most_frames, &session);
  // Where there was nothing to compare with there is no such file.
  if (fs::exists(folder / "reference.tum", error) || number_at(session.summary, "metrics.ate_m"))
    session.reference = read_trajectory_part(folder, "reference.tum",
                                             "there is nothing to compare the trajectory with",
                                             most_frames, &session);
  read_calibrations(folder, &session);
  read_calibration_file(folder, &session);
  read_residuals(folder, &session);
  read_events(folder, &session);
  return session;
}

}  // namespace vergence::app::report
