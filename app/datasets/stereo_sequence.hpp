#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/config/calibration_file.hpp"
#include "app/datasets/image_file.hpp"
#include "core/types/calibration.hpp"
#include "core/types/time.hpp"

/// Recorded stereo drives as lists of image files with stamps: what a replay reads, whatever the
/// data set's own layout.
namespace vergence::app {

enum class SequenceFormat : std::uint8_t {
  kitti,
  kitti_raw,
  euroc,
  folder,
  st_lucia,
  mcap,
  rosbag,
  db3,
  session
};

struct RecordedIns;  // recorded_ins.hpp
namespace detail {
class BagImages;
}

/// One frame as the data set lists it.
struct StereoPair {
  Stamp stamp{};
  /// Left and right file, relative to StereoSequence::root, or names in its store; empty: not
  /// listed.
  std::array<std::string, 2> file;
  /// False: skipped, because its stamp does not fit those around it.
  bool in_order = true;
};

/// A whole drive but its pixels.
///
/// pairs        In the order of the data set; stamps as they are, so they may go backwards or leap
///              ahead: the fewest that have to be left out for the others to go forward are not
///              `in_order`. Files may be missing or torn: who decodes them finds out, skips the
///              frame and says so.
/// calibration  Two cameras; from the data set's own files unless one was given.
struct StereoSequence {
  std::filesystem::path root;
  std::vector<StereoPair> pairs;
  RigCalibration calibration;
  std::string calibration_source;  // the file's name, for calibrations.csv
  std::filesystem::path times;     // the file that the stamps are from, for messages about them
  std::size_t left_out = 0;  // frames that are none of `pairs`: no stamp, no partner, out of order
  std::vector<std::string> remarks{};  // what was left out or is doubtful: a message each
  std::vector<std::string>
      assumptions{};          // facts the files leave out, and the values assumed: one phrase each
  bool side_by_side = false;  // a file holds both images, the left one's columns first; file[0] and
                              // file[1] are the same
  std::shared_ptr<const detail::BagImages>
      store{};                               // of a bag; nothing: images are files below root
  std::shared_ptr<const RecordedIns> ins{};  // that came with the images; nothing: it has files of
                                             // its own (read_recorded_ins()), or there is none
  int deep_bits = 16;  // of images of 16 bits a sample: so many are used (find_deep_bits())
  bool bayer = false;  // images are raw mosaics: grey is made of them (core/types/bayer.hpp)
};

/// A calibration that is used instead of the data set's own: where it is from, and how to have it,
/// given the images that are there.
struct GivenCalibration {
  std::string name;
  std::function<CalibrationFile(const StereoSequence& images)> read;
};

/// Which topics of a bag are wanted, in full; empty: the only ones of their types, or those named
/// left and right.
struct BagTopics {
  std::string left{}, right{};
  /// Topic of NavSatFix.
  std::string ins{};
  /// Topic of Imu, with the orientation that belongs to NavSatFix.
  std::string imu{};
  [[nodiscard]] bool empty() const noexcept {
    return left.empty() && right.empty() && ins.empty() && imu.empty();
  }
};

[[nodiscard]] inline bool is_bag(SequenceFormat format) noexcept {
  return format == SequenceFormat::mcap || format == SequenceFormat::rosbag ||
         format == SequenceFormat::db3;
}

/// Returns the bag format by the file name's ending; nullopt if it is none.
[[nodiscard]] std::optional<SequenceFormat> bag_format(const std::filesystem::path& file);

/// Returns how to unpack a bag that was compressed as a whole (`drive.mcap.zstd`): a phrase; empty:
/// it was not.
[[nodiscard]] std::string unpack_advice(const std::filesystem::path& file);

/// The format of a folder (or a bag's file) by what is in it; nothing: none that is known.
[[nodiscard]] std::optional<SequenceFormat> find_format(const std::filesystem::path& folder);

/// Selects the part of a sequence that is opened, and its calibration.
struct SequenceOptions {
  std::optional<GivenCalibration> calibration{};  // nothing: the data set's own
  CalibrationUse use{};              // what of the calibration is wanted, whichever it is
  std::array<int, 2> cameras{0, 1};  // left and right of a data set with more than two (kitti_raw)
  BagTopics topics{};                // of a bag
};

/// A drive of the given format.
///
/// kitti     calib.txt (P0, P1), times.txt (seconds), image_0/, image_1/ with NNNNNN.png: image N
///           belongs to line N of times.txt.
/// kitti_raw DATE_drive_NNNN_sync or _extract with image_NN/data and image_NN/timestamps.txt, the
///           date's calib_*.txt above it; paired by stamps, that of the left camera counts; raw or
///           rectified images, told by their size. `folder` is the drive, its date, or above.
/// euroc     mav0/cam0, mav0/cam1 with data.csv and sensor.yaml, or that mav0 itself; paired by
///           equal stamps; raw images.
/// folder    left/, right/ (or both/ with both images in each file, side by side), times.txt (one
///           line a pair: integer nanoseconds, or seconds if one of them has a point),
///           calibration.yaml. Paired by equal names, where a name that one side lacks is an image
///           that was lost; in order of name (2 before 10) where names make no pair a line; as the
///           lines of times.txt name them, `stamp,file` or `stamp,left file,right file`, if they
///           do. A reference may lie beside them: truth.tum, or poses.txt as KITTI has it, of the
///           left camera. Without times.txt pairs are taken to be 0.1 s apart, which is a remark.
/// st_lucia  PREFIX_MultiCamera0.log names the images in PREFIX_MultiCamera0/; paired by line, by
///           the left camera's stamp; raw Bayer BMP; the calibration published with the data set.
/// mcap,     A .mcap or .bag file, or a folder with some: a bag of ROS 2 or ROS 1
/// (docs/datasets.md); rosbag    paired by the nearest header.stamp, that of the left camera
/// counts; CameraInfo beside
///           the images, and the INS.
/// session   A session's folder with drive.mcap (docs/session_files.md), as a sequence of images;
///           SessionSource replays it as it was recorded.
///
/// InputError (file, line, what): folders or files that are not there, no images, numbers of images
/// and times that do not go together, times that are no numbers, times in another unit or running
/// backwards (check_times()), a calibration that makes no rig, images of another size than the
/// calibration.
///
///     const StereoSequence drive = open_sequence(SequenceFormat::euroc, "MH_01_easy");
///     for (const StereoPair& pair : drive.pairs) use(drive.root / pair.file[0], pair.stamp);
[[nodiscard]] StereoSequence open_sequence(SequenceFormat format,
                                           const std::filesystem::path& folder,
                                           const SequenceOptions& options = {});

/// Size of an image of the sequence, from its head. → as read_image_size()
[[nodiscard]] ImageFileStatus image_size(const StereoSequence& sequence, const std::string& name,
                                         ImageSize* size);

/// Size of the first image of camera `camera` whose head can be read. InputError when there is
/// none.
[[nodiscard]] ImageSize first_image_size(const StereoSequence& sequence, std::size_t camera);

/// InputError where the stamps cannot be those of a drive: one is further than 146 years from 1970
/// (so that differences stay within 64 bits), most do not go forward, or the median step between
/// pairs is below 1 ms or above 10 s. The message asks for the unit that would make them one.
void check_times(const StereoSequence& sequence);

/// Looks at the head of every image of pairs [first, first + count): InputError names the first
/// that has another size than the calibration. Missing and unreadable files pass: their frames are
/// skipped when they come. Some 10 µs an image.
void check_image_sizes(const StereoSequence& sequence, std::size_t first, std::size_t count);

/// Cameras of 10, 12 or 14 bits are often kept in 16 bits a sample without being scaled, in PNG and
/// in bags, which looks black. Sets `deep_bits` of the sequence by the greatest sample of some
/// images of the drive, and adds a remark where that is below 16.
void find_deep_bits(StereoSequence* sequence);

}  // namespace vergence::app
