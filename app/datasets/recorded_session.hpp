#pragma once

#include "app/datasets/detail/bag_index.hpp"
#include "app/datasets/stereo_sequence.hpp"
#include "app/recording/messages.hpp"
#include "app/recording/session_description.hpp"

/// Session recorded by `record`: all input of the estimator in its order.
namespace vergence::app {

/// Position of an image's pixels, 8-bit grey without padding.
struct RecordedImage {
  /// Index of the recording's file.
  std::uint32_t file = 0;
  /// Offset in the file; 0 if there is no such image.
  std::uint64_t offset = 0;
  int width = 0, height = 0;
};

struct RecordedFrame {
  /// Its image_crc is that of the images below.
  FrameRecord given{};
  std::array<RecordedImage, kMaxCameras> images{};
  /// Number of INS samples before this frame.
  std::size_t readings = 0;
};

/// Open recording. Uses some 400 bytes per frame and 250 per sample; pixels stay in the files.
/// read() is thread-safe.
///
///     const RecordedSession session = RecordedSession::open("sessions/monday");
///     for (const RecordedFrame& frame : session.frames()) {
///       const auto width = static_cast<std::size_t>(frame.images[0].width);
///       if (!session.read(frame, 0, pixels.data(), width)) continue;  // damaged, or not recorded
///     }
class RecordedSession {
 public:
  /// Opens the recording in a session's directory, or a directory with only its files. Throws
  /// InputError without a recording or frames, or for another program or version.
  [[nodiscard]] static RecordedSession open(const std::filesystem::path& folder);

  [[nodiscard]] const SessionDescription& description() const noexcept { return description_; }
  [[nodiscard]] const std::vector<RecordedFrame>& frames() const noexcept { return frames_; }
  [[nodiscard]] const std::vector<InsRecord>& readings() const noexcept { return readings_; }
  [[nodiscard]] const std::vector<std::string>& remarks() const noexcept { return remarks_; }
  /// True if all images of the estimator are here, and no frame is missing in between.
  [[nodiscard]] bool complete() const noexcept { return complete_; }
  /// Reads the pixels of a frame's image in rows `stride` bytes apart. Returns false if they cannot
  /// be read or differ from the recorded ones.
  [[nodiscard]] bool read(const RecordedFrame& frame, std::size_t camera, std::uint8_t* out,
                          std::size_t stride) const noexcept;
  /// Frees the memory of frames() and readings(), which are then empty.
  void clear_frames() noexcept {
    frames_ = std::vector<RecordedFrame>();
    readings_ = std::vector<InsRecord>();
  }

 private:
  struct Reader;
  RecordedSession() = default;

  SessionDescription description_;
  std::vector<RecordedFrame> frames_;
  std::vector<InsRecord> readings_;
  std::vector<std::string> remarks_;
  bool complete_ = true;
  std::vector<detail::BagFile> files_;
};

/// True if the directory has a recording, by the names of its files and of its poses.
[[nodiscard]] bool holds_recorded_session(const std::filesystem::path& folder);

}  // namespace vergence::app
