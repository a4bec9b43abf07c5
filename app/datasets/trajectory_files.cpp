#include "app/datasets/trajectory_files.hpp"

#include <numeric>
#include <system_error>

#include "app/datasets/detail/names.hpp"
#include "app/datasets/foreign_calibration.hpp"
#include "app/datasets/text_file.hpp"
#include "app/runtime/transform_rows.hpp"
#include "core/math/robust.hpp"

namespace vergence::app {
namespace {

namespace fs = std::filesystem;
using detail::present;

// Two decimals of a quaternion keep its length within this tolerance, which other columns rarely
// do.
constexpr double kQuaternionLength = 0.02;
// Tolerance of R Rᵀ − I: three decimals of a matrix stay within it.
constexpr double kNearRotation = 5e-3;
// In ns: step from row to row of a file without times.
constexpr std::int64_t kRowStep = 100'000'000;
constexpr std::int64_t kMaxPoses = 100'000'000;
// A larger deviation means that digits were lost, and is reported.
constexpr double kRounded = 1e-4;

/// Meaning of a row's numbers; the value is their count.
enum class Layout : std::uint8_t { pose = 7, matrix3x4 = 12, matrix4x4 = 16 };

/// Meaning of the columns.
struct Columns {
  Layout layout = Layout::pose;
  std::optional<TimeColumns> time{};
  // True if the number of the pose stands in place of a time.
  bool counted = false;
  // Columns of x, y, z and of the quaternion as written.
  std::array<std::size_t, 7> pose{};
  // First column of a matrix.
  std::size_t first = 0;
  // Order by the headings.
  std::optional<QuaternionOrder> order{};
  [[nodiscard]] std::size_t count() const { return static_cast<std::size_t>(layout); }
  [[nodiscard]] std::size_t needed() const {
    std::size_t last =
        layout == Layout::pose ? *std::ranges::max_element(pose) : first + count() - 1;
    if (time) last = std::max(last, time->last());
    return last + 1;
  }
};

/// Letters and digits of a heading in lower case, without its unit: `p_RS_R_x [m]` → `prsrx`.
std::string plain(std::string_view heading) {
  std::string word;
  for (const char c : detail::lower(heading.substr(0, heading.find_first_of("[("))))
    if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) word.push_back(c);
  return word;
}

bool contains(const std::string& word, std::initializer_list<const char*> parts) {
  return std::ranges::any_of(
      parts, [&](const char* part) { return word.find(part) != std::string::npos; });
}

/// True if the heading is an axis of a quaternion, in the words of common programs.
bool is_quaternion(const std::string& word) {
  return word.size() == 2 ? word[0] == 'q'
                          : word.starts_with("q") || contains(word, {"quat", "orient", "rot"});
}
bool is_position(const std::string& word) {
  // These are x, y and z.
  if (word.size() == 1) return true;
  if (contains(word, {"vel", "acc", "gyr", "bias", "cov", "std", "sigma", "twist", "ang", "lin"}))
    return false;
  return word[0] == 'p' || word[0] == 't' || contains(word, {"pos", "trans"});
}

/// Columns by the headings, if these name a complete pose.
std::optional<Columns> columns_of_names(const std::vector<std::string_view>& names) {
  // Columns of x, y, z and of x, y, z, w of the quaternion.
  std::array<std::optional<std::size_t>, 7> pose;
  std::optional<std::size_t> exact, seconds, nanoseconds, stamp;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string word = plain(names[i]);
    if (word.empty()) continue;
    const std::size_t axis = std::string_view("xyzw").find(word.back());
    std::optional<std::size_t>* place = nullptr;
    if (word.ends_with("nsec") || word.ends_with("nsecs") || word.ends_with("nanosec"))
      place = &nanoseconds;
    else if (word.ends_with("secs") || word.ends_with("sec"))
      place = &seconds;
    else if (contains(word, {"headerstamp"}))
      place = &exact;
    else if (contains(word, {"time", "stamp"}) || word == "t" || word == "ts")
      place = &stamp;
    else if (axis < 4 && is_quaternion(word))
      place = &pose[3 + axis];
    else if (axis < 3 && is_position(word))
      place = &pose[axis];
    if (place != nullptr && !*place) *place = i;
  }
  if (exact) stamp = exact;
  if (!stamp || nanoseconds) stamp = seconds ? seconds : stamp;
  if (!stamp || !std::ranges::all_of(pose, [](const auto& column) { return column.has_value(); }))
    return std::nullopt;
  Columns c{.time = TimeColumns{.time = *stamp}};
  if (seconds == stamp) c.time->nanoseconds = nanoseconds;
  std::ranges::transform(pose, c.pose.begin(), [](const auto& column) { return *column; });
  // This is their order in `pose`.
  c.order = QuaternionOrder::xyzw;
  return c;
}

