#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <string_view>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "app/datasets/decimal.hpp"
#include "app/datasets/text_file.hpp"
#include "app/report/csv.hpp"
#include "app/report/detail/session_parts.hpp"

/// poses.csv and trajectories of a session.
namespace vergence::app::report {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostReasons = 64;
constexpr double kFarthest = 1e7;  // m: beyond, a coordinate is damage and would flatten every plot

/// Index of a word among an enum's words, the first `count` of them.
template <class Enum>
std::optional<Enum> word_to_enum(std::string_view word, int count) {
  for (int i = 0; i < count; ++i)
    if (to_string(static_cast<Enum>(i)) == word) return static_cast<Enum>(i);
  return std::nullopt;
}

std::uint16_t reason_index(std::string_view word, Session* session) {
  const auto found = std::find(session->reasons.begin(), session->reasons.end(), word);
  if (found != session->reasons.end())
    return static_cast<std::uint16_t>(found - session->reasons.begin());
  if (session->reasons.size() >= kMostReasons) return 0;
  session->reasons.emplace_back(word.substr(0, kLongestText));
  return static_cast<std::uint16_t>(session->reasons.size() - 1);
}

bool near_enough(std::span<const double> numbers) {
  return std::all_of(numbers.begin(), numbers.end(),
                     [](double v) { return std::abs(v) <= kFarthest; });
}

/// The columns of poses.csv that the page needs.
class PoseColumns {
 public:
  explicit PoseColumns(const CsvRows& rows) {
    const auto find = [&rows](const char* name) { return rows.column(name); };
    stamp_ = find("stamp_ns"), frame_ = find("frame"), state_ = find("state"),
    status_ = find("status"), reason_ = find("reason");
    inliers_ = find("inliers"), estimate_ms_ = find("estimate_ms"),
    error_heading_ = find("error_heading_deg");
    world_ = {find("x"), find("y"), find("z"), find("qx"), find("qy"), find("qz"), find("qw")};
    enu_ = {find("east"), find("north"), find("up")};
    ins_ = {find("ins_east"), find("ins_north"), find("ins_up")};
    error_ = {find("error_east_m"), find("error_north_m"), find("error_up_m")};
  }

  /// Nothing: the row has no stamp.
  [[nodiscard]] std::optional<Frame> read(const CsvRows& rows, Session* session) const {
    const auto stamp = rows.integer(stamp_);
    if (!stamp) return std::nullopt;
    Frame f;
    f.stamp = Stamp(*stamp);
    f.number = rows.integer(frame_).value_or(-1);
    f.state = word_to_enum<State>(rows.text(state_), 6);
    f.status = word_to_enum<PoseStatus>(rows.text(status_), 3);
    f.reason = reason_index(rows.text(reason_), session);
    std::array<double, 7> world{};
    f.posed = numbers(rows, world_, &world) && f.status != PoseStatus::lost &&
              set_pose(world, &f.T_world_left);
    f.placed = numbers(rows, enu_, &f.enu);
    f.has_ins = numbers(rows, ins_, &f.ins);
    f.compared = numbers(rows, error_, &f.error);
    f.error_heading_deg = rows.number(error_heading_).value_or(kNone);
    f.inliers = static_cast<int>(std::clamp(rows.number(inliers_).value_or(-1.0), -1.0, 1e6));
    f.estimate_ms = rows.number(estimate_ms_).value_or(kNone);
    return f;
  }

  [[nodiscard]] static bool set_pose(const std::array<double, 7>& v, Transform* T) {
    const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
    if (!near_enough(v) || !(q.norm() > 0.5) || !(q.norm() < 2.0)) return false;
    *T = {q.normalized().toRotationMatrix(), Vec3(v[0], v[1], v[2])};
    return true;
  }

 private:
  using Column = std::optional<std::size_t>;
  template <std::size_t N>
  [[nodiscard]] static bool numbers(const CsvRows& rows, const std::array<Column, N>& columns,
                                    std::array<double, N>* out) {
    std::array<double, N> values{};
    for (std::size_t i = 0; i < N; ++i) {
      const auto v = rows.number(columns[i]);
      if (!v) return false;
      values[i] = *v;
    }
    if (!near_enough(values)) return false;
    *out = values;
    return true;
  }

  Column stamp_, frame_, state_, status_, reason_, inliers_, estimate_ms_, error_heading_;
  std::array<Column, 7> world_;
  std::array<Column, 3> enu_, ins_, error_;
};

std::optional<StampedPose> tum_pose(std::string_view line) {
  std::array<std::string_view, 8> fields;
  if (split(line, ' ', fields) != fields.size()) return std::nullopt;
  const auto stamp = parse_seconds_ns(fields[0]);
  std::array<double, 7> v{};
  StampedPose pose;
  for (std::size_t i = 0; i < v.size(); ++i)
    if (!parse_number(fields[i + 1], &v[i])) return std::nullopt;
  if (!stamp || !PoseColumns::set_pose(v, &pose.T_world_body)) return std::nullopt;
  pose.stamp = Stamp(*stamp);
  return pose;
}

}  // namespace

bool read_poses(const fs::path& folder, std::size_t most, Session* session) {
  auto lines = open_part(folder / "poses.csv",
                         "status, inliers and times of the frames are not known", session);
  if (!lines) return false;
  CsvRows rows([&lines](std::string_view* line) { return lines->next(line); });
  if (!rows.column("stamp_ns")) {
    session->missing.emplace_back(
        "poses.csv has no head that names its columns: status, inliers and times of the frames are "
        "not known");
    return false;
  }
  const PoseColumns columns(rows);
  constexpr std::uintmax_t kLine = 200;  // bytes, about
  std::error_code error;
  if (const auto size = fs::file_size(folder / "poses.csv", error); !error)
    session->frames.reserve(std::min(most, static_cast<std::size_t>(size / kLine)));
  std::size_t unreadable = 0, disordered = 0;
  while (rows.next()) {
    if (session->frames.size() == most) {
      leave_out("poses.csv", most, session);
      break;
    }
    const auto frame = columns.read(rows, session);
    if (!frame)
      ++unreadable;
    else if (!session->frames.empty() && frame->stamp <= session->frames.back().stamp)
      ++disordered;
    else
      session->frames.push_back(*frame);
  }
  report_damage("poses.csv", *lines, rows.torn_rows() + unreadable, disordered, session);
  return true;
}

std::vector<StampedPose> read_trajectory_part(const fs::path& folder, const char* name,
                                              const char* consequence, std::size_t most,
                                              Session* session) {
  std::vector<StampedPose> poses;
  auto lines = open_part(folder / name, consequence, session);
  if (!lines) return poses;
  std::size_t damaged = 0, disordered = 0;
  for (std::string_view line; lines->next(&line);) {
    if (poses.size() == most) {
      leave_out(name, most, session);
      break;
    }
    const auto pose = tum_pose(line);
    if (!pose)
      ++damaged;
    else if (!poses.empty() && pose->stamp <= poses.back().stamp)
      ++disordered;
    else
      poses.push_back(*pose);
  }
  report_damage(name, *lines, damaged, disordered, session);
  return poses;
}

void frames_from_trajectory(const fs::path& folder, std::size_t most, Session* session) {
  for (const StampedPose& p :
       read_trajectory_part(folder, "trajectory.tum", "there is no trajectory", most, session)) {
    Frame f;
    f.stamp = p.stamp;
    f.posed = true;
    f.T_world_left = p.T_world_body;
    session->frames.push_back(f);
  }
}

}  // namespace vergence::app::report
