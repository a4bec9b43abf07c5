#include "app/report/session.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <type_traits>

#include <Eigen/Geometry>

#include "app/datasets/text_file.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app::report {

namespace {

namespace fs = std::filesystem;

/// Fields of a line by the columns that the first line of its file names, with commas between and
/// nothing quoted, as the recorder writes them.
class Columns {
 public:
  /// Splits a line; a line with another number of fields has empty ones. Returns false for the
  /// first line.
  bool set(std::string_view line) {
    constexpr std::size_t kMaxColumns = 256;
    if (names_.empty()) {
      fields_.resize(kMaxColumns);
      fields_.resize(std::min(split(line, ',', fields_), kMaxColumns));
      names_.assign(fields_.begin(), fields_.end());
      return false;
    }
    if (split(line, ',', fields_) != names_.size()) std::ranges::fill(fields_, std::string_view());
    return true;
  }
  /// Empty if the column does not exist.
  [[nodiscard]] std::string_view text(std::string_view column) const noexcept {
    const auto found = std::ranges::find(names_, column);
    return found == names_.end() ? std::string_view()
                                 : fields_[static_cast<std::size_t>(found - names_.begin())];
  }
  /// NaN unless the field is one finite number.
  [[nodiscard]] double number(std::string_view column) const noexcept {
    double value = kNone;
    (void)parse_number(text(column), &value);
    return value;
  }
  [[nodiscard]] std::optional<std::int64_t> integer(std::string_view column) const noexcept {
    return parse_integer(text(column));
  }

