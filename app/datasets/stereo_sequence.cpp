#include "app/datasets/stereo_sequence.hpp"

#include <algorithm>
#include <system_error>

#include "app/config/calibration_checks.hpp"
#include "app/datasets/detail/bag_images.hpp"
#include "app/datasets/detail/formats.hpp"
#include "app/datasets/detail/pairing.hpp"
#include "app/datasets/recorded_ins.hpp"
#include "app/datasets/recorded_session.hpp"
#include "app/datasets/text_file.hpp"
#include "app/runtime/terminal_text.hpp"

namespace vergence::app {
namespace {

std::string text(ImageSize s) { return std::to_string(s.width) + "x" + std::to_string(s.height); }

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
  RecordedIns ins;
  ins.readings = session.readings();
  sequence.ins = std::make_shared<const RecordedIns>(std::move(ins));
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

/// Marks the frames whose stamps do not fit, so that one stamp that leaps ahead costs only its own
/// frame.
void mark_out_of_order(std::vector<StereoPair>* pairs) {
  std::vector<Stamp> stamps;
  stamps.reserve(pairs->size());
  for (StereoPair& pair : *pairs) {
    stamps.push_back(pair.stamp);
    pair.in_order = false;
  }
  for (const std::size_t kept : detail::ascending(stamps)) (*pairs)[kept].in_order = true;
}

/// Checks common to all formats. `source` is the file of the calibration.
void check(const std::filesystem::path& source, const CalibrationUse& use, StereoSequence* opened) {
  StereoSequence& sequence = *opened;
  check_times(sequence);
  mark_out_of_order(&sequence.pairs);
  apply_use(use, &sequence.calibration);
  if (const auto bad = find_implausible(&sequence.calibration)) refuse(source, 0, bad->message);
  if (sequence.calibration.cameras != 2)
    refuse(source, 0,
           "describes " + std::to_string(sequence.calibration.cameras) +
               " cameras; use a calibration with two");
  const Intrinsics &left = sequence.calibration.intrinsics[0],
                   &right = sequence.calibration.intrinsics[1];
  if (left.width != right.width || left.height != right.height)
    refuse(source, 0,
           "gives the left camera " + text({left.width, left.height}) +
               " pixels and the right one " + text({right.width, right.height}) +
               "; both must have one size");
  check_image_sizes(sequence, 0, std::min<std::size_t>(1, sequence.pairs.size()));
  find_deep_bits(&sequence);
  // The messages contain names and text from files.
  for (auto* messages : {&sequence.remarks, &sequence.assumptions})
    for (std::string& message : *messages) message = harmless(message);
}

/// A directory with bags of both kinds is read as ROS 2, regardless of the order of its entries.
std::optional<SequenceFormat> bag_format_within(const std::filesystem::path& folder) {
  std::optional<SequenceFormat> found;
  std::error_code ignored;
  for (std::filesystem::directory_iterator it(folder, ignored), end; !ignored && it != end;
       it.increment(ignored))
    if (const auto format = bag_format(it->path());
        format && found != SequenceFormat::mcap && (!found || *found != SequenceFormat::db3))
      found = format;
  return found;
}

}  // namespace

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
  const std::string name = file.filename().string();
  if (name.ends_with(".mcap")) return SequenceFormat::mcap;
  if (name.ends_with(".db3")) return SequenceFormat::db3;
  // rosbag uses the second ending while recording, and after a power failure.
  if (name.ends_with(".bag") || name.ends_with(".bag.active")) return SequenceFormat::rosbag;
  return std::nullopt;
}

std::string unpack_advice(const std::filesystem::path& file) {
  struct Packed {
    std::string_view ending, command;
  };
  constexpr std::array kPacked{Packed{".zstd", "zstd -d"},   Packed{".zst", "zstd -d"},
                               Packed{".lz4", "lz4 -d"},     Packed{".gz", "gunzip -k"},
                               Packed{".bz2", "bunzip2 -k"}, Packed{".xz", "unxz -k"},
                               Packed{".zip", "unzip"},      Packed{".7z", "7z x"},
                               Packed{".tar", "tar -xf"},    Packed{".tgz", "tar -xf"}};
  const std::string name = file.filename().string();
  const auto packed =
      std::ranges::find_if(kPacked, [&](const Packed& p) { return name.ends_with(p.ending); });
  if (packed == kPacked.end()) return "";
  return "is compressed (" + std::string(packed->ending.substr(1)) + "); unpack it with `" +
         std::string(packed->command) + " " + name + "` and pass the result";
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
  for (std::filesystem::directory_iterator it(folder, ignored), end; !ignored && it != end;
       it.increment(ignored))
    if (it->path().filename().string().ends_with("_MultiCamera0.log"))
      return SequenceFormat::st_lucia;
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

ImageSize first_image_size(const StereoSequence& sequence, std::size_t camera) {
  ImageSize size;
  for (const StereoPair& pair : sequence.pairs)
    if (!pair.file[camera].empty() &&
        image_size(sequence, pair.file[camera], &size) == ImageFileStatus::ok)
      return {sequence.side_by_side ? size.width / 2 : size.width, size.height};
  refuse(sequence.root, 0,
         std::string("has no readable image (PNG, JPEG, BMP or PGM) of the ") +
             (camera == 0 ? "left" : "right") + " camera");
}

namespace detail {

void require_folder(const std::filesystem::path& folder, const char* what_it_should_hold) {
  std::error_code error;
  if (std::filesystem::is_directory(folder, error)) return;
  refuse(folder, 0,
         std::filesystem::exists(folder, error)
             ? std::string("is not a directory; a directory with ") + what_it_should_hold +
                   " is expected"
             : std::string("does not exist; a directory with ") + what_it_should_hold +
                   " is expected");
}

}  // namespace detail
}  // namespace vergence::app
