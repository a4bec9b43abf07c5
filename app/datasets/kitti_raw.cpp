#include <cmath>
#include <ranges>

#include "app/datasets/detail/formats.hpp"
#include "app/datasets/detail/names.hpp"
#include "app/datasets/detail/pairing.hpp"
#include "app/datasets/text_file.hpp"
#include "app/datasets/times_file.hpp"
#include "core/math/angle.hpp"
#include "core/math/so3.hpp"

namespace vergence::app::detail {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFields = 30;

/// Used columns of a packet; order and units are those of the development kit (dataformat.txt).
enum Column : std::size_t {
  // In degrees.
  latitude,
  longitude,
  // In m.
  altitude,
  // In rad, positive with the left side up.
  roll,
  // In rad, positive with the front down.
  pitch,
  // In rad from east, counter-clockwise.
  yaw,
  // In m/s.
  to_north,
  to_east,
  // In m/s, perpendicular to the ellipsoid.
  upward = 10,
  // In m, north and east.
  position_accuracy = 23,
  // In m/s, north and east.
  velocity_accuracy = 24,
  navigation_status = 25,
  satellites = 26,
  position_mode = 27,
};

// Specified accuracy of the unit, an RT3003 with two antennas, because packets have only the
// accuracies of position and velocity.
constexpr double kTiltSigma = 0.03 * kRadiansPerDegree, kHeadingSigma = 0.1 * kRadiansPerDegree;
// Heights of a receiver are less accurate than its horizontal position by about this factor.
constexpr double kHeightOverPlace = 2;

// Navigation status of a unit with valid data; lower values mean that it is starting.
constexpr int kLocked = 4;

/// Position modes of the unit's protocol (NCOM): 3 single point, 4 differential, 5 and 6 real-time
/// kinematic, 7 to 9 and 13 to 18 further corrections. 0 none, 1 searching, 2 and 12 Doppler alone,
/// 10 no data, 11 blanked: carried on by inertia.
bool has_position(int mode) noexcept { return (mode >= 3 && mode <= 9) || mode >= 13; }

int whole(double v) noexcept { return std::abs(v) < 1e6 ? static_cast<int>(std::lround(v)) : -1; }

/// Returns nothing for missing numbers or an invalid position.
std::optional<InsRecord> parse_packet(std::string_view text) noexcept {
  std::array<std::string_view, kFields> fields;
  Lines lines(text);
  std::string_view line;
  if (!lines.next(&line) || split(line, ' ', fields) != kFields) return std::nullopt;
  std::array<double, kFields> v{};
  for (std::size_t i = 0; i < kFields; ++i)
    if (!parse_number(fields[i], &v[i])) return std::nullopt;
  InsRecord r;
  InsSample& s = r.sample;
  s.position = {v[latitude], v[longitude], v[altitude]};
  const double largest = std::max({std::abs(v[roll]), std::abs(v[pitch]), std::abs(v[yaw])});
  if (!s.position.plausible() || largest > 3 * std::numbers::pi)
    // These are degrees, or other columns.
    return std::nullopt;
  const int used = whole(v[satellites]), status = whole(v[navigation_status]),
            mode = whole(v[position_mode]);
  s.fix = status != kLocked                 ? FixStatus::none
          : has_position(mode) && used != 0 ? FixStatus::fix_3d
                                            : FixStatus::dead_reckoning;
  s.attitude_valid = s.velocity_valid = status == kLocked;
  s.velocity_enu = {v[to_east], v[to_north], v[upward]};
  const Mat3 R =
      exp_so3(Vec3(0, 0, v[yaw])) * exp_so3(Vec3(0, v[pitch], 0)) * exp_so3(Vec3(v[roll], 0, 0));
  const Eigen::Quaterniond q = quaternion(R);
  s.q_enu_ins = {q.x(), q.y(), q.z(), q.w()};
  s.position_sigma = std::max(0.0, v[position_accuracy]);
  s.height_sigma = kHeightOverPlace * s.position_sigma;
  s.velocity_sigma = std::max(0.0, v[velocity_accuracy]);
  s.tilt_sigma = kTiltSigma;
  s.heading_sigma = kHeadingSigma;
  r.quality.status = static_cast<std::uint32_t>(std::clamp(status, 0, 255)) << 8U |
                     static_cast<std::uint32_t>(std::clamp(mode, 0, 255));
  r.quality.satellites = static_cast<std::uint8_t>(std::clamp(used, 0, 255));
  r.quality.filter_valid = status == kLocked;
  return r;
}

/// Packets of the lines of timestamps.txt, and the skipped ones: missing, or not of 30 numbers.
struct Packets {
  std::vector<InsRecord> readings{};
  std::vector<Stamp> stamps{};
  std::size_t missing = 0, broken = 0;
  std::string first_missing{}, first_broken{};
};

Packets read_packets(const fs::path& data, const std::vector<TimesLine>& lines) {
  Packets out;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::string name = fmt::format("{:010d}.txt", i);
    std::error_code ignored;
    if (!fs::is_regular_file(data / name, ignored)) {
      if (out.missing++ == 0) out.first_missing = name;
      continue;
    }
    auto reading = parse_packet(read_text(data / name));
    if (!reading && out.broken++ == 0) out.first_broken = name;
    if (!reading) continue;
    reading->sample.stamp = lines[i].stamp;
    reading->sample.number = i;
    out.readings.push_back(*reading);
    out.stamps.push_back(lines[i].stamp);
  }
  return out;
}

