#include <algorithm>
#include <array>
#include <system_error>

#include <fmt/format.h>

#include "app/datasets/decimal.hpp"
#include "app/datasets/detail/ascending.hpp"
#include "app/datasets/detail/formats.hpp"
#include "app/datasets/detail/kitti_raw.hpp"
#include "app/datasets/text_file.hpp"

namespace vergence::app::detail {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCalibration = "calib_cam_to_cam.txt";
constexpr std::size_t kMostDrives = 8;      // that are named in a refusal
constexpr std::size_t kMostFolders = 1000;  // that are looked into for a drive
// Cameras expose together; their stamps are of the arrival and up to some milliseconds apart. A
// quarter of the interval is far from both neighbours.
constexpr double kTogether = 0.25;
constexpr std::size_t kLook = 48;  // frames that one camera may lack in a row where the other goes
                                   // on, and pairing by stamps still finds on

bool is_drive(const fs::path& folder) {
  std::error_code ignored;
  for (int camera = 0; camera < 4; ++camera)
    if (fs::is_directory(folder / kitti_raw_camera(camera), ignored)) return true;
  return false;
}

void find_drives(const fs::path& folder, int depth, std::vector<fs::path>* found,
                 std::size_t* looked) {
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    std::error_code ignored;
    if (!it->is_directory(ignored) || ++*looked > kMostFolders) continue;
    if (is_drive(it->path()))
      found->push_back(it->path());
    else if (depth > 1)
      for (fs::directory_iterator below(it->path(), ignored), none; !ignored && below != none;
           below.increment(ignored))
        if (++*looked <= kMostFolders && is_drive(below->path())) found->push_back(below->path());
  }
  if (error) refuse(folder, 0, "cannot be listed (" + error.message() + "): check its permissions");
}

/// The folder itself, or what lies one or two folders below.
std::vector<fs::path> drives_in(const fs::path& folder) {
  if (is_drive(folder)) return {folder};
  std::vector<fs::path> found;
  std::size_t looked = 0;
  find_drives(folder, 2, &found, &looked);
  return found;
}

/// The images of one camera that have a stamp, in the order of their names.
struct CameraFiles {
  std::vector<Stamp> stamps{};
  std::vector<std::size_t> index{};  // of the file, NNNNNNNNNN.png
  std::string extension{};           // of the images, with its dot
  std::size_t without_stamp = 0;     // images
};

CameraFiles list_camera(const fs::path& drive, int camera, std::vector<std::string>* remarks) {
  const std::string name = kitti_raw_camera(camera);
  require_folder(drive / name, "data/ and timestamps.txt of a camera");
  const KittiStamps stamps = read_kitti_stamps(drive / name / "timestamps.txt");
  CameraFiles out;
  std::size_t end = 0, odd = 0;  // one past the last image
  std::vector<bool> there(stamps.lines.size(), false);
  for (const std::string& image : list_images(drive, name + "/data")) {
    const fs::path file(image);
    const auto index = parse_integer(file.stem().string());
    if (!index || *index < 0) {
      ++odd;
      continue;
    }
    if (out.extension.empty()) out.extension = file.extension().string();
    const auto i = static_cast<std::size_t>(*index);
    if (i < there.size()) there[i] = true;
    if (i >= there.size() || !stamps.lines[i]) ++out.without_stamp;
    if (i < there.size()) end = std::max(end, i + 1);
  }
  for (std::size_t i = 0; i < end; ++i) {
    if (!stamps.lines[i]) continue;
    out.stamps.push_back(
        *stamps.lines[i]);  // an image that is missing is missed when its frame comes
    out.index.push_back(i);
  }
  if (out.stamps.empty())
    refuse(drive / name, 0, "has no image that a line of its timestamps.txt is of");
  if (odd > 0)
    remarks->push_back(
        fmt::format("{}: {} images that are not named by their number are left out", name, odd));
  if (out.without_stamp > 0)
    remarks->push_back(fmt::format(
        "{}: {} images have no stamp and are left out: timestamps.txt has {} lines, {} of them "
        "broken{}",
        name, out.without_stamp, stamps.lines.size(), stamps.broken,
        stamps.broken > 0 ? fmt::format(", the first is line {}", stamps.first_broken) : ""));
  if (end < stamps.lines.size())
    remarks->push_back(fmt::format("{}: timestamps.txt goes on for {} lines after the last image",
                                   name, stamps.lines.size() - end));
  return out;
}

