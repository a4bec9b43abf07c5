#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <fmt/format.h>

#include "core/comparison/comparison.hpp"
#include "core/estimator/estimator.hpp"
#include "core/types/stamped_pose.hpp"

/// Input of a session's observers: values of fixed size, made on the estimator's thread without
/// heap and copied through rings.
namespace vergence::app {

/// File that grows by complete lines, even if the disk is temporarily full.
///
/// Lines are buffered until flush(). Data that the system does not accept stay in the buffer for a
/// later flush() to the same file. Lines that find the buffer full are refused and counted, so no
/// line is cut. The constructor allocates a buffer of `pending` bytes and throws InputError; later
/// errors are in fault(). Not thread-safe.
class LineFile {
 public:
  /// In bytes: minutes of poses.
  static constexpr std::size_t kPending = std::size_t{1} << 20;

  /// Opens for appending and creates the file if needed. `pending` is the size of the buffer.
  explicit LineFile(const std::filesystem::path& file, std::size_t pending = kPending);
  ~LineFile();
  LineFile& operator=(LineFile&&) = delete;

  /// Adds a line including its end; flushes first if the buffer is full. Returns false if it was
  /// refused and counted.
  bool append(std::string_view line);
  /// Writes the buffer. Returns false if not all was accepted; fault() has the reason.
  bool flush();
  /// Starts writeback to the disk without waiting. Otherwise the kernel starts after 30 s
  /// (vm.dirty_expire_centisecs), which a power cut would lose.
  void write_back() noexcept;
  /// Flushes, synchronises and closes. May be called twice.
  bool close();
  /// close(); adds a message to *faults if lines are lost.
  void close(std::vector<std::string>* faults);

  /// Simulates a disk without room, until called with false.
  void pretend_full(bool full) noexcept { pretend_full_ = full; }

  /// Value of errno of the last flush() or close(); 0 on success.
  [[nodiscard]] int fault() const noexcept { return fault_; }
  [[nodiscard]] std::uint64_t lost_lines() const noexcept { return lost_lines_; }
  [[nodiscard]] std::size_t pending() const noexcept { return pending_; }
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
  std::size_t pending_ = kPending;
  int fd_ = -1;
  int fault_ = 0;
  bool pretend_full_ = false;
  std::uint64_t lost_lines_ = 0;
  std::string waiting_;
};

/// Totals up to a frame, so that they are correct for a reader that misses frames.
struct FrameCounts {
  std::uint64_t read = 0, ok = 0, degraded = 0, lost = 0;
  /// Frames not read, for instance because of a damaged image file.
  std::uint64_t skipped = 0;
  /// Frame numbers that were not received.
  std::uint64_t missing = 0;
  /// Sum of the steps between successive poses.
  double path_m = 0;

  /// Adds a frame that was read.
  void add(const PoseSample& sample) noexcept;

 private:
  std::optional<Vec3> newest_position_{};
};

/// Report of one frame: input without images, pose, also in ENU next to the INS, and times.
/// format_pose_row() formats it for poses.csv; unless lost, it is also a line of trajectory.tum.
struct FrameReport : ComparedPose {
  FrameCounts counts{};
  /// Same as in RigFrame.
  Duration stamp_error{}, spread{};
  Pairing pairing = Pairing::assumed;
  int cameras = 0;
  /// Bit k stands for camera k.
  std::uint8_t images_present = 0;
  /// Time when the estimator was done.
  HostStamp estimated{};
  float decode_ms = 0;
  /// Reference pose of the left camera, in the reference's frame.
  std::optional<Transform> T_reference_left{};

  /// Adds the comparison with the INS, which becomes the reference.
  void set_comparison(const ComparedPose& with_ins) noexcept;
  /// Estimate − INS: east, north, up in m; heading in degrees clockwise. Valid if `compared`.
  [[nodiscard]] std::array<double, 4> error() const noexcept;
};

/// Number or constant text of an event. If `name` is null, it is not used.
struct EventField {
  const char* name = nullptr;
  std::variant<std::int64_t, double, const char*> value{std::int64_t{0}};
};

/// Line of events.jsonl. `kind` and the fields' names point to constants.
struct EventRecord {
  Stamp stamp{};
  const char* kind = "";
  /// Zero-terminated.
  std::array<char, 256> message{};
  std::array<EventField, 4> fields{};

  EventRecord() = default;
  /// Copies the text, cut at a whole UTF-8 character.
  EventRecord(Stamp when, const char* what, std::string_view text) noexcept;
  /// Formats the message in place, without heap.
  template <class First, class... Rest>
  EventRecord(Stamp when, const char* what, fmt::format_string<const First&, const Rest&...> text,
              const First& first, const Rest&... rest) noexcept
      : stamp(when), kind(what) {
    std::array<char, 256> buffer;
    const auto [end, size] = fmt::format_to_n(buffer.data(), buffer.size(), text, first, rest...);
    set_message({buffer.data(), std::min(size, buffer.size())});
  }

  void set_message(std::string_view text) noexcept;
  [[nodiscard]] static EventRecord of(const EstimatorEvent& event) noexcept;
};

/// Accepted, rejected or initial calibration: a line of calibrations.csv for every camera but the
/// left one.
struct CalibrationRecord : CalibrationDecision {
  /// Decided while driving; false for the initial calibration.
  bool decided = true;
  /// Source of the initial calibration: `given`, `state_file` …, a constant.
  const char* began_as = "";
  /// Origin of an initial calibration, zero-terminated. A copy, because a record may outlive the
  /// source of the text.
  std::array<char, 256> origin{};

  /// Record of the initial calibration. `origin` is copied, cut at a whole UTF-8 character; `cause`
  /// is a constant.
  [[nodiscard]] static CalibrationRecord begin(const RigCalibration& rig, Stamp stamp,
                                               const char* cause, std::string_view origin) noexcept;
  [[nodiscard]] std::string_view cause_name() const noexcept {
    return decided ? to_string(cause) : began_as;
  }
  /// Reason of the decision, or origin of the initial calibration.
  [[nodiscard]] const char* why() const noexcept { return decided ? reason : origin.data(); }
};

/// Columns of poses.csv, in this order.
inline constexpr const char* kPosesHeader =
    "frame,stamp_ns,state,status,reason,x,y,z,qx,qy,qz,qw,east,north,up,latitude_deg,longitude_deg,"
    "height_m,heading_deg,"
    "ins_east,ins_north,ins_up,ins_latitude_deg,ins_longitude_deg,ins_height_m,ins_heading_deg,"
    "error_east_m,error_north_m,error_up_m,error_heading_deg,inliers,reprojection_px,estimate_ms";
/// Formats the line of poses.csv (kPosesHeader), end of line included; replaces the content of
/// *line.
void format_pose_row(const FrameReport& report, std::string* line);
/// Formats a line of a TUM file: the stamp in seconds, position, quaternion.
void format_tum(Stamp stamp, const Transform& T, std::string* line);

/// Formats the line of calibrations.csv (kCalibrationsHeader) for camera k, 1 ≤ k < cameras, with
/// its end. Allocates only if *line is too small.
void format_calibration(const CalibrationRecord& calibration, int k, std::string* line);

/// Formats a line of events.jsonl with its end: `stamp_ns`, `kind`, `message`, `fields`. Invalid
/// UTF-8, as in file names, becomes U+FFFD to keep the JSON valid. Allocates only if *line is too
/// small.
void format_event(const EventRecord& event, std::string* line);

}  // namespace vergence::app
