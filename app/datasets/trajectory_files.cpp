#include "app/datasets/trajectory_files.hpp"

#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <system_error>

#include "app/datasets/decimal.hpp"
#include "app/datasets/euroc_sensor.hpp"
#include "app/datasets/text_file.hpp"

namespace vergence::app {
namespace {

namespace fs = std::filesystem;

// Two decimals of a quaternion already keep its length within this; columns that are no quaternion
// rarely do.
constexpr double kQuaternionLength = 0.02;

bool present(const fs::path& p) {
  std::error_code ignored;
  return fs::exists(p, ignored);
}

bool is_folder(const fs::path& p) {
  std::error_code ignored;
  return fs::is_directory(p, ignored);
}

void numbers(const fs::path& file, std::size_t line, std::span<const std::string_view> fields,
             std::span<double> out) {
  for (std::size_t i = 0; i < out.size(); ++i)
    if (!parse_number(fields[i], &out[i]))
      refuse(file, line, "`" + std::string(fields[i].substr(0, 40)) + "` is not a finite number");
}

/// Unit quaternion from w x y z as written.
Mat3 rotation(const fs::path& file, std::size_t line, double w, double x, double y, double z) {
  const Eigen::Quaterniond q(w, x, y, z);
  if (!(std::abs(q.norm() - 1.0) <= kQuaternionLength))
    refuse(file, line,
           "the quaternion has length " + std::to_string(q.norm()) +
               " and not 1: check the order of the columns");
  return q.normalized().toRotationMatrix();
}

/// Appends, keeping stamps ascending.
void append(const fs::path& file, std::size_t line, const StampedPose& pose,
            Trajectory* trajectory) {
  if (!trajectory->empty() && !(trajectory->back().stamp < pose.stamp))
    refuse(file, line,
           "the stamp " + format_seconds(pose.stamp.ns()) +
               " s is not later than the one before: stamps must ascend");
  trajectory->push_back(pose);
}

Trajectory checked(const fs::path& file, Trajectory trajectory) {
  if (trajectory.empty()) refuse(file, 0, "has no pose in it");
  return trajectory;
}

Trajectory parse_tum(const fs::path& file, std::string_view text) {
  constexpr std::size_t kShortestLine = 15;  // bytes of eight numbers
  const auto ends = static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  Trajectory trajectory;
  trajectory.reserve(std::min(ends, text.size() / kShortestLine) + 1);
  Lines lines(text);
  std::string_view line;
  while (lines.next(&line)) {
    const std::size_t n = lines.number();
    std::array<std::string_view, 8> fields;
    const std::size_t count = split(line, ' ', fields);
    if (count != fields.size())
      refuse(file, n,
             "has " + std::to_string(count) +
                 " columns where a pose has 8: stamp tx ty tz qx qy qz qw");
    const auto ns = parse_seconds_ns(fields[0]);
    if (!ns)
      refuse(file, n, "`" + std::string(fields[0].substr(0, 40)) + "` is not a stamp in seconds");
    std::array<double, 7> v{};
    numbers(file, n, std::span(fields).subspan(1), v);
    append(file, n, {Stamp(*ns), {rotation(file, n, v[6], v[3], v[4], v[5]), {v[0], v[1], v[2]}}},
           &trajectory);
  }
  return checked(file, std::move(trajectory));
}

std::vector<Stamp> read_times(const fs::path& file) {
  const std::string text = read_text(file);
  std::vector<Stamp> times;
  Lines lines(text);
  std::string_view line;
  while (lines.next(&line)) {
    const auto ns = parse_seconds_ns(line);
    if (!ns)
      refuse(file, lines.number(),
             "`" + std::string(line.substr(0, 40)) + "` is not a time in seconds");
    if (!times.empty() && !(times.back() < Stamp(*ns)))
      refuse(file, lines.number(), "the time is not later than the one before: times must ascend");
    times.push_back(Stamp(*ns));
  }
  return times;
}

/// Row k of the text at times[k]. Rows whose time is not later than all before are left out.
Trajectory parse_kitti(const fs::path& file, std::string_view text, std::span<const Stamp> times,
                       const std::string& times_name) {
  Trajectory trajectory;
  std::size_t rows = 0;
  Lines lines(text);
  std::string_view line;
  while (lines.next(&line)) {
    const std::size_t n = lines.number();
    std::array<std::string_view, 12> fields;
    const std::size_t count = split(line, ' ', fields);
    if (count != fields.size())
      refuse(
          file, n,
          "has " + std::to_string(count) + " numbers where a pose has 12: a 3x4 matrix row by row");
    if (rows == times.size())
      refuse(file, n,
             "is pose " + std::to_string(times.size() + 1) + ", but " + times_name + " has only " +
                 std::to_string(times.size()) + " times");
    std::array<double, 12> v{};
    numbers(file, n, fields, v);
    Mat3 written;
    written << v[0], v[1], v[2], v[4], v[5], v[6], v[8], v[9], v[10];
    Transform T;
    T.t = {v[3], v[7], v[11]};
    if (!accept_rotation(written, &T.R))
      refuse(file, n,
             "the matrix is not a rotation: it is off orthonormal by more than 1e-4, or it is a "
             "reflection");
    const Stamp stamp = times[rows++];
    if (trajectory.empty() || trajectory.back().stamp < stamp) trajectory.push_back({stamp, T});
  }
  if (rows != times.size())
    refuse(file, 0,
           "has " + std::to_string(rows) + " poses, but " + times_name + " has " +
               std::to_string(times.size()) + " times");
  return checked(file, std::move(trajectory));
}

Trajectory parse_kitti(const fs::path& file, std::string_view text, const fs::path& times_file) {
  return parse_kitti(file, text, read_times(times_file), times_file.string());
}

Trajectory parse_euroc(const fs::path& file, std::string_view text, const fs::path& camera_yaml) {
  const Transform T_body_left = read_sensor_mount(camera_yaml);
  Trajectory trajectory;
  Lines lines(text);
  std::string_view line;
  while (lines.next(&line)) {
    const std::size_t n = lines.number();
    std::array<std::string_view, 8> fields;
    const std::size_t count = split(line, ',', fields);
    if (count < fields.size())
      refuse(file, n,
             "has " + std::to_string(count) +
                 " columns where a pose has 8 or more: stamp px py pz qw qx qy qz …");
    const auto ns = parse_integer(fields[0]);
    if (!ns)
      refuse(file, n,
             "`" + std::string(fields[0].substr(0, 40)) + "` is not a stamp in whole nanoseconds");
    std::array<double, 7> v{};
    numbers(file, n, std::span(fields).subspan(1), v);
    const Transform T_world_body{rotation(file, n, v[3], v[4], v[5], v[6]), {v[0], v[1], v[2]}};
    append(file, n, {Stamp(*ns), T_world_body * T_body_left}, &trajectory);
  }
  return checked(file, std::move(trajectory));
}

fs::path folder_of(const fs::path& file) {
  return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

/// The times of a KITTI truth file: beside it, or, in the benchmark's tree, at sequences/NN for
/// poses/NN.txt.
fs::path times_beside(const fs::path& poses) {
  const fs::path folder = folder_of(poses);
  for (const fs::path& candidate :
       {folder / "times.txt", folder / ".." / "sequences" / poses.stem() / "times.txt"})
    if (present(candidate)) return candidate;
  refuse(poses, 0,
         "holds KITTI poses, which carry no stamps: put the sequence's times.txt beside it");
}

/// The left camera's sensor.yaml of an EuRoC truth file.
fs::path camera_beside(const fs::path& csv) {
  const fs::path folder = folder_of(csv);
  for (const fs::path& candidate :
       {folder / ".." / "cam0" / "sensor.yaml", folder / "cam0" / "sensor.yaml"})
    if (present(candidate)) return candidate.lexically_normal();
  refuse(csv, 0,
         "holds the truth of the body: put cam0/sensor.yaml of the data set beside it, it tells "
         "where the left camera is");
}

}  // namespace

Trajectory read_tum(const fs::path& file) { return parse_tum(file, read_text(file)); }

Trajectory read_kitti(const fs::path& poses_file, const fs::path& times_file) {
  return parse_kitti(poses_file, read_text(poses_file), times_file);
}

Trajectory read_kitti(const fs::path& poses_file, std::span<const Stamp> times) {
  return parse_kitti(poses_file, read_text(poses_file), times, "the drive");
}

Trajectory read_euroc(const fs::path& csv_file, const fs::path& camera_yaml) {
  return parse_euroc(csv_file, read_text(csv_file), camera_yaml);
}

std::optional<TruthFiles> find_truth(const fs::path& folder) {
  // `sequences/06/` with a slash at its end has no name of its own.
  const fs::path sequence = (folder.has_filename() ? folder : folder.parent_path()).filename();
  for (const fs::path& poses :
       {folder / "poses.txt", folder / ".." / ".." / "poses" / (sequence.string() + ".txt")})
    if (present(poses) && present(folder / "times.txt"))
      return TruthFiles{TruthFiles::Kind::kitti, poses, folder / "times.txt"};
  for (const fs::path& mav : {folder / "mav0", folder}) {
    const fs::path csv = mav / "state_groundtruth_estimate0" / "data.csv",
                   camera = mav / "cam0" / "sensor.yaml";
    if (present(csv) && present(camera)) return TruthFiles{TruthFiles::Kind::euroc, csv, camera};
  }
  return std::nullopt;
}

Trajectory read_truth(const TruthFiles& files) {
  return files.kind == TruthFiles::Kind::kitti ? read_kitti(files.poses, files.second)
                                               : read_euroc(files.poses, files.second);
}

Trajectory read_trajectory(const fs::path& path) {
  if (is_folder(path)) {
    if (present(path / "trajectory.tum")) return read_tum(path / "trajectory.tum");
    const auto truth = find_truth(path);
    if (!truth)
      refuse(path, 0,
             "has no trajectory.tum, no poses.txt with times.txt (KITTI) and no "
             "mav0/state_groundtruth_estimate0/data.csv with "
             "cam0/sensor.yaml (EuRoC)");
    return read_truth(*truth);
  }
  const std::string text = read_text(path);
  Lines lines(text);
  std::string_view line;
  if (!lines.next(&line)) refuse(path, 0, "has no pose in it");
  if (line.find(',') != std::string_view::npos) return parse_euroc(path, text, camera_beside(path));
  std::array<std::string_view, 1> first;
  constexpr std::size_t kKittiNumbers = 12;
  if (split(line, ' ', first) == kKittiNumbers) return parse_kitti(path, text, times_beside(path));
  return parse_tum(path, text);
}

}  // namespace vergence::app