Duration usual_interval(const std::vector<Stamp>& stamps) {
  std::vector<std::int64_t> ns;
  for (std::size_t i = 1; i < stamps.size(); ++i)
    if (stamps[i] > stamps[i - 1]) ns.push_back((stamps[i] - stamps[i - 1]).ns());
  if (ns.empty()) return Duration::milliseconds(100);
  const auto middle = ns.begin() + static_cast<std::ptrdiff_t>(ns.size() / 2);
  std::nth_element(ns.begin(), middle, ns.end());
  return Duration::nanoseconds(*middle);
}

struct Pairing {
  std::vector<std::array<std::size_t, 2>> pairs{};  // places in CameraFiles
  std::array<std::size_t, 2> alone{};               // images without a partner
  Duration farthest{};                              // stamps of a pair apart
};

Duration apart(Stamp a, Stamp b) { return a < b ? b - a : a - b; }

/// How many of both to pass over until two belong together again, the fewest first. False: not
/// within kLook.
bool find_on(const std::array<const CameraFiles*, 2>& c, std::array<std::size_t, 2> at,
             Duration together, std::array<std::size_t, 2>* skip) {
  for (std::size_t most = 1; most <= kLook; ++most)
    for (std::size_t least = 0; least <= most; ++least)
      for (const std::array<std::size_t, 2>& s :
           {std::array{most, least}, std::array{least, most}}) {
        const std::size_t l = at[0] + s[0], r = at[1] + s[1];
        if (l >= c[0]->stamps.size() || r >= c[1]->stamps.size() ||
            apart(c[0]->stamps[l], c[1]->stamps[r]) > together)
          continue;
        *skip = s;
        return true;
      }
  return false;
}

/// By stamps, in the order of the files. A stamp that is wrong by itself costs its own frame.
Pairing pair_by_stamps(const CameraFiles& left, const CameraFiles& right) {
  const std::array<const CameraFiles*, 2> cameras{&left, &right};
  const Duration together = Duration::seconds(kTogether * usual_interval(left.stamps).to_seconds());
  Pairing out;
  std::array<std::size_t, 2> at{}, skip{};
  std::size_t blind =
      0;  // steps until the next look ahead: what was in vain a moment ago would be again
  while (at[0] < left.stamps.size() && at[1] < right.stamps.size()) {
    const Stamp l = left.stamps[at[0]], r = right.stamps[at[1]];
    if (const Duration d = apart(l, r); d <= together) {
      out.pairs.push_back(at);
      out.farthest = std::max(out.farthest, d);
      ++at[0], ++at[1];
      continue;
    }
    const bool looked = blind == 0;
    if (!looked || !find_on(cameras, at, together, &skip)) {
      skip = l < r ? std::array<std::size_t, 2>{1, 0} : std::array<std::size_t, 2>{0, 1};
      blind = looked ? kLook : blind - 1;
    }
    for (std::size_t k = 0; k < 2; ++k) at[k] += skip[k], out.alone[k] += skip[k];
  }
  out.alone[0] += left.stamps.size() - at[0];
  out.alone[1] += right.stamps.size() - at[1];
  return out;
}

std::string file_name(int camera, std::size_t index, const std::string& extension) {
  return fmt::format("{}/data/{:010d}{}", kitti_raw_camera(camera), index, extension);
}