/// Parses the numbers of a row from `first` on. Returns false unless all of them exist and are
/// finite.
bool finite_numbers(const std::vector<std::string_view>& fields, std::size_t first,
                    std::span<double> out) {
  if (first + out.size() > fields.size()) return false;
  for (std::size_t i = 0; i < out.size(); ++i)
    if (!parse_number(fields[first + i], &out[i])) return false;
  return true;
}

double off_rotation(const Mat3& R) {
  return R.determinant() > 0 ? (R * R.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff() : 1.0;
}

bool is_matrix(const std::vector<std::string_view>& fields, std::size_t first, Layout layout) {
  std::array<double, 16> v{};
  v[15] = 1;
  // The tolerance only detects a matrix; inaccurate rows are refused one by one.
  constexpr double kRoughly = 0.1;
  return finite_numbers(fields, first, std::span(v).first(static_cast<std::size_t>(layout))) &&
         off_rotation(transform_of(v).R) < kRoughly && v[12] == 0 && v[13] == 0 && v[14] == 0 &&
         v[15] == 1;
}

bool is_unit(const std::vector<std::string_view>& fields, std::size_t first) {
  std::array<double, 4> q{};
  return finite_numbers(fields, first, q) &&
         std::abs(std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3])) - 1) <=
             kQuaternionLength;
}

/// Columns by the numbers of a complete row; empty for other rows. `time` was inferred from all
/// rows.
std::optional<Columns> columns_of_row(const std::vector<std::string_view>& fields,
                                      const TimeColumns& time) {
  Columns c;
  const std::size_t n = fields.size();
  for (const Layout layout : {Layout::matrix3x4, Layout::matrix4x4}) {
    const std::size_t first = n - std::min(n, static_cast<std::size_t>(layout));
    if (first > time.last() + 1 || !is_matrix(fields, first, layout)) continue;
    c.layout = layout;
    c.first = first;
    // A small integer before a matrix is the number of its frame.
    const auto number = parse_integer(fields[0]);
    c.counted = first == 1 && number && *number >= 0 && *number < kMaxPoses;
    if (first > 0) c.time = !c.counted && first > time.last() ? time : TimeColumns{};
    return c;
  }
  const auto pose_from = [&c](std::size_t first) {
    std::iota(c.pose.begin(), c.pose.end(), first);
    return c;
  };
  // In a row of eight columns a counter is the stamp.
  for (const TimeColumns& times : {time, TimeColumns{}, TimeColumns{.time = 1}})
    if (n >= times.last() + 8 && is_unit(fields, times.last() + 4)) {
      c.time = times;
      return pose_from(times.last() + 1);
    }
  if (n != 7 || !is_unit(fields, 3)) return std::nullopt;
  return pose_from(0);
}

/// First rows of a file, from which the format is inferred.
struct Sample {
  explicit Sample(TextTable table) : names(table.names()), separator(table.separator()) {
    constexpr std::size_t kRows = 1000;
    while (rows.size() < kRows && table.next())
      if (!table.fields().empty()) rows.push_back(table.fields());
    if (!rows.empty()) time = find_time_columns(rows);
  }
  std::vector<std::string_view> names;
  char separator;
  std::vector<std::vector<std::string_view>> rows{};
  TimeColumns time{};
};

Columns find_columns(const fs::path& file, const Sample& sample, std::size_t first_line) {
  if (auto named = columns_of_names(sample.names)) return *named;
  for (const auto& row : sample.rows)
    if (auto found = columns_of_row(row, sample.time)) return *found;
  // If no row matches, reading the rows gives more specific messages.
  const std::size_t n = sample.rows.front().size();
  Columns c;
  if (n == 12 || n == 13) {
    c.layout = Layout::matrix3x4;
    c.first = n - 12;
    if (c.first > 0) c.time = TimeColumns{};
  } else if (n >= 8) {
    c.time = TimeColumns{};
    std::iota(c.pose.begin(), c.pose.end(), std::size_t{1});
  } else {
    refuse(file, first_line,
           "has {} columns; a pose has 8 (stamp tx ty tz qx qy qz qw) or 12 (a 3x4 matrix, row by "
           "row)",
           n);
  }
  return c;
}

