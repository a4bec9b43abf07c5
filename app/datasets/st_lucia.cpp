#include "app/datasets/st_lucia.hpp"

#include <algorithm>
#include <system_error>

#include "app/datasets/decimal.hpp"
#include "app/datasets/detail/formats.hpp"
#include "app/datasets/detail/st_lucia_logs.hpp"
#include "app/datasets/text_file.hpp"

namespace vergence::app::detail {
namespace {

constexpr std::string_view kImageLog = "_MultiCamera0.log";

/// The calibration published with the data set, metres: X_right = R X_left + t. Its lens has no
/// distortion.
RigCalibration published_calibration() {
  RigCalibration rig;
  rig.cameras = 2;
  for (Intrinsics& lens : rig.intrinsics) {
    lens.width = 1024;
    lens.height = 768;
  }
  Intrinsics &left = rig.intrinsics[0], &right = rig.intrinsics[1];
  left.fx = 1246.561673900704, left.fy = 1247.092336797580, left.cx = 532.287936343425,
  left.cy = 383.604069688392;
  right.fx = 1244.805048771648, right.fy = 1245.815687282771, right.cx = 506.635543659909,
  right.cy = 390.704813552426;
  Transform& T = rig.T_camera_left[1];
  T.R << 0.999985020769994, 0.001356661749366, -0.005302612991045,  //
      -0.001329315763428, 0.999985817981778, 0.005157204176297,     //
      0.005309534370930, -0.005150078078314, 0.999972642396056;
  T.t = {-0.7506666877284111, -0.003857678457065100, 0.0030959446910902};
  rig.baseline = T.t.norm();
  return rig;
}

/// A log names images with or without the folder in front; they lie in one folder.
std::string image_name(const std::string& images, std::string_view path) {
  return images + "/" + std::string(path.substr(path.find_last_of('/') + 1));
}

StereoPair read_pair(const std::filesystem::path& log, std::size_t line_number,
                     std::string_view line, const std::string& images) {
  constexpr std::size_t kFields = 12;
  std::array<std::string_view, kFields> f;
  if (split(line, ' ', f) != kFields)
    refuse(
        log, line_number,
        "is not `seconds microseconds width height format` of both cameras and their two images");
  const auto stamp = st_lucia_stamp(f[0], f[1]);
  if (!stamp || !st_lucia_stamp(f[5], f[6]))
    refuse(log, line_number, "does not begin with seconds and microseconds below a million");
  return {*stamp, {image_name(images, f[10]), image_name(images, f[11])}};
}

}  // namespace

std::optional<std::filesystem::path> find_st_lucia_log(const std::filesystem::path& folder,
                                                       std::string_view ending) {
  std::vector<std::filesystem::path> found;
  std::error_code error;
  for (std::filesystem::directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error))
    if (it->path().filename().string().ends_with(ending)) found.push_back(it->path());
  if (error) refuse(folder, 0, "cannot be listed (" + error.message() + "): check its permissions");
  if (found.empty()) return std::nullopt;
  if (found.size() > 1) {
    std::sort(found.begin(), found.end());
    refuse(folder, 0,
           "holds " + std::to_string(found.size()) + " files that end in " + std::string(ending) +
               " (" + found[0].filename().string() + ", …): one drive a folder is expected");
  }
  return found[0];
}

std::optional<Stamp> st_lucia_stamp(std::string_view seconds,
                                    std::string_view microseconds) noexcept {
  constexpr std::int64_t kLatest = 9'000'000'000;  // s: what 64 bits of nanoseconds hold
  const auto s = parse_integer(seconds), us = parse_integer(microseconds);
  if (!s || !us || *s < 0 || *s > kLatest || *us < 0 || *us > 999'999) return std::nullopt;
  return Stamp(*s * 1'000'000'000 + *us * 1'000);
}

StereoSequence open_st_lucia(const std::filesystem::path& folder, bool given) {
  const auto found = find_st_lucia_log(folder, kImageLog);
  if (!found)
    refuse(folder, 0,
           "holds no file that ends in " + std::string(kImageLog) +
               ": it is not a folder of this data set");
  const std::filesystem::path& log = *found;
  const std::string images = log.stem().string();
  require_folder(folder / images, "the images that its log names");
  StereoSequence sequence;
  sequence.root = folder;
  sequence.bayer = true;
  const std::string text = read_text(log);
  Lines lines(text);
  for (std::string_view line; lines.next(&line);)
    if (line.find(".bmp") != std::string_view::npos)  // not the header
      sequence.pairs.push_back(read_pair(log, lines.number(), line, images));
  if (sequence.pairs.empty()) refuse(log, 0, "names no images");
  if (given) return sequence;
  sequence.calibration = published_calibration();
  sequence.calibration_source = "the calibration published with the data set";
  return sequence;
}

}  // namespace vergence::app::detail
