#pragma once
#include <functional>

#include "app/config/calibration_file.hpp"
#include "app/datasets/image_file.hpp"
#include "core/types/time.hpp"
#include "drivers/ins.hpp"

/// Recorded stereo sequences as lists of image files with stamps, read by a replay regardless of
/// the data set's layout.
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

/// INS data recorded with a sequence, in a common form for all data sets; a replay compares its
/// poses with it.
struct RecordedIns {
  /// Samples with strictly increasing stamps, on the clock of the images.
  std::vector<InsRecord> readings{};
  /// Extrinsics p_ins = T_ins_left · p_left published with the data set; empty if there are none.
  std::optional<Transform> T_ins_left{};
  /// Files that contain them.
  std::string mount_source{};
  /// Messages about skipped or assumed data.
  std::vector<std::string> remarks{};
};

namespace detail {
class BagImages;
}

/// Frame as listed by the data set.
struct StereoPair {
  Stamp stamp{};
  /// Left and right file, relative to StereoSequence::root, or names in its store; empty: not
  /// listed.
  std::array<std::string, 2> file;
  /// False: skipped, because its stamp does not fit those around it.
  bool in_order = true;
};

/// Sequence without its pixels.
///
/// pairs        In the order of the data set, with their stamps, which may decrease or leap. The
///              fewest frames whose removal makes the others increase are not `in_order`. Files may
///              be missing or truncated; the decoder detects this, skips the frame and reports it.
/// calibration  Two cameras, from the data set's files unless one was supplied.
struct StereoSequence {
  std::filesystem::path root;
  std::vector<StereoPair> pairs{};
  RigCalibration calibration{};
  /// Name of the file, for calibrations.csv.
  std::string calibration_source{};
  /// File of the stamps, for messages.
  std::filesystem::path times{};
  /// Number of frames not in `pairs`: without stamp or partner, or out of order.
  std::size_t left_out = 0;
  /// Messages about skipped or doubtful data.
  std::vector<std::string> remarks{};
  /// A phrase for each value assumed because the files lack it.
  std::vector<std::string> assumptions{};
  /// True if a file has both images, the left one first; file[0] and file[1] are then equal.
  bool side_by_side = false;
  /// Images of a bag; empty if images are files below root.
  std::shared_ptr<const detail::BagImages> store{};
  /// INS recorded with the images; empty if it has separate files (read_recorded_ins()) or there is
  /// none.
  std::shared_ptr<const RecordedIns> ins{};
  /// Number of used bits of 16-bit samples (find_deep_bits()).
  int deep_bits = 16;
  /// True for raw mosaics, which are converted to grey (core/types/bayer.hpp).
  bool bayer = false;
};

/// Calibration in place of the data set's: its name, and a function that reads it for the given
/// images.
struct GivenCalibration {
  std::string name;
  std::function<CalibrationFile(const StereoSequence& images)> read;
};

/// Full names of the topics of a bag; empty for the only ones of their types, or those named left
/// and right.
struct BagTopics {
  std::string left{}, right{};
  /// Topic of NavSatFix.
  std::string ins{};
  /// Topic of Imu, with the orientation that belongs to NavSatFix.
  std::string imu{};
  bool operator==(const BagTopics&) const = default;
};

[[nodiscard]] inline bool is_bag(SequenceFormat format) noexcept {
  return format == SequenceFormat::mcap || format == SequenceFormat::rosbag ||
         format == SequenceFormat::db3;
}

/// Returns the bag format by the file name's ending; nullopt if it is none.
[[nodiscard]] std::optional<SequenceFormat> bag_format(const std::filesystem::path& file);

/// Format of a directory (or a bag's file) by its content; empty if unknown.
[[nodiscard]] std::optional<SequenceFormat> find_format(const std::filesystem::path& folder);

/// Format by a value of --format or, with `auto`, by the content of `folder`. Throws InputError if
/// unknown.
[[nodiscard]] SequenceFormat sequence_format(const std::string& word,
                                             const std::filesystem::path& folder);
/// Throws InputError if topics are named but the format is not a bag.
void check_topics(SequenceFormat format, const BagTopics& topics);

/// Part of a sequence to open, and its calibration.
struct SequenceOptions {
  /// Empty selects the data set's own.
  std::optional<GivenCalibration> calibration{};
  /// Part of the calibration to use.
  CalibrationUse use{};
  /// Left and right of a data set with more than two (kitti_raw).
  std::array<int, 2> cameras{0, 1};
  /// Topics of a bag.
  BagTopics topics{};
};

