#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "app/datasets/recorded_ins.hpp"
#include "app/recording/messages.hpp"
#include "app/recording/session_description.hpp"

/// Recorded session, as written by `record:`: everything the estimator was given, in its order.
namespace vergence::app {

/// Where the pixels of an image are, 8-bit grey without padding.
struct RecordedImage {
  std::uint32_t file = 0;    // of the recording's files
  std::uint64_t offset = 0;  // in the file; 0: there is no such image
  int width = 0, height = 0;
};

struct RecordedFrame {
  FrameRecord given{};  // image_crc: of the images below
  std::array<RecordedImage, kMaxCameras> images{};
  std::size_t readings = 0;  // of the INS, that came before this frame
};

/// A recording, opened. Memory  Some 400 bytes a frame and 250 a reading; pixels stay in the files.
/// Threads  read(): any number at once.
///
///     const RecordedSession session = RecordedSession::open("sessions/monday");
///     for (const RecordedFrame& frame : session.frames()) {
///       const auto width = static_cast<std::size_t>(frame.images[0].width);
///       if (!session.read(frame, 0, pixels.data(), width)) continue;  // damaged, or not recorded
///     }
class RecordedSession {
 public:
  /// The recording in a session's folder, or in a folder of its files alone. InputError: no
  /// recording, one of another program or version, without frames.
  [[nodiscard]] static RecordedSession open(const std::filesystem::path& folder);
  RecordedSession(RecordedSession&&) noexcept;
  ~RecordedSession();

  [[nodiscard]] const SessionDescription& description() const noexcept { return description_; }
  [[nodiscard]] const std::vector<RecordedFrame>& frames() const noexcept { return frames_; }
  [[nodiscard]] const std::vector<InsRecord>& readings() const noexcept { return readings_; }
  [[nodiscard]] const std::vector<std::string>& remarks() const noexcept { return remarks_; }
  /// All images that the estimator had are here, and no frame is missing between two.
  [[nodiscard]] bool complete() const noexcept { return complete_; }
  /// Pixels of a frame's image of camera `camera`, rows `stride` bytes apart. False: they cannot be
  /// read, or are not those that were recorded.
  [[nodiscard]] bool read(const RecordedFrame& frame, std::size_t camera, std::uint8_t* out,
                          std::size_t stride) const noexcept;
  /// Gives back what frames() and readings() take, and they are empty; all else stays.
  void clear_frames() noexcept {
    frames_ = std::vector<RecordedFrame>();
    readings_ = std::vector<InsRecord>();
  }

 private:
  struct Reader;
  struct Files;
  RecordedSession();

  SessionDescription description_;
  std::vector<RecordedFrame> frames_;
  std::vector<InsRecord> readings_;
  std::vector<std::string> remarks_;
  bool complete_ = true;
  std::unique_ptr<Files> files_;
};

/// There is a recording of a session in that folder, by the names of its files and of its poses.
[[nodiscard]] bool holds_recorded_session(const std::filesystem::path& folder);

}  // namespace vergence::app