/// Keeps the first of the rows that repeat a stamp.
void sort_by_stamp(Trajectory* poses) {
  std::ranges::stable_sort(*poses, {}, &StampedPose::stamp);
  const auto repeated = std::ranges::unique(*poses, {}, &StampedPose::stamp);
  poses->erase(repeated.begin(), repeated.end());
}

/// Reads one file in two passes: its format, then its rows. Memory holds its text and its poses.
class Reader {
 public:
  Reader(const fs::path& file, std::string_view text, const TrajectoryOptions& options)
      : file_(file), text_(text), options_(options), sample_(TextTable(text)) {
    TextTable table(text);
    if (!table.next())
      refuse(file, 0,
             "has no pose: no row consists of numbers; pass a TUM, KITTI or EuRoC trajectory");
    columns_ = find_columns(file, sample_, table.line());
    // Its headings or its name show ground truth of EuRoC.
    euroc_ = file.filename() == "data.csv" ||
             std::ranges::find(sample_.names, "prsrx", plain) != sample_.names.end();
    find_times();
    find_order();
  }

  [[nodiscard]] bool euroc() const { return euroc_; }

  TrajectoryFile read() {
    out_.poses.reserve(max_rows());
    TextTable table(text_);
    while (table.next())
      if (!read_row(table)) break;
    if (out_.poses.empty())
      refuse(file_, 0,
             skipped_ > 0 ? fmt::format("has no pose: {} rows have only NaN or zero quaternions; "
                                        "check the program that wrote it",
                                        skipped_)
                          : "has no pose; check that it is the right file");
    out_.timed = columns_.time && !columns_.counted;
    out_.numbered = columns_.counted;
    out_.rows = columns_.counted ? max_number_ + 1 : rows_;
    put_in_order();
    add_remarks();
    return std::move(out_);
  }

 private:
  void find_times() {
    if (!columns_.time || columns_.time->nanoseconds) return;
    std::vector<std::string_view> times;
    bool whole = true;
    for (const auto& row : sample_.rows) {
      if (columns_.time->time >= row.size()) continue;
      times.push_back(row[columns_.time->time]);
      whole = whole && parse_integer(times.back()).has_value();
    }
    form_ = find_time_form(times, options_.unit,
                           euroc_ && whole ? TimeUnit::nanoseconds : TimeUnit::seconds);
    if (!options_.unit && !describe(form_).empty() && !euroc_)
      out_.remarks.push_back(describe(form_));
  }

  void find_order() {
    out_.order = columns_.order.value_or(QuaternionOrder::xyzw);
    if (!columns_.order && columns_.layout == Layout::pose) {
      // EuRoC and VINS write w first, with commas and whole nanoseconds.
      const bool csv = sample_.separator != ' ' && form_.unit == TimeUnit::nanoseconds;
      if (csv) out_.order = QuaternionOrder::wxyz;
      if (csv && !euroc_ && !options_.quaternion)
        out_.remarks.emplace_back(
            "quaternions are taken to have w first, as EuRoC and VINS write with nanoseconds and "
            "commas");
    }
    if (!options_.quaternion) return;
    // The user's order refers to the columns as they are in the file.
    out_.order = *options_.quaternion;
    std::sort(columns_.pose.begin() + 3, columns_.pose.end());
  }

  [[nodiscard]] std::size_t max_rows() const {
    // Minimum length of eight numbers in bytes.
    constexpr std::size_t kShortest = 15;
    const auto ends = static_cast<std::size_t>(std::ranges::count(text_, '\n'));
    return std::min(ends, text_.size() / kShortest) + 1;
  }

  /// Returns false if the row is the last one and incomplete.
  bool read_row(const TextTable& table) {
    const auto& fields = table.fields();
    if (fields.size() < columns_.needed()) {
      if (table.unfinished() && !out_.poses.empty()) {
        out_.remarks.emplace_back("the last row is incomplete and is skipped");
        return false;
      }
      refuse(file_, table.line(), "has {} columns, the other rows {}; complete or remove it",
             fields.size(), columns_.needed());
    }
    StampedPose pose;
    if (!read_stamp(fields, table.line(), &pose.stamp) ||
        !read_pose(fields, table.line(), &pose.T_world_body))
      ++skipped_;
    else
      out_.poses.push_back(pose);
    ++rows_;
    return true;
  }

