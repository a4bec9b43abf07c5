#include <cmath>
#include <numbers>
#include <system_error>

#include "app/datasets/detail/formats.hpp"
#include "app/datasets/detail/names.hpp"
#include "app/datasets/detail/pairing.hpp"
#include "app/datasets/text_file.hpp"
#include "app/datasets/times_file.hpp"
#include "core/comparison/geodesy.hpp"

namespace vergence::app::detail {
namespace {

std::optional<std::filesystem::path> find_log(const std::filesystem::path& folder,
                                              std::string_view ending) {
  std::error_code error;
  std::vector<std::filesystem::path> found = entries_in(folder, &error);
  if (error) refuse(folder, 0, "cannot be listed ({}): check its permissions", error.message());
  std::erase_if(found, [&](const auto& entry) { return !entry.string().ends_with(ending); });
  if (found.size() > 1)
    refuse(folder, 0, "holds {} files that end in {} ({}, …); use one directory per sequence",
           found.size(), ending, found[0].filename().string());
  return found.empty() ? std::nullopt : std::optional(found[0]);
}

constexpr std::int64_t kMicroseconds = 1'000'000;

constexpr std::string_view kImageLog = "_MultiCamera0.log";

/// Calibration published with the data set, in m: X_right = R X_left + t. Its cameras have no
/// distortion.
RigCalibration published_calibration() {
  RigCalibration rig{.cameras = 2};
  Intrinsics &left = rig.intrinsics[0], &right = rig.intrinsics[1];
  left.width = right.width = 1024, left.height = right.height = 768;
  left.fx = 1246.561673900704, left.fy = 1247.092336797580, left.cx = 532.287936343425,
  left.cy = 383.604069688392;
  right.fx = 1244.805048771648, right.fy = 1245.815687282771, right.cx = 506.635543659909,
  right.cy = 390.704813552426;
  Transform& T = rig.T_camera_left[1];
  T.R << 0.999985020769994, 0.001356661749366, -0.005302612991045, -0.001329315763428,
      0.999985817981778, 0.005157204176297, 0.005309534370930, -0.005150078078314,
      0.999972642396056;
  T.t = {-0.7506666877284111, -0.003857678457065100, 0.0030959446910902};
  rig.baseline = T.t.norm();
  return rig;
}

StereoPair read_pair(const std::filesystem::path& log, std::size_t line_number,
                     std::string_view line, const std::string& images) {
  std::array<std::string_view, 12> f;
  if (split(line, ' ', f) != f.size())
    refuse(log, line_number,
           "is not a line `seconds microseconds width height format` for both cameras with two "
           "image names; check that this is the log of the cameras");
  const auto stamp = read_parts(f[0], f[1], kMicroseconds);
  if (!stamp || !read_parts(f[5], f[6], kMicroseconds))
    refuse(log, line_number, "does not begin with seconds and microseconds below a million");
  // A log names images with or without their directory; all are in one.
  const auto name = [&](std::string_view path) {
    return images + "/" + std::string(path.substr(path.find_last_of('/') + 1));
  };
  return {*stamp, {name(f[10]), name(f[11])}};
}

// ---- the INS

/// `PREFIX_Ins0.log` has twelve fields a line: seconds, microseconds (not padded), latitude and
/// longitude in degrees, height above the ellipsoid and above the sea, velocity along three axes,
/// roll, pitch and yaw in radians. The format does not define the axes, so those are used that
/// agree with the motion of the position. The rows of `to_enu` convert a velocity to east, north,
/// up.
struct Axes {
  const char* phrase;
  std::array<int, 9> to_enu;
};
constexpr std::array kAxes{Axes{"north, west, up", {0, -1, 0, 1, 0, 0, 0, 0, 1}},
                           Axes{"north, east, down", {0, 1, 0, 1, 0, 0, 0, 0, -1}},
                           Axes{"east, north, up", {1, 0, 0, 0, 1, 0, 0, 0, 1}}};
/// Direction and sign of the yaw.
struct Yaw {
  const char* phrase;
  // Direction of a yaw of 0, in rad from east.
  double zero;
  int sign;
};
constexpr std::array kYaws{Yaw{"from north counter-clockwise", std::numbers::pi / 2, 1},
                           Yaw{"a compass heading", std::numbers::pi / 2, -1},
                           Yaw{"from east counter-clockwise", 0, 1}};

/// Axis conventions of a log; by default those of the MTi-G.
struct Conventions {
  Mat3 enu_of_velocity{};
  const char* axes = kAxes[0].phrase;
  Yaw yaw = kYaws[0];
  // True if fields 10 and 11 are pitch and roll.
  bool pitch_first = false;
  bool nose_up_positive = false;
};

Mat3 to_matrix(const Axes& axes) {
  return Eigen::Map<const Eigen::Matrix<int, 3, 3, Eigen::RowMajor>>(axes.to_enu.data())
      .cast<double>();
}

// In m/s. Above this speed the course is the heading.
constexpr double kFast = 5.0;
// Time in s between the positions whose difference gives the motion.
constexpr double kApart = 1.0;
// With fewer samples the axes are not determined.
constexpr std::size_t kEnough = 100;
// Minimum gain of the mean cosine at which the slopes determine the pitch field: those of a path
// with an RMS slope of 0.7°.
constexpr double kMinGain = 3e-4;
// At most one line in this many may be damaged.
constexpr std::size_t kMaxBroken = 100;

/// One line of the log.
struct Line {
  Stamp stamp{};
  Geodetic place{};
  // Fields 6 to 8 and 9 to 11.
  Vec3 velocity, angles;
};

/// A sample and the motion of its position, in ENU axes at the first position.
struct Moving {
  const Line* line = nullptr;
  // In m/s: east, north, up.
  Vec3 motion;
};

bool parse_line(std::string_view text, Line* line) noexcept {
  std::array<std::string_view, 12> f;
  if (split(text, ' ', f) != f.size()) return false;
  const auto stamp = read_parts(f[0], f[1], kMicroseconds);
  std::array<double, 12> v{};
  for (std::size_t i = 2; i < f.size(); ++i)
    if (!parse_number(f[i], &v[i])) return false;
  if (!stamp) return false;
  line->stamp = *stamp;
  line->place = {v[2], v[3], v[4]};
  line->velocity = {v[6], v[7], v[8]};
  line->angles = {v[9], v[10], v[11]};
  return true;
}

std::vector<Line> read_lines(const std::filesystem::path& log, std::vector<std::string>* remarks) {
  const std::string text = read_text(log);
  Lines lines(text);
  std::vector<Line> out;
  std::size_t broken = 0, first_broken = 0;
  for (std::string_view raw; lines.next(&raw);) {
    Line line;
    if (parse_line(raw, &line))
      out.push_back(line);
    else if (broken++ == 0)
      first_broken = lines.number();
  }
  if (out.empty() || broken > 1 + out.size() / kMaxBroken)
    refuse(log, first_broken,
           "and {} more lines are not twelve numbers; check that this is the log of the INS",
           broken > 0 ? broken - 1 : 0);
  if (broken > 0)
    remarks->push_back(fmt::format("{}: {} lines that are not twelve numbers are skipped",
                                   log.filename().string(), broken));
  std::vector<Stamp> stamps;
  for (const Line& line : out) stamps.push_back(line.stamp);
  const std::vector<std::size_t> kept = ascending(stamps);
  if (kept.size() < out.size())
    remarks->push_back(
        fmt::format("{} samples of the INS have stamps that do not increase and are skipped",
                    out.size() - kept.size()));
  for (std::size_t i = 0; i < kept.size(); ++i) out[i] = out[kept[i]];
  out.resize(kept.size());
  return out;
}

/// Swaps the columns if latitude exceeds 90 in all lines.
void check_places(const std::filesystem::path& log, std::vector<Line>* lines,
                  std::vector<std::string>* remarks) {
  const bool exchanged = std::ranges::all_of(
      *lines, [](const Line& l) { return std::abs(l.place.latitude_deg) > 90; });
  for (Line& line : *lines) {
    if (exchanged) std::swap(line.place.latitude_deg, line.place.longitude_deg);
    if (!line.place.plausible())
      refuse(log, 0, "has an invalid position: {} {} {}; check the line", line.place.latitude_deg,
             line.place.longitude_deg, line.place.height_m);
  }
  if (exchanged) remarks->push_back("longitude stands before latitude in the log of the INS");
}

std::vector<Moving> motions(const std::vector<Line>& lines) {
  const LocalTangentPlane plane(lines.front().place);
  std::vector<Vec3> places;
  places.reserve(lines.size());
  for (const Line& line : lines) places.push_back(plane.to_enu(line.place));
  std::vector<Moving> out;
  std::size_t before = 0, after = 0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    while ((lines[i].stamp - lines[before].stamp).to_seconds() > kApart / 2) ++before;
    while (after + 1 < lines.size() &&
           (lines[after].stamp - lines[i].stamp).to_seconds() < kApart / 2)
      ++after;
    const double span = (lines[after].stamp - lines[before].stamp).to_seconds();
    if (span > 0.9 * kApart && span < 1.5 * kApart)
      out.push_back({&lines[i], (places[after] - places[before]) / span});
  }
  return out;
}

Mat3 attitude(const Line& line, const Conventions& c) {
  const double roll = line.angles[c.pitch_first ? 1 : 0],
               pitch = line.angles[c.pitch_first ? 0 : 1];
  return exp_so3(Vec3(0, 0, c.yaw.zero + c.yaw.sign * line.angles.z())) *
         exp_so3(Vec3(0, c.nose_up_positive ? -pitch : pitch, 0)) * exp_so3(Vec3(roll, 0, 0));
}

/// Selects the angles whose forward axis agrees best with the velocity. The mean cosine is used,
/// because the vehicle may also drive backwards. On a level path the pitch is that of the MTi-G.
void decide_angles(const std::vector<Moving>& fast, Conventions* c) {
  double most = -2;
  Conventions best = *c;
  for (const Yaw& yaw : kYaws)
    for (const bool pitch_first : {false, true})
      for (const bool nose_up_positive : {false, true}) {
        const Conventions next{c->enu_of_velocity, c->axes, yaw, pitch_first, nose_up_positive};
        double sum = 0;
        for (const Moving& m : fast)
          sum += attitude(*m.line, next)
                     .col(0)
                     .dot((c->enu_of_velocity * m.line->velocity).normalized());
        const double mean = sum / static_cast<double>(fast.size());
        if (mean > most + kMinGain) most = mean, best = next;
      }
  *c = best;
}

Conventions decide(const std::vector<Line>& lines, std::vector<std::string>* remarks) {
  Conventions c{.enu_of_velocity = to_matrix(kAxes[0])};
  const std::vector<Moving> moving = motions(lines);
  std::vector<Moving> fast;
  for (const Moving& m : moving)
    if (m.motion.head<2>().norm() > kFast) fast.push_back(m);
  if (fast.size() < kEnough) {
    remarks->push_back(
        "the sequence is too slow or too short to determine the INS's axes: north, west, up and "
        "yaw from north counter-clockwise are assumed");
    return c;
  }
  // The velocity axes that agree best with the motion of the position.
  double least = 1e300;
  for (const Axes& axes : kAxes) {
    const Mat3 to_enu = to_matrix(axes);
    double sum = 0;
    for (const Moving& m : moving)
      sum += (to_enu * m.line->velocity - m.motion).head<2>().squaredNorm();
    if (sum < least) least = sum, c.enu_of_velocity = to_enu, c.axes = axes.phrase;
  }
  decide_angles(fast, &c);
  remarks->push_back(fmt::format(
      "the INS's velocity is along {}, its yaw {}, its pitch field {}, {} with the nose up", c.axes,
      c.yaw.phrase, c.pitch_first ? 10 : 11, c.nose_up_positive ? "positive" : "negative"));
  return c;
}

InsSample to_sample(const Line& line, const Conventions& c, std::uint64_t number) {
  InsSample s{.number = number, .stamp = line.stamp, .fix = FixStatus::fix_3d};
  s.attitude_valid = s.velocity_valid = true;
  s.position = line.place;
  const Vec3 v = c.enu_of_velocity * line.velocity;
  s.velocity_enu = {v.x(), v.y(), v.z()};
  const Eigen::Quaterniond q = quaternion(attitude(line, c));
  s.q_enu_ins = {q.x(), q.y(), q.z(), q.w()};
  return s;
}

}  // namespace

