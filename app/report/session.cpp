#include "app/report/session.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <span>
#include <type_traits>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "app/datasets/decimal.hpp"
#include "app/datasets/text_file.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app::report {

namespace {

namespace fs = std::filesystem;

// Size in bytes.
constexpr std::size_t kLargestSummary = std::size_t{16} << 20U;
constexpr std::size_t kLongestEventLine = std::size_t{64} << 10U;
// Length in bytes. Longer lines are skipped.
constexpr std::size_t kLongestLine = std::size_t{1} << 20U;

/// The lines of a file one after the other as Lines gives those of a text, whatever the file's
/// length. What follows the last line's end is left out: a killed writer leaves it, and a number
/// cut in the middle looks like another one.
///
/// Memory  The longest line.
/// Errors  The constructor throws InputError: not there, no file, not readable.
class FileLines {
 public:
  explicit FileLines(const fs::path& file) {
    std::error_code ignored;
    const auto status = fs::status(file, ignored);
    if (fs::exists(status) && !fs::is_regular_file(status))
      // Reading a pipe would block indefinitely.
      refuse(file, 0, "is not a file, but a directory, a pipe or a device");
    in_.open(file, std::ios::binary);
    if (!in_) refuse(file, 0, std::string("cannot be opened (") + std::strerror(errno) + ")");
  }

  /// False at the end. The view holds until the next call.
  [[nodiscard]] bool next(std::string_view* line) {
    constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
    line_.resize(kLongestLine);
    for (;;) {
      in_.getline(line_.data(), static_cast<std::streamsize>(line_.size()));
      if (in_.eof()) {
        truncated_ = in_.gcount() > 0;
        return false;
      }
      if (in_.bad()) return false;
      // The line is too long.
      if (in_.fail()) {
        in_.clear();
        in_.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
        continue;
      }
      std::string_view whole(line_.data(), static_cast<std::size_t>(in_.gcount()) - 1);
      if (!std::exchange(begun_, true) && whole.starts_with(kByteOrderMark))
        whole.remove_prefix(kByteOrderMark.size());
      *line = trimmed(whole);
      if (!line->empty() && line->front() != '#') return true;
    }
  }
  /// At the end: the file does not end with a line's end.
  [[nodiscard]] bool truncated() const noexcept { return truncated_; }
  /// At the end: the rest could not be read.
  [[nodiscard]] bool failed() const noexcept { return in_.bad(); }

 private:
  std::ifstream in_;
  std::string line_{};
  bool begun_ = false, truncated_ = false;
};

/// Rows of a table whose first line names the columns, commas between, nothing quoted: what the
/// recorder writes. A row with another number of fields than the head has has empty ones.
class CsvRows {
 public:
  explicit CsvRows(FileLines* lines) {
    std::string_view head;
    if (!lines->next(&head)) return;
    std::vector<std::string_view> names(kMaxColumns);
    names.resize(std::min(split(head, ',', names), kMaxColumns));
    names_.assign(names.begin(), names.end());
    fields_.resize(names_.size());
  }
  /// Splits the next row.
  void set(std::string_view line) {
    if (split(line, ',', fields_) != names_.size()) std::ranges::fill(fields_, std::string_view());
  }
  [[nodiscard]] bool has(std::string_view column) const noexcept {
    return std::ranges::find(names_, column) != names_.end();
  }
  /// Field of the last row; empty if the column does not exist.
  [[nodiscard]] std::string_view text(std::string_view column) const noexcept {
    const auto found = std::ranges::find(names_, column);
    return found == names_.end() ? std::string_view()
                                 : fields_[static_cast<std::size_t>(found - names_.begin())];
  }
  /// Nothing: empty, or not one finite number.
  [[nodiscard]] std::optional<double> number(std::string_view column) const noexcept {
    double value = 0;
    return parse_number(text(column), &value) ? std::optional(value) : std::nullopt;
  }
  [[nodiscard]] std::optional<std::int64_t> integer(std::string_view column) const noexcept {
    return parse_integer(text(column));
  }