  bool read_stamp(const std::vector<std::string_view>& fields, std::size_t line, Stamp* stamp) {
    if (!columns_.time) {
      *stamp = Stamp(static_cast<std::int64_t>(rows_) * kRowStep);
      return true;
    }
    const std::string_view field = fields[columns_.time->time];
    if (is_no_value(field)) return false;
    if (columns_.counted) {
      const auto number = parse_integer(field);
      if (!number || *number < 0 || *number > kMaxPoses)
        refuse(file_, line, "`{}` is not the number of a pose; the first column counts from 0",
               field.substr(0, 40));
      max_number_ = std::max(max_number_, static_cast<std::size_t>(*number));
      *stamp = Stamp(*number * kRowStep);
      return true;
    }
    const auto read = read_time(fields, *columns_.time, form_);
    if (!read)
      refuse(file_, line, "`{}` is not a stamp in {}; check --time-unit", field.substr(0, 40),
             to_string(form_.unit));
    *stamp = *read;
    return true;
  }

  bool read_pose(const std::vector<std::string_view>& fields, std::size_t line, Transform* T) {
    std::array<double, 16> v{};
    for (std::size_t i = 0; i < columns_.count(); ++i) {
      const std::string_view field =
          fields[columns_.layout == Layout::pose ? columns_.pose[i] : columns_.first + i];
      if (is_no_value(field)) return false;
      if (!parse_number(field, &v[i]))
        refuse(file_, line, "`{}` is not a finite number", field.substr(0, 40));
    }
    if (columns_.layout == Layout::pose) {
      const bool w_first = out_.order == QuaternionOrder::wxyz;
      const Eigen::Quaterniond q = w_first ? Eigen::Quaterniond(v[3], v[4], v[5], v[6])
                                           : Eigen::Quaterniond(v[6], v[3], v[4], v[5]);
      if (q.norm() == 0) return false;
      if (!(std::abs(q.norm() - 1.0) <= kQuaternionLength))
        refuse(file_, line,
               "the quaternion has the length {:.6f} instead of 1; check the order of the columns",
               q.norm());
      *T = {q.normalized().toRotationMatrix(), {v[0], v[1], v[2]}};
      return true;
    }
    *T = transform_of(v);
    const double off = off_rotation(T->R);
    if (!(off <= kNearRotation))
      refuse(file_, line,
             "the matrix is not a rotation: it is a reflection, or its rows deviate from "
             "orthonormal by more than {:g}; check the order of the columns",
             kNearRotation);
    roughest_ = std::max(roughest_, off);
    T->R = normalised(T->R);
    return true;
  }

  /// Restores the order of the stamps and drops rows that repeat one.
  void put_in_order() {
    Trajectory& poses = out_.poses;
    for (std::size_t i = 1; i < poses.size(); ++i)
      moved_ += poses[i].stamp < poses[i - 1].stamp ? 1 : 0;
    const std::size_t all = poses.size();
    sort_by_stamp(&poses);
    repeated_ = all - poses.size();
    if (all > 2 && poses.size() == 1)
      refuse(file_, 0,
             "has the same stamp in all of its {} rows; write times with more digits, or check "
             "which column is the time",
             all);
    if (2 * repeated_ > all)
      refuse(file_, 0, "has only {} different stamps in {} rows: write times with more digits",
             poses.size(), all);
    if (options_.unit || options_.unit_option.empty() || !out_.timed || poses.size() < 3) return;
    std::vector<std::int64_t> steps(poses.size() - 1);
    for (std::size_t i = 0; i < steps.size(); ++i)
      // Halves do not overflow.
      steps[i] = (poses[i + 1].stamp.ns() / 2 - poses[i].stamp.ns() / 2);
    // In s.
    constexpr double kLongest = 10;
    if (const double step = 2e-9 * static_cast<double>(median(std::span(steps))); step > kLongest)
      refuse(file_, 0,
             "has a median interval of {:.6g} when its times are read as seconds; set their unit "
             "with {}",
             step, options_.unit_option);
  }

  void add_remarks() {
    auto& remarks = out_.remarks;
    for (const auto& [count, form] :
         {std::pair{skipped_, "{} rows with NaN or a zero quaternion are skipped"},
          {repeated_, "{} rows that repeat a stamp are dropped"},
          {moved_, "rows are sorted by time, because {} rows went back"}})
      if (count > 0) remarks.push_back(fmt::format(fmt::runtime(form), count));
    if (roughest_ > kRounded)
      remarks.push_back(fmt::format(
          "rotations have few decimals: they deviate from orthonormal by up to {:.1g}", roughest_));
  }

