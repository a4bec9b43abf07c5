#include "app/datasets/stereo_sequence.hpp"

#include <new>
#include <system_error>

#include "app/config/calibration_checks.hpp"
#include "app/datasets/detail/formats.hpp"
#include "app/datasets/detail/names.hpp"
#include "app/datasets/detail/pairing.hpp"
#include "app/datasets/recorded_session.hpp"
#include "app/datasets/text_file.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/nearest.hpp"
#include "app/runtime/terminal_text.hpp"

namespace vergence::app {
namespace {

/// Recording of a session as a sequence of images, with the session's initial calibration and its
/// INS samples.
StereoSequence open_session(const std::filesystem::path& folder, const SequenceOptions& o) {
  StereoSequence sequence = detail::open_bag(detail::BagFormat::mcap, folder, true, o.topics);
  const RecordedSession session = RecordedSession::open(folder);
  if (!o.calibration) {
    sequence.calibration =
        parse_calibration(session.description().calibration, folder.string()).rig;
    sequence.calibration_source = "the recording";
  }
  sequence.ins = std::make_shared<const RecordedIns>(RecordedIns{session.readings()});
  return sequence;
}

StereoSequence open_by_format(SequenceFormat format, const std::filesystem::path& folder,
                              const SequenceOptions& o) {
  const bool given = o.calibration.has_value();
  switch (format) {
    case SequenceFormat::kitti:
      return detail::open_kitti(folder, given);
    case SequenceFormat::kitti_raw:
      return detail::open_kitti_raw(folder, given, o.cameras);
    case SequenceFormat::euroc:
      return detail::open_euroc(folder, given, o.use);
    case SequenceFormat::folder:
      return detail::open_folder(folder, given, o.use);
    case SequenceFormat::st_lucia:
      return detail::open_st_lucia(folder, given);
    case SequenceFormat::mcap:
      return detail::open_bag(detail::BagFormat::mcap, folder, given, o.topics);
    case SequenceFormat::rosbag:
      return detail::open_bag(detail::BagFormat::rosbag, folder, given, o.topics);
    case SequenceFormat::db3:
      return detail::open_bag(detail::BagFormat::sqlite, folder, given, o.topics);
    case SequenceFormat::session:
      return open_session(folder, o);
  }
  refuse(folder, 0, "has no reader for its format");
}

/// Checks common to all formats. `source` is the file of the calibration.
void check(const std::filesystem::path& source, const CalibrationUse& use, StereoSequence* opened) {
  StereoSequence& sequence = *opened;
  check_times(sequence);
  // One stamp that leaps ahead costs only its own frame.
  std::vector<Stamp> stamps;
  for (StereoPair& pair : sequence.pairs) {
    stamps.push_back(pair.stamp);
    pair.in_order = false;
  }
  for (const std::size_t kept : detail::ascending(stamps)) sequence.pairs[kept].in_order = true;
  apply_use(use, &sequence.calibration);
  if (sequence.calibration.cameras != 2)
    refuse(source, 0, "describes {} cameras; use a calibration with two",
           sequence.calibration.cameras);
  const Intrinsics &left = sequence.calibration.intrinsics[0],
                   &right = sequence.calibration.intrinsics[1];
  if (left.width != right.width || left.height != right.height)
    refuse(source, 0,
           "gives the left camera {}x{} pixels and the right one {}x{}; both must have one size",
           left.width, left.height, right.width, right.height);
  // Numbers for another size are implausible for that reason.
  check_image_sizes(sequence, 0, std::min<std::size_t>(1, sequence.pairs.size()));
  if (const auto bad = find_implausible(&sequence.calibration)) refuse(source, 0, bad->message);
  find_deep_bits(&sequence);
  // The messages contain names and text from files.
  for (auto* messages : {&sequence.remarks, &sequence.assumptions})
    for (std::string& message : *messages) message = harmless(message);
}

/// A directory with bags of both kinds is read as ROS 2, regardless of the order of its entries.
std::optional<SequenceFormat> bag_format_within(const std::filesystem::path& folder) {
  std::optional<SequenceFormat> found;
  for (const auto& entry : detail::entries_in(folder))
    if (const auto format = bag_format(entry);
        format && found != SequenceFormat::mcap && (!found || *found != SequenceFormat::db3))
      found = format;
  return found;
}

// In s. No stereo camera is faster than the first, and motion cannot be predicted across the
// second.
constexpr double kShortestStep = 1e-3, kLongestStep = 10;
// The pairs are spread over the sequence, because a part of it may be dark.
constexpr std::size_t kSampledPairs = 5;
// Used bits of 16.
constexpr int kFewestBits = 10;

/// Refuses a bag that was compressed as a whole (`drive.mcap.zstd`) with the command that unpacks
/// it.
void refuse_packed(const std::filesystem::path& file) {
  using Packed = std::pair<std::string_view, std::string_view>;
  constexpr std::array kPacked{Packed{".zstd", "zstd -d"},   Packed{".zst", "zstd -d"},
                               Packed{".lz4", "lz4 -d"},     Packed{".gz", "gunzip -k"},
                               Packed{".bz2", "bunzip2 -k"}, Packed{".xz", "unxz -k"},
                               Packed{".zip", "unzip"},      Packed{".7z", "7z x"},
                               Packed{".tar", "tar -xf"},    Packed{".tgz", "tar -xf"}};
  const std::string name = file.filename().string();
  for (const auto& [ending, command] : kPacked)
    if (detail::lower(name).ends_with(ending))
      refuse(file, 0, "is compressed ({}); unpack it with `{} {}` and pass the result",
             ending.substr(1), command, name);
}

}  // namespace

namespace detail {

void require_folder(const std::filesystem::path& folder, const char* what_it_should_hold) {
  std::error_code error;
  if (std::filesystem::is_directory(folder, error)) return;
  refuse(folder, 0, "{}; a directory with {} is expected",
         std::filesystem::exists(folder, error) ? "is not a directory" : "does not exist",
         what_it_should_hold);
}

}  // namespace detail
StereoSequence open_sequence(SequenceFormat format, const std::filesystem::path& folder,
                             const SequenceOptions& options) {
  if (!is_bag(format)) detail::require_folder(folder, "a drive");
  StereoSequence sequence = open_by_format(format, folder, options);
  std::filesystem::path source = sequence.root / sequence.calibration_source;
  if (options.calibration) {
    source = options.calibration->name;
    sequence.calibration = options.calibration->read(sequence).rig;
    sequence.calibration_source = source.filename().string();
  }
  check(source, options.use, &sequence);
  return sequence;
}

std::optional<SequenceFormat> bag_format(const std::filesystem::path& file) {
  const std::string name = detail::lower(file.filename().string());
  if (name.ends_with(".mcap")) return SequenceFormat::mcap;
  if (name.ends_with(".db3")) return SequenceFormat::db3;
  // rosbag uses the second ending while recording, and after a power failure.
  if (name.ends_with(".bag") || name.ends_with(".bag.active")) return SequenceFormat::rosbag;
  return std::nullopt;
}

std::optional<SequenceFormat> find_format(const std::filesystem::path& folder) {
  std::error_code ignored;
  if (const auto bag = bag_format(folder); bag && std::filesystem::is_regular_file(folder, ignored))
    return bag;
  const auto has = [&](const char* name) {
    return std::filesystem::exists(folder / name, ignored);
  };
  if (holds_recorded_session(folder)) return SequenceFormat::session;
  if (has("mav0/cam0/data.csv") || has("cam0/data.csv")) return SequenceFormat::euroc;
  if ((has("image_0") && has("image_1")) || (has("image_2") && has("image_3")))
    return SequenceFormat::kitti;
  if ((has("left") && has("right")) || has("both")) return SequenceFormat::folder;
  for (const auto& entry : detail::entries_in(folder))
    if (entry.filename().string().ends_with("_MultiCamera0.log")) return SequenceFormat::st_lucia;
  if (const auto bag = bag_format_within(folder)) return bag;
  if (detail::holds_kitti_raw(folder)) return SequenceFormat::kitti_raw;
  if (detail::holds_stereo_images(folder)) return SequenceFormat::folder;
  // The reader then reports what is missing.
  if (has("mav0")) return SequenceFormat::euroc;
  return std::nullopt;
}

RecordedIns read_recorded_ins(SequenceFormat format, const std::filesystem::path& folder,
                              const std::array<int, 2>& cameras, bool mount_wanted) {
  if (format == SequenceFormat::kitti_raw) return detail::read_oxts(folder, cameras, mount_wanted);
  if (format == SequenceFormat::st_lucia) return detail::read_st_lucia_ins(folder);
  // The INS of a bag is in StereoSequence::ins.
  return {};
}

ImageFileStatus image_size(const StereoSequence& sequence, const std::string& name,
                           ImageSize* size) {
  return sequence.store ? sequence.store->size(name, size)
                        : read_image_size(sequence.root / name, size);
}

ImageFileStatus decode_image(const StereoSequence& sequence, const std::string& name,
                             ImageSize size, std::uint8_t* out, std::size_t stride, int deep_bits,
                             std::vector<std::uint8_t>* work) try {
  if (name.empty()) return ImageFileStatus::missing;
  if (sequence.store) return sequence.store->decode(name, size, out, stride, deep_bits, work);
  const auto status = read_image_file(sequence.root / name, work);
  return status == ImageFileStatus::ok ? decode_grey(*work, size, out, stride, deep_bits) : status;
} catch (const std::bad_alloc&) {
  // The file does not fit this machine's memory.
  return ImageFileStatus::unreadable;
}

ImageSize first_image_size(const StereoSequence& sequence, std::size_t camera) {
  ImageSize size;
  for (const StereoPair& pair : sequence.pairs)
    if (!pair.file[camera].empty() &&
        image_size(sequence, pair.file[camera], &size) == ImageFileStatus::ok)
      return {sequence.side_by_side ? size.width / 2 : size.width, size.height};
  refuse(sequence.root, 0, "has no readable image (PNG, JPEG, BMP or PGM) of the {} camera",
         camera == 0 ? "left" : "right");
}

void check_times(const StereoSequence& sequence) {
  // Half of the 64-bit range in ns, 1823 to 2116, so that differences of two stamps do not
  // overflow.
  constexpr std::int64_t kFarthest = std::int64_t{1} << 62;
  const std::filesystem::path file = sequence.times.empty() ? sequence.root : sequence.times;
  for (const StereoPair& pair : sequence.pairs)
    if (pair.stamp.ns() > kFarthest || pair.stamp.ns() < -kFarthest)
      refuse(file, 0,
             "has the stamp {} ns, {} s from 1970, outside the years 1824 to 2116; check its unit "
             "and that the line is complete",
             pair.stamp.ns(), format_seconds(pair.stamp.ns()));
  if (sequence.pairs.size() < 3) return;
  // Forward steps in s.
  std::vector<double> steps;
  std::size_t backward = 0;
  for (std::size_t i = 1; i < sequence.pairs.size(); ++i) {
    const Stamp before = sequence.pairs[i - 1].stamp, now = sequence.pairs[i].stamp;
    if (now > before)
      steps.push_back((now - before).to_seconds());
    else if (now < before)
      ++backward;
  }
  const std::size_t all = sequence.pairs.size() - 1, still = all - backward - steps.size();
  if (2 * steps.size() < all && still > backward)
    refuse(file, 0,
           "has times of which {} of {} repeat the one before; write them with more digits", still,
           all);
  if (2 * steps.size() < all)
    refuse(file, 0,
           "has times that do not increase: of {} steps from pair to pair {} go back and {} are "
           "zero; sort the lines like the images, oldest first",
           all, backward, still);
  // The lower middle is used, because a gap does not indicate the unit.
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>((steps.size() - 1) / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  if (*middle >= kShortestStep && *middle <= kLongestStep) return;
  if (*middle == 1e-9 && backward + still == 0)
    refuse(file, 0,
           "has frame numbers (1, 2, 3 …) instead of times; write times, or remove the file so "
           "that pairs are assumed 0.1 s apart");
  refuse(file, 0,
         "has a median interval of {:.4g} s between pairs, outside 1 ms to 10 s; check the unit of "
         "its times.{}",
         *middle,
         // Other formats have a fixed unit.
         file.extension() == ".txt"
             ? " Whole numbers are read as nanoseconds, numbers with a point as seconds"
             : "");
}

void check_image_sizes(const StereoSequence& sequence, std::size_t first, std::size_t count) {
  const std::size_t end =
      first + std::min(count, sequence.pairs.size() - std::min(first, sequence.pairs.size()));
  std::size_t good = 0, bad = 0;
  std::string message;
  for (std::size_t i = first; i < end; ++i)
    for (std::size_t k = 0; k < 2; ++k) {
      const std::string& name = sequence.pairs[i].file[k];
      if (name.empty()) continue;
      ImageSize size;
      if (image_size(sequence, name, &size) != ImageFileStatus::ok) continue;
      const Intrinsics& camera = sequence.calibration.intrinsics[k];
      const ImageSize requested{(sequence.side_by_side ? 2 : 1) * camera.width, camera.height};
      ++(size == requested ? good : bad);
      if (size == requested || !message.empty()) continue;
      message = fmt::format(
          "{}: is {}x{} pixels, but the calibration of this camera ({}) is for {}x{}{}; use the "
          "calibration that belongs to these images",
          (sequence.root / name).string(), size.width, size.height, sequence.calibration_source,
          requested.width, requested.height,
          sequence.side_by_side ? " (twice its width, side by side)" : "");
    }
  // Single images of another size are skipped as frames.
  if (bad > good) throw InputError(message);
}

void find_deep_bits(StereoSequence* sequence) {
  if (sequence->pairs.empty()) return;
  std::vector<std::uint8_t> whole, low, work;
  // Maximum of the upper 8 bits; −1 before the first image that is not black.
  int peak = -1;
  for (std::size_t i = 0; i < kSampledPairs; ++i)
    for (const std::string& name :
         sequence->pairs[i * (sequence->pairs.size() - 1) / (kSampledPairs - 1)].file) {
      ImageSize size;
      if (name.empty() || image_size(*sequence, name, &size) != ImageFileStatus::ok) continue;
      const auto width = static_cast<std::size_t>(size.width);
      const auto decoded = [&](int bits, std::vector<std::uint8_t>* grey) {
        grey->resize(width * static_cast<std::size_t>(size.height));
        return decode_image(*sequence, name, size, grey->data(), width, bits, &work) ==
               ImageFileStatus::ok;
      };
      if (!decoded(16, &whole) || !decoded(kFewestBits, &low) ||
          std::ranges::all_of(low, [](std::uint8_t v) { return v == 0; }))
        continue;
      // The number of bits makes no difference to samples of 8 bits.
      if (whole == low) return;
      peak = std::max<int>(peak, *std::ranges::max_element(whole));
    }
  if (peak < 0) return;
  for (const int bits : {kFewestBits, 12, 14})
    if (peak < 1 << (bits - 8)) {
      sequence->deep_bits = bits;
      sequence->remarks.push_back(
          fmt::format("the images have 16 bits per sample, of which {0} are used: they are read as "
                      "images of {0} bits",
                      bits));
      return;
    }
}

SequenceFormat sequence_format(const std::string& word, const std::filesystem::path& folder) {
  constexpr const char* kLayouts =
      "KITTI (image_0, image_1, calib.txt, times.txt), KITTI raw (image_00, image_01, calib_*.txt "
      "in the parent directory), EuRoC (mav0), a folder with left/ and right/ (or other usual "
      "names), times.txt and calibration.yaml, UQ St Lucia, bags of ROS 2 (.mcap, .db3) and ROS 1 "
      "(.bag), sessions with a recording (drive.mcap)";
  const std::vector<std::string> words{"kitti", "kitti-raw", "euroc", "folder", "st-lucia",
                                       "mcap",  "rosbag",    "db3",   "session"};
  if (const auto at = std::ranges::find(words, word); at != words.end())
    return static_cast<SequenceFormat>(at - words.begin());
  if (word != "auto")
    throw InputError("--format \"{}\": unknown format; use auto, {}{}", word,
                     fmt::join(words, ", "), did_you_mean(word, words));
  std::error_code ignored;
  if (!std::filesystem::is_directory(folder, ignored)) {
    if (const auto bag = bag_format(folder)) return *bag;
    refuse_packed(folder);
    refuse(folder, 0, "{}; pass a data-set directory, or a .mcap, .db3 or .bag file",
           std::filesystem::exists(folder, ignored) ? "is a file without the ending of a bag"
                                                    : "no such directory");
  }
  if (const auto found = find_format(folder)) return *found;
  for (const auto& entry : detail::entries_in(folder)) refuse_packed(entry);
  refuse(folder, 0, "not a known data-set format; expected is one of: {}", kLayouts);
}

void check_topics(SequenceFormat format, const BagTopics& topics) {
  if (!is_bag(format) && topics != BagTopics{})
    throw InputError(
        "--left-topic, --right-topic, --ins-topic and --imu-topic select topics of a bag, and DATA "
        "is not a bag; remove them");
}

}  // namespace vergence::app