void add_remarks(const Packets& packets, std::size_t disordered, RecordedIns* ins) {
  const auto add_remark = [ins](std::size_t n, const std::string& what) {
    if (n > 0) ins->remarks.push_back(fmt::format("oxts: {} {}", n, what));
  };
  add_remark(packets.missing, "packets are missing; the first is " + packets.first_missing);
  add_remark(packets.broken,
             fmt::format("packets do not have {} numbers and are skipped; the first is {}", kFields,
                         packets.first_broken));
  add_remark(disordered, "stamps do not increase; their packets are skipped");
  const auto without = std::ranges::count_if(
      ins->readings, [](const InsRecord& r) { return r.sample.fix != FixStatus::fix_3d; });
  add_remark(static_cast<std::size_t>(without),
             fmt::format("of {} packets have no satellite fix: poses are not compared there",
                         ins->readings.size()));
}

/// True for a directory with a camera's images and their list, or with the INS's packets.
bool is_drive(const fs::path& folder) {
  for (int camera = 0; camera < 4; ++camera)
    if (present(folder / fmt::format("image_{:02d}/timestamps.txt", camera))) return true;
  std::error_code ignored;
  return fs::is_directory(folder / "oxts", ignored);
}

/// Drives in the directory: itself, or one or two levels below.
std::vector<fs::path> drives_in(const fs::path& folder) {
  if (is_drive(folder)) return {folder};
  // Maximum number of searched directories.
  constexpr std::size_t kMaxFolders = 1000;
  std::vector<fs::path> found;
  std::size_t looked = 0;
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error)) {
    std::error_code ignored;
    if (!it->is_directory(ignored) || ++looked > kMaxFolders) continue;
    const bool drive = is_drive(it->path());
    if (drive) found.push_back(it->path());
    if (drive || it.depth() > 0) it.disable_recursion_pending();
  }
  if (error) refuse(folder, 0, "cannot be listed (" + error.message() + "): check its permissions");
  return found;
}

}  // namespace

bool holds_kitti_raw(const fs::path& folder) { return !drives_in(folder).empty(); }

KittiRawFolders find_kitti_raw(const fs::path& folder) {
  std::vector<fs::path> found = drives_in(folder);
  if (found.empty())
    refuse(folder, 0,
           "is not a KITTI raw drive; a directory with image_00, image_01 and oxts is expected");
  if (found.size() > 1) {
    constexpr std::size_t kMaxNamed = 8;
    std::ranges::sort(found);
    std::vector<std::string> names;
    for (const fs::path& drive : found | std::views::take(kMaxNamed))
      names.push_back(drive.filename().string());
    refuse(folder, 0, "holds {} drives ({}{}); name one of them", found.size(),
           fmt::join(names, ", "), found.size() > kMaxNamed ? ", …" : "");
  }
  std::error_code ignored;
  // `.` and a name that ends in a slash also have a parent directory.
  fs::path lexical = fs::absolute(found[0], ignored).lexically_normal();
  if (!lexical.has_filename()) lexical = lexical.parent_path();
  KittiRawFolders out{found[0], lexical.parent_path()};
  // A drive may be a symbolic link, with its calibration next to the link or next to its target.
  for (const fs::path& other : {out.drive, fs::weakly_canonical(out.drive, ignored).parent_path()})
    if (!present(out.calibration / kKittiRawCalibration) && present(other / kKittiRawCalibration))
      out.calibration = other;
  return out;
}

RecordedIns read_oxts(const fs::path& folder, const std::array<int, 2>& cameras,
                      bool mount_wanted) {
  const KittiRawFolders folders = find_kitti_raw(folder);
  RecordedIns ins;
  const fs::path oxts = folders.drive / "oxts", data = oxts / "data";
  if (!present(oxts)) {
    ins.remarks.push_back(oxts.string() + ": does not exist; poses are not compared with an INS");
    return ins;
  }
  require_folder(data, "OXTS packets");
  const Packets packets = read_packets(data, read_times_file(oxts / "timestamps.txt").lines);
  if (packets.readings.empty())
    refuse(data / (packets.broken > 0 ? packets.first_broken : packets.first_missing), 0,
           "{}, like every other packet; {} numbers per packet are expected",
           packets.broken > 0 ? "is not an OXTS packet" : "is missing", kFields);
  const std::vector<std::size_t> kept = ascending(packets.stamps);
  for (const std::size_t i : kept) ins.readings.push_back(packets.readings[i]);
  add_remarks(packets, packets.readings.size() - kept.size(), &ins);
  if (!mount_wanted) return ins;

  const StereoSequence images = open_kitti_raw(folder, true, cameras);
  const KittiRawRig rig = read_kitti_raw_rig(folders, cameras, first_image_size(images, 0));
  ins.T_ins_left = (rig.T_left_camera0 * read_kitti_raw_mount(folders)).inverse();
  ins.mount_source = "calib_imu_to_velo.txt, calib_velo_to_cam.txt and calib_cam_to_cam.txt";
  return ins;
}

}  // namespace vergence::app::detail