/// Opens a sequence of the given format.
///
/// kitti     calib.txt (P0, P1), times.txt (seconds), image_0/, image_1/ with NNNNNN.png: image N
///           belongs to line N of times.txt.
/// kitti_raw DATE_drive_NNNN_sync or _extract with image_NN/data and image_NN/timestamps.txt, and
/// the date's calib_*.txt above it. Paired by stamps; the left camera's is used. Raw or rectified
/// images, distinguished by size. `folder` is the drive, its date, or above.
/// euroc     mav0/cam0, mav0/cam1 with data.csv and sensor.yaml, or that mav0 itself; paired by
///           equal stamps; raw images.
/// folder    left/, right/ (or both/ with side-by-side images), times.txt (one line per pair:
///           integer nanoseconds, or seconds if one has a point), calibration.yaml. Paired by equal
///           names, where a name missing on one side is a lost image; by order of name (2 before
///           10) if names do not match; or as times.txt names them: `stamp,file` or `stamp,left
///           file,right file`. Optional reference of the left camera: truth.tum, or KITTI's
///           poses.txt. Without times.txt pairs are 0.1 s apart, with a remark.
/// st_lucia  PREFIX_MultiCamera0.log names the images in PREFIX_MultiCamera0/; paired by line, with
///           the left camera's stamp; raw Bayer BMP; the calibration published with the data set.
/// mcap,     A .mcap or .bag file, or a directory with some: a ROS 2 or ROS 1 bag
/// rosbag    (docs/datasets.md). Paired by the nearest header.stamp; the left camera's is used.
///           With CameraInfo and INS.
/// session   A session's directory with drive.mcap (docs/session_files.md), as a sequence of
///           images; SessionSource replays it as recorded.
///
/// Throws InputError (file, line, problem) for missing directories, files or images, inconsistent
/// numbers of images and times, invalid times, times in another unit or decreasing (check_times()),
/// an implausible calibration, or images of another size than the calibration's.
///
///     const StereoSequence drive = open_sequence(SequenceFormat::euroc, "MH_01_easy");
///     for (const StereoPair& pair : drive.pairs) use(drive.root / pair.file[0], pair.stamp);
[[nodiscard]] StereoSequence open_sequence(SequenceFormat format,
                                           const std::filesystem::path& folder,
                                           const SequenceOptions& options = {});

/// Reads the INS of the sequence that open_sequence() opens with the same arguments, if it has
/// separate files; that of a bag is StereoSequence::ins. Without data, or data outside the
/// sequence, there are no samples. `mount_wanted` reads the published extrinsics, if any. Uses some
/// 250 bytes per sample, at most kMaxReadings. Throws InputError for missing or invalid files, or
/// without a complete sample.
[[nodiscard]] RecordedIns read_recorded_ins(SequenceFormat format,
                                            const std::filesystem::path& folder,
                                            const std::array<int, 2>& cameras, bool mount_wanted);

/// Five hours at 100 Hz.
inline constexpr std::size_t kMaxReadings = 2'000'000;

/// Size of an image of the sequence, from its header. → as read_image_size()
[[nodiscard]] ImageFileStatus image_size(const StereoSequence& sequence, const std::string& name,
                                         ImageSize* size);

/// Decodes an image of the sequence; *work is reused memory. Thread-safe. → as decode_grey(), and
/// missing, unreadable, too_many_files
[[nodiscard]] ImageFileStatus decode_image(const StereoSequence& sequence, const std::string& name,
                                           ImageSize size, std::uint8_t* out, std::size_t stride,
                                           int deep_bits, std::vector<std::uint8_t>* work);

/// Size of the first readable image of camera `camera`. Throws InputError if there is none.
[[nodiscard]] ImageSize first_image_size(const StereoSequence& sequence, std::size_t camera);

/// Throws InputError if the stamps are implausible: one is more than 146 years from 1970 (so that
/// differences fit 64 bits), most do not increase, or the median step is below 1 ms or above 10 s.
/// The message suggests the unit that would be plausible.
void check_times(const StereoSequence& sequence);

/// Checks the header of every image of pairs [first, first + count): throws InputError for the
/// first of another size than the calibration's. Missing and unreadable files pass, because their
/// frames are skipped later. Takes some 10 µs per image.
void check_image_sizes(const StereoSequence& sequence, std::size_t first, std::size_t count);

/// Sets `deep_bits` by the maximum sample of some images, and adds a remark if it is below 16.
/// Images of 10, 12 or 14-bit cameras are often stored unscaled in 16 bits, in PNG and in bags, and
/// look black.
void find_deep_bits(StereoSequence* sequence);

}  // namespace vergence::app