void list_pairs(const fs::path& drive, const std::array<int, 2>& cameras,
                StereoSequence* sequence) {
  const CameraFiles left = list_camera(drive, cameras[0], &sequence->remarks),
                    right = list_camera(drive, cameras[1], &sequence->remarks);
  const Pairing pairing = pair_by_stamps(left, right);
  if (pairing.pairs.empty())
    refuse(
        drive, 0,
        fmt::format(
            "the stamps of {} and {} never agree: images that belong together have nearly the same",
            kitti_raw_camera(cameras[0]), kitti_raw_camera(cameras[1])));
  std::vector<Stamp> stamps;
  stamps.reserve(pairing.pairs.size());
  for (const auto& p : pairing.pairs) stamps.push_back(left.stamps[p[0]]);
  const std::vector<std::size_t> kept = ascending(stamps);
  sequence->pairs.reserve(kept.size());
  for (const std::size_t i : kept)
    sequence->pairs.push_back(
        {stamps[i],
         {file_name(cameras[0], left.index[pairing.pairs[i][0]], left.extension),
          file_name(cameras[1], right.index[pairing.pairs[i][1]], right.extension)}});

  const std::size_t disordered = stamps.size() - kept.size();
  sequence->left_out =
      std::max(pairing.alone[0] + left.without_stamp, pairing.alone[1] + right.without_stamp) +
      disordered;
  auto& remarks = sequence->remarks;
  for (std::size_t k = 0; k < 2; ++k)
    if (pairing.alone[k] > 0)
      remarks.push_back(fmt::format(
          "{}: {} images have no partner of {} by their stamps and are left out",
          kitti_raw_camera(cameras[k]), pairing.alone[k], kitti_raw_camera(cameras[1 - k])));
  if (disordered > 0)
    remarks.push_back(fmt::format("{}: {} stamps go back or repeat one; their frames are left out",
                                  kitti_raw_camera(cameras[0]), disordered));
  constexpr Duration kTold = Duration::milliseconds(5);
  if (pairing.farthest > kTold)
    remarks.push_back(
        fmt::format("the stamps of a pair are up to {:.1f} ms apart; that of {} counts",
                    1e3 * pairing.farthest.to_seconds(), kitti_raw_camera(cameras[0])));
}

}  // namespace

std::string kitti_raw_camera(int camera) { return fmt::format("image_{:02d}", camera); }

bool holds_kitti_raw(const fs::path& folder) { return !drives_in(folder).empty(); }

KittiRawFolders find_kitti_raw(const fs::path& folder) {
  std::vector<fs::path> found = drives_in(folder);
  if (found.empty())
    refuse(folder, 0,
           "holds no KITTI raw drive: a folder with image_00, image_01 and oxts is expected");
  if (found.size() > 1) {
    std::sort(found.begin(), found.end());
    std::string names;
    for (std::size_t i = 0; i < std::min(kMostDrives, found.size()); ++i)
      names += (i > 0 ? ", " : "") + found[i].filename().string();
    refuse(folder, 0,
           fmt::format("holds {} drives ({}{}): name one of them", found.size(), names,
                       found.size() > kMostDrives ? ", …" : ""));
  }
  KittiRawFolders out;
  out.drive = found[0];
  std::error_code ignored;
  fs::path lexical =
      fs::absolute(out.drive, ignored)
          .lexically_normal();  // `.` and a name that ends in a slash have a folder above, too
  if (!lexical.has_filename()) lexical = lexical.parent_path();
  // A drive may be a link to where it is kept, its calibration beside the one or the other.
  out.calibration = lexical.parent_path();
  for (const fs::path& other : {out.drive, fs::weakly_canonical(out.drive, ignored).parent_path()})
    if (!fs::exists(out.calibration / kCalibration, ignored) &&
        fs::exists(other / kCalibration, ignored))
      out.calibration = other;
  return out;
}

StereoSequence open_kitti_raw(const fs::path& folder, bool given,
                              const std::array<int, 2>& cameras) {
  if (cameras[0] == cameras[1])
    refuse(
        folder, 0,
        fmt::format("kitti_raw.left and kitti_raw.right are both camera {}; two cameras make a rig",
                    cameras[0]));
  const KittiRawFolders folders = find_kitti_raw(folder);
  StereoSequence sequence;
  sequence.root = folders.drive;
  list_pairs(folders.drive, cameras, &sequence);
  if (given) return sequence;
  const KittiRawRig rig =
      read_kitti_raw_rig(folders.calibration / kCalibration, cameras, first_image_size(sequence, 0),
                         folders.drive.filename().string());
  sequence.calibration = rig.rig;
  sequence.calibration_source = kCalibration;
  return sequence;
}

}  // namespace vergence::app::detail