  /// True for NaN and infinity in all spellings, and for an empty field.
  static bool is_no_value(std::string_view field) {
    std::string word = detail::lower(field.substr(0, 12));
    if (word.starts_with('-') || word.starts_with('+')) word.erase(0, 1);
    return word.empty() || word.starts_with("nan") || word == "inf" || word == "infinity" ||
           word == "null" || word == "none" || word == "n/a";
  }

  const fs::path& file_;
  std::string_view text_;
  const TrajectoryOptions& options_;
  Sample sample_;
  Columns columns_;
  TimeForm form_;
  bool euroc_ = false;
  std::size_t rows_ = 0, max_number_ = 0, skipped_ = 0, repeated_ = 0, moved_ = 0;
  double roughest_ = 0;
  TrajectoryFile out_;
};

/// First of these files that exists.
std::optional<fs::path> first_present(std::initializer_list<fs::path> candidates) {
  for (const fs::path& candidate : candidates)
    if (present(candidate)) return candidate.lexically_normal();
  return std::nullopt;
}

/// Assigns times[k] to row k, or to frame k.
void set_times(const fs::path& file, std::span<const Stamp> times, const std::string& times_name,
               TrajectoryFile* trajectory) {
  Trajectory& poses = trajectory->poses;
  if (trajectory->numbered ? trajectory->rows > times.size() : trajectory->rows != times.size())
    refuse(file, 0, "has {} poses, but {} has {} times", trajectory->rows, times_name,
           times.size());
  for (StampedPose& pose : poses)
    pose.stamp = times[static_cast<std::size_t>(pose.stamp.ns() / kRowStep)];
  sort_by_stamp(&poses);
  trajectory->timed = true;
}

TrajectoryFile read_file(const fs::path& path, const TrajectoryOptions& options) {
  std::string text = read_text(path);
  put_decimal_points(&text);
  Reader reader(path, text, options);
  TrajectoryFile out = reader.read();
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (!out.timed && !options.times.empty())
    set_times(path, options.times, "the drive", &out);
  else if (const auto list = first_present(
               {folder / "times.txt", folder / ".." / "sequences" / path.stem() / "times.txt"});
           !out.timed && list) {
    std::vector<Stamp> times;
    for (const TimesLine& line : read_times_file(*list, TimeUnit::seconds).lines)
      times.push_back(line.stamp);
    set_times(path, times, list->string(), &out);
  }
  if (!reader.euroc()) return out;
  if (const auto sensor = first_present(
          {folder / ".." / "cam0" / "sensor.yaml", folder / "cam0" / "sensor.yaml"})) {
    const Transform T_body_left = read_body_mount(*sensor);
    for (StampedPose& pose : out.poses) pose.T_world_body = pose.T_world_body * T_body_left;
  } else {
    out.remarks.emplace_back(
        "this is the ground truth of the body, not of the left camera; put cam0/sensor.yaml of the "
        "data set next to it, or use --estimate-ins-extrinsics");
  }
  return out;
}

}  // namespace

Trajectory read_tum(const fs::path& file) {
  const std::string text = read_text(file);
  const TrajectoryOptions options;
  return Reader(file, text, options).read().poses;
}

std::optional<fs::path> find_truth(const fs::path& folder) {
  // `sequences/06/` with a trailing slash has no file name.
  const fs::path sequence = (folder.has_filename() ? folder : folder.parent_path()).filename();
  for (const fs::path& poses :
       {folder / "poses.txt", folder / ".." / ".." / "poses" / (sequence.string() + ".txt")})
    if (present(poses)) return poses;
  for (const fs::path& mav : {folder / "mav0", folder}) {
    const fs::path csv = mav / "state_groundtruth_estimate0" / "data.csv";
    if (present(csv) && present(mav / "cam0" / "sensor.yaml")) return csv;
  }
  return std::nullopt;
}

TrajectoryFile read_trajectory_file(const fs::path& path, const TrajectoryOptions& options) {
  std::error_code ignored;
  if (!fs::is_directory(path, ignored)) return read_file(path, options);
  if (present(path / "trajectory.tum")) return read_file(path / "trajectory.tum", options);
  const auto truth = find_truth(path);
  if (!truth)
    refuse(path, 0,
           "has no trajectory.tum, no poses.txt (KITTI) and no "
           "mav0/state_groundtruth_estimate0/data.csv with cam0/sensor.yaml (EuRoC)");
  return read_file(*truth, options);
}

}  // namespace vergence::app