 private:
  std::vector<std::string> names_;
  std::vector<std::string_view> fields_;
};

/// Null if there is nothing at that path, whose parts are separated by dots.
const nlohmann::json* find_path(const nlohmann::json& json, std::string_view path) {
  std::string pointer = "/" + std::string(path);
  std::ranges::replace(pointer, '.', '/');
  const nlohmann::json::json_pointer at(pointer);
  return json.contains(at) ? &json.at(at) : nullptr;
}

/// Calls `read`; a missing file, or what is wrong with it, becomes a message of `missing`.
template <class Read>
void read_part(const fs::path& file, const char* consequence, Session* session, const Read& read) {
  std::error_code error;
  if (!fs::exists(file, error))
    return session->missing.push_back(
        fmt::format("{} is missing: {}", file.filename().string(), consequence));
  try {
    read();
  } catch (const InputError& e) {
    session->missing.push_back(fmt::format("{}; {}", e.what(), consequence));
  }
}

/// Reads the rows of a file line by line, whatever its length. `parse` returns a row, or nothing
/// for a damaged line. The end of the file without an end of line was left by a killed writer, and
/// a number that is cut looks like another one, so it is skipped.
template <class Row, class Parse>
void read_rows(const fs::path& path, const char* consequence, std::vector<Row>* rows,
               Session* session, Columns* columns, const Parse& parse) {
  constexpr bool kAscending = std::is_same_v<Row, Frame> || std::is_same_v<Row, StampedPose>;
  read_part(path, consequence, session, [&] {
    // Reading a pipe would block indefinitely.
    if (!fs::is_regular_file(path)) refuse(path, 0, "is not a file");
    std::ifstream in(path, std::ios::binary);
    if (!in) refuse(path, 0, "cannot be opened");
    std::size_t damaged = 0, disordered = 0;
    bool truncated = false;
    for (std::string whole; !truncated && std::getline(in, whole);) {
      truncated = in.eof();
      const std::string_view line = trimmed(whole);
      if (truncated || line.empty() || line.front() == '#') continue;
      if (columns != nullptr && !columns->set(line)) continue;
      std::optional<Row> row = parse(line);
      if (!row)
        ++damaged;
      else if (kAscending && !rows->empty() && row->stamp <= rows->back().stamp)
        ++disordered;
      else
        rows->push_back(std::move(*row));
    }
    const std::string file = path.filename().string();
    for (const auto& [count, why] :
         {std::pair{damaged, ": damaged"}, {disordered, " because the stamp does not increase"}})
      if (count > 0)
        session->missing.push_back(
            fmt::format("{}: {} line{} skipped{}", file, count, count == 1 ? "" : "s", why));
    if (truncated || in.bad())
      session->missing.push_back(
          file + ": it ends within a line, which is skipped; the session was not closed");
  });
}

// Distance in m. A larger coordinate is corrupt and would flatten every plot.
constexpr double kFarthest = 1e7;

/// Value of an enumeration, from 0 to `last`, by its name.
template <class Enum>
std::optional<Enum> word_to_enum(std::string_view word, Enum last) {
  for (int i = 0; i <= static_cast<int>(last); ++i)
    if (to_string(static_cast<Enum>(i)) == word) return static_cast<Enum>(i);
  return std::nullopt;
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
bool numbers(const Columns& columns, const std::string& prefix,
             const std::array<const char*, N>& names, std::array<double, N>* out) {
  std::array<double, N> values{};
  for (std::size_t i = 0; i < N; ++i) values[i] = columns.number(prefix + names[i]);
  if (!near_enough(values)) return false;
  *out = values;
  return true;
}

/// Nothing: the row has no stamp, state or status.
std::optional<Frame> parse_frame(const Columns& columns) {
  constexpr std::array kWorld{"x", "y", "z", "qx", "qy", "qz", "qw"};
  constexpr std::array kEnu{"east", "north", "up"}, kError{"east_m", "north_m", "up_m"};
  const auto stamp = columns.integer("stamp_ns");
  const auto state = word_to_enum(columns.text("state"), State::lost);
  const auto status = word_to_enum(columns.text("status"), PoseStatus::lost);
  if (!stamp || !state || !status) return std::nullopt;
  Frame f{
      .stamp = Stamp(*stamp),
      .state = *state,
      .status = *status,
      .reason =
          word_to_enum(columns.text("reason"), Reason::pairing_ambiguous).value_or(Reason::none)};
  std::array<double, 7> world{};
  f.posed = numbers(columns, "", kWorld, &world) && f.status != PoseStatus::lost &&
            set_pose(world, &f.T_world_left);
  f.placed = numbers(columns, "", kEnu, &f.enu);
  f.has_ins = numbers(columns, "ins_", kEnu, &f.ins);
  f.compared = numbers(columns, "error_", kError, &f.error);
  f.error_heading_deg = columns.number("error_heading_deg");
  const double inliers = columns.number("inliers");
  f.inliers = inliers >= 0 ? static_cast<int>(std::min(inliers, 1e6)) : -1;
  f.estimate_ms = columns.number("estimate_ms");
  return f;
}

std::optional<StampedPose> parse_tum_pose(std::string_view line) {
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

std::optional<CalibrationRow> parse_calibration_row(const Columns& columns) {
  constexpr std::array kAxes{"rx", "ry", "rz", "tx", "ty", "tz"};
  CalibrationRow c;
  const auto stamp = columns.integer("stamp_ns"), camera = columns.integer("camera");
  if (!stamp || !camera || *camera < 1 || *camera >= kMaxCameras ||
      !numbers(columns, "", kAxes, &c.value))
    return std::nullopt;
  c.stamp = Stamp(*stamp);
  c.camera = static_cast<int>(*camera);
  c.accepted = columns.text("outcome") == "accepted";
  c.kept = columns.text("outcome") == "unchanged";
  c.cause = columns.text("cause");
  c.reason = columns.text("reason");
  c.decided = columns.integer("latency_frames").has_value();
  c.held_out_before_px = columns.number("held_out_before_px");
  c.held_out_after_px = columns.number("held_out_after_px");
  c.reference_depth_m = columns.number("reference_depth_m");
  c.depth_sigma_percent = columns.number("depth_sigma_percent");
  c.has_sigma = numbers(columns, "sigma_total_", kAxes, &c.sigma) ||
                numbers(columns, "sigma_", kAxes, &c.sigma);
  return c;
}

std::optional<Event> parse_event(std::string_view line) {
  const auto json = nlohmann::json::parse(line, nullptr, false);
  if (!json.is_object()) return std::nullopt;
  Event e;
  if (const auto stamp = json.find("stamp_ns"); stamp != json.end() && stamp->is_number_integer())
    e.stamp = Stamp(stamp->get<std::int64_t>());
  e.kind = text_at(json, "kind");
  e.message = text_at(json, "message");
  return e;
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
  return at != nullptr && at->is_string() ? at->get<std::string>() : std::string();
}

Session read_session(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw InputError(folder.string() +
                     ": no such directory; pass the session directory (--out of run or replay)");
  constexpr std::array kAny{"poses.csv", "summary.json", "events.jsonl"};
  if (std::ranges::none_of(kAny, [&](const char* name) { return fs::exists(folder / name); }))
    throw InputError(folder.string() +
                     ": is not a session directory (no poses.csv, summary.json or events.jsonl); "
                     "pass the directory of --out");
  Session s{.name = fs::weakly_canonical(folder, error).filename().string()};
  read_part(folder / "summary.json",
            "the session was not closed (killed, or power lost); its metrics are unknown", &s, [&] {
              s.summary = nlohmann::json::parse(read_text(folder / "summary.json"), nullptr, false);
              if (s.summary.is_object()) return;
              s.summary = nullptr;
              throw InputError("summary.json is damaged");
            });
  Columns columns;
  read_rows(folder / "poses.csv", "there are no poses", &s.frames, &s, &columns,
            [&](std::string_view /*line*/) { return parse_frame(columns); });
  if (fs::exists(folder / "reference.tum", error) || number_at(s.summary, "metrics.ate_m"))
    read_rows(folder / "reference.tum", "the trajectory has no reference", &s.reference, &s,
              nullptr, parse_tum_pose);
  columns = {};
  read_rows(folder / "calibrations.csv", "changes of the calibration are unknown", &s.calibrations,
            &s, &columns,
            [&](std::string_view /*line*/) { return parse_calibration_row(columns); });
  read_rows(folder / "events.jsonl", "the events of the run are unknown", &s.events, &s, nullptr,
            parse_event);
  return s;
}

}  // namespace vergence::app::report