 private:
  static constexpr std::size_t kMaxColumns = 256;
  std::vector<std::string> names_;
  std::vector<std::string_view> fields_;
};

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

/// Returns the result of `read`, or adds a message to `missing`.
template <class Read>
auto read_section(const fs::path& file, const char* consequence, Session* session, const Read& read)
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

std::optional<std::string> read_part(const fs::path& file, std::size_t limit,
                                     const char* consequence, Session* session) {
  return read_section(file, consequence, session, [&] { return read_text(file, limit); });
}

std::optional<FileLines> open_part(const fs::path& file, const char* consequence,
                                   Session* session) {
  return read_section(file, consequence, session, [&] { return FileLines(file); });
}

void report_damage(const char* file, const FileLines& lines, std::size_t rows,
                   std::size_t disordered, Session* session) {
  if (rows > 0)
    session->missing.push_back(
        fmt::format("{}: {} damaged line{} skipped", file, rows, rows == 1 ? "" : "s"));
  if (lines.failed())
    session->missing.push_back(
        fmt::format("{}: it could not be read to its end; the rest is missing", file));
  else if (lines.truncated())
    session->missing.push_back(fmt::format(
        "{}: the last line is incomplete and is skipped; the session was not closed", file));
  if (disordered > 0)
    session->missing.push_back(
        fmt::format("{}: {} line{} skipped because the stamp does not increase", file, disordered,
                    disordered == 1 ? "" : "s"));
}

/// Reads up to `most` rows of a file. `next` gives a row, nothing for a damaged one; false: the
/// end.
template <class Row, class Parse>
void read_rows(const char* file, std::size_t most, FileLines* lines, const Parse& parse,
               std::vector<Row>* rows, Session* session) {
  constexpr bool kAscending = std::is_same_v<Row, Frame> || std::is_same_v<Row, StampedPose>;
  std::size_t damaged = 0, disordered = 0;
  for (std::string_view line; lines->next(&line);) {
    if (rows->size() == most) {
      session->left_out.push_back(
          fmt::format("{} has more than {} lines; the rest is not shown", file, most));
      break;
    }
    std::optional<Row> row = parse(line);
    if (!row)
      ++damaged;
    else if (kAscending && !rows->empty() && row->stamp <= rows->back().stamp)
      ++disordered;
    else
      rows->push_back(std::move(*row));
  }
  report_damage(file, *lines, damaged, disordered, session);
}

constexpr std::size_t kMaxReasons = 64;
// Distance in m. A larger coordinate is corrupt and would flatten every plot.
constexpr double kFarthest = 1e7;

/// Index of a word among an enum's words, the first `count` of them.
template <class Enum>
std::optional<Enum> word_to_enum(std::string_view word, int count) {
  for (int i = 0; i < count; ++i)
    if (to_string(static_cast<Enum>(i)) == word) return static_cast<Enum>(i);
  return std::nullopt;
}

std::uint16_t reason_index(std::string_view word, Session* session) {
  const auto found = std::ranges::find(session->reasons, word);
  if (found != session->reasons.end())
    return static_cast<std::uint16_t>(found - session->reasons.begin());
  if (session->reasons.size() >= kMaxReasons) return 0;
  session->reasons.emplace_back(word.substr(0, kLongestText));
  return static_cast<std::uint16_t>(session->reasons.size() - 1);
}

bool near_enough(std::span<const double> numbers) {
  return std::ranges::all_of(numbers, [](double v) { return std::abs(v) <= kFarthest; });
}

bool set_pose(const std::array<double, 7>& v, Transform* T) {
  const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
  if (!near_enough(v) || !(q.norm() > 0.5) || !(q.norm() < 2.0)) return false;
  *T = {q.normalized().toRotationMatrix(), Vec3(v[0], v[1], v[2])};
  return true;
}

/// Numbers of the columns `prefix` + each of `names`. False, without a change of *out: one is
/// missing or too large.
template <std::size_t N>
bool numbers(const CsvRows& rows, const std::string& prefix,
             const std::array<const char*, N>& names, std::array<double, N>* out) {
  std::array<double, N> values{};
  for (std::size_t i = 0; i < N; ++i) {
    const auto v = rows.number(prefix + names[i]);
    if (!v) return false;
    values[i] = *v;
  }
  if (!near_enough(values)) return false;
  *out = values;
  return true;
}

/// Nothing: the row has no stamp.
std::optional<Frame> read_frame(const CsvRows& rows, Session* session) {
  constexpr std::array kWorld{"x", "y", "z", "qx", "qy", "qz", "qw"};
  constexpr std::array kEnu{"east", "north", "up"}, kError{"east_m", "north_m", "up_m"};
  const auto stamp = rows.integer("stamp_ns");
  const auto state = word_to_enum<State>(rows.text("state"), 6);
  const auto status = word_to_enum<PoseStatus>(rows.text("status"), 3);
  if (!stamp || !state || !status) return std::nullopt;
  Frame f;
  f.stamp = Stamp(*stamp);
  f.state = *state;
  f.status = *status;
  f.number = rows.integer("frame").value_or(-1);
  f.reason = reason_index(rows.text("reason"), session);
  std::array<double, 7> world{};
  f.posed = numbers(rows, "", kWorld, &world) && f.status != PoseStatus::lost &&
            set_pose(world, &f.T_world_left);
  f.placed = numbers(rows, "", kEnu, &f.enu);
  f.has_ins = numbers(rows, "ins_", kEnu, &f.ins);
  f.compared = numbers(rows, "error_", kError, &f.error);
  f.error_heading_deg = rows.number("error_heading_deg").value_or(kNone);
  f.inliers = static_cast<int>(std::clamp(rows.number("inliers").value_or(-1.0), -1.0, 1e6));
  f.estimate_ms = rows.number("estimate_ms").value_or(kNone);
  return f;
}

std::optional<StampedPose> tum_pose(std::string_view line) {
  std::array<std::string_view, 8> fields;
  if (split(line, ' ', fields) != fields.size()) return std::nullopt;
  const auto stamp = parse_seconds_ns(fields[0]);
  std::array<double, 7> v{};
  StampedPose pose;
  for (std::size_t i = 0; i < v.size(); ++i)
    if (!parse_number(fields[i + 1], &v[i])) return std::nullopt;
  if (!stamp || !set_pose(v, &pose.T_world_body)) return std::nullopt;
  pose.stamp = Stamp(*stamp);
  return pose;
}

void read_poses(const fs::path& folder, Session* session) {
  auto lines = open_part(folder / "poses.csv", "there are no poses", session);
  if (!lines) return;
  CsvRows rows(&*lines);
  if (!rows.has("stamp_ns")) {
    session->missing.emplace_back("poses.csv has no line with column names: there are no poses");
    return;
  }
  // Approximate length of a line in bytes.
  constexpr std::uintmax_t kLine = 200;
  std::error_code error;
  if (const auto size = fs::file_size(folder / "poses.csv", error); !error)
    session->frames.reserve(std::min(kMaxFrames, static_cast<std::size_t>(size / kLine)));
  const auto parse = [&](std::string_view line) {
    rows.set(line);
    return read_frame(rows, session);
  };
  read_rows("poses.csv", kMaxFrames, &*lines, parse, &session->frames, session);
}

void read_reference(const fs::path& folder, Session* session) {
  auto lines = open_part(folder / "reference.tum", "the trajectory has no reference", session);
  if (!lines) return;
  read_rows("reference.tum", kMaxFrames, &*lines, tum_pose, &session->reference, session);
}

std::optional<CalibrationRow> read_calibration_row(const CsvRows& rows) {
  constexpr std::array kAxes{"rx", "ry", "rz", "tx", "ty", "tz"};
  const auto number = [&rows](const char* name) { return rows.number(name).value_or(kNone); };
  CalibrationRow c;
  const auto stamp = rows.integer("stamp_ns"), camera = rows.integer("camera");
  if (!stamp || !camera || *camera < 1 || *camera >= kMaxCameras ||
      !numbers(rows, "", kAxes, &c.value))
    return std::nullopt;
  c.stamp = Stamp(*stamp);
  c.camera = static_cast<int>(*camera);
  c.accepted = rows.text("outcome") == "accepted";
  c.kept = rows.text("outcome") == "unchanged";
  c.cause = rows.text("cause").substr(0, kLongestText);
  c.reason = rows.text("reason").substr(0, kLongestText);
  c.frames = rows.integer("frames").value_or(0);
  c.latency_frames = number("latency_frames");
  c.decided = std::isfinite(c.latency_frames);
  c.held_out_before_px = number("held_out_before_px");
  c.held_out_after_px = number("held_out_after_px");
  c.reference_depth_m = number("reference_depth_m");
  c.depth_sigma_percent = number("depth_sigma_percent");
  c.depth_error_percent = number("depth_error_percent");
  c.has_sigma =
      numbers(rows, "sigma_total_", kAxes, &c.sigma) || numbers(rows, "sigma_", kAxes, &c.sigma);
  return c;
}

void read_calibrations(const fs::path& folder, Session* session) {
  auto lines =
      open_part(folder / "calibrations.csv", "changes of the calibration are unknown", session);
  if (!lines) return;
  CsvRows rows(&*lines);
  const auto parse = [&rows](std::string_view line) {
    rows.set(line);
    return read_calibration_row(rows);
  };
  read_rows("calibrations.csv", kMaxCalibrations, &*lines, parse, &session->calibrations, session);
}

std::optional<Event> parse_event(std::string_view line) {
  if (line.size() > kLongestEventLine) return std::nullopt;
  const auto json = nlohmann::json::parse(line, nullptr, false);
  if (!json.is_object()) return std::nullopt;
  Event e;
  if (const auto stamp = json.find("stamp_ns"); stamp != json.end() && stamp->is_number_integer())
    e.stamp = Stamp(stamp->get<std::int64_t>());
  e.kind = text_at(json, "kind");
  e.message = text_at(json, "message");
  return e;
}

void read_events(const fs::path& folder, Session* session) {
  auto lines = open_part(folder / "events.jsonl", "the events of the run are unknown", session);
  if (!lines) return;
  read_rows("events.jsonl", kMaxEvents, &*lines, parse_event, &session->events, session);
}

void read_summary(const fs::path& folder, Session* session) {
  const auto text = read_part(
      folder / "summary.json", kLargestSummary,
      "the session was not closed (killed, or power lost); its metrics are unknown", session);
  if (!text) return;
  session->summary = nlohmann::json::parse(*text, nullptr, false);
  if (session->summary.is_object()) return;
  session->summary = nullptr;
  session->missing.emplace_back("summary.json is damaged; its metrics are unknown");
}

/// A drive that never found a calibration has none to write; its calibrations.csv and its summary
/// say so.
bool without_calibration(const Session& session) {
  return session.summary.is_object() &&
         std::ranges::none_of(session.calibrations,
                              [](const CalibrationRow& c) { return c.accepted; });
}

void read_calibration_file(const fs::path& folder, Session* session) {
  std::error_code error;
  if (!fs::exists(folder / "calibration.yaml", error) && without_calibration(*session)) return;
  const auto text = read_part(folder / "calibration.yaml", std::size_t{1} << 20U,
                              "the calibration in use at the end is unknown", session);
  if (!text) return;
  try {
    session->calibration = parse_calibration(*text, "calibration.yaml");
  } catch (const InputError& e) {
    session->missing.push_back(
        fmt::format("{}; the calibration in use at the end is unknown", e.what()));
  }
}

bool is_session(const fs::path& folder) {
  std::error_code error;
  for (const char* name : {"poses.csv", "summary.json", "events.jsonl"})
    if (fs::exists(folder / name, error)) return true;
  return false;
}

}  // namespace

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

Session read_session(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw InputError(folder.string() +
                     ": no such directory; pass the session directory (--out of run or replay)");
  if (!is_session(folder))
    throw InputError(folder.string() +
                     ": is not a session directory (no poses.csv, summary.json or events.jsonl); "
                     "pass the directory of --out");
  Session session;
  session.name = fs::weakly_canonical(folder, error).filename().string();
  read_summary(folder, &session);
  read_poses(folder, &session);
  if (fs::exists(folder / "reference.tum", error) || number_at(session.summary, "metrics.ate_m"))
    read_reference(folder, &session);
  read_calibrations(folder, &session);
  read_calibration_file(folder, &session);
  read_events(folder, &session);
  return session;
}

}  // namespace vergence::app::report