StereoSequence open_st_lucia(const std::filesystem::path& folder, bool given) {
  const auto found = find_log(folder, kImageLog);
  if (!found)
    refuse(folder, 0,
           "holds no file that ends in " + std::string(kImageLog) +
               "; check that this is a directory of this data set");
  const std::filesystem::path& log = *found;
  const std::string images = log.stem().string();
  require_folder(folder / images, "the images that its log names");
  StereoSequence sequence{.root = folder, .bayer = true};
  const std::string text = read_text(log);
  Lines lines(text);
  for (std::string_view line; lines.next(&line);)
    // The header names no image.
    if (line.find(".bmp") != std::string_view::npos)
      sequence.pairs.push_back(read_pair(log, lines.number(), line, images));
  if (sequence.pairs.empty()) refuse(log, 0, "names no images; check that this is the right file");
  if (given) return sequence;
  sequence.calibration = published_calibration();
  sequence.calibration_source = "the calibration published with the data set";
  return sequence;
}

RecordedIns read_st_lucia_ins(const std::filesystem::path& folder) {
  RecordedIns ins;
  const auto found = find_log(folder, "_Ins0.log");
  if (!found) {
    ins.remarks.push_back(
        folder.string() +
        ": holds no file that ends in _Ins0.log; poses are not compared with an INS");
    return ins;
  }
  std::vector<Line> lines = read_lines(*found, &ins.remarks);
  check_places(*found, &lines, &ins.remarks);
  const Conventions conventions = decide(lines, &ins.remarks);
  ins.readings.reserve(lines.size());
  for (const Line& line : lines) {
    InsRecord reading{.sample = to_sample(line, conventions, ins.readings.size())};
    // The log has no other quality data.
    reading.quality.filter_valid = true;
    ins.readings.push_back(reading);
  }
  return ins;
}

}  // namespace vergence::app::detail
