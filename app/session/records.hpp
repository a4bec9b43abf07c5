#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include "core/comparison/comparison.hpp"
#include "core/estimator/estimator.hpp"
#include "core/types/calibration.hpp"
#include "core/types/calibration_decision.hpp"
#include "core/types/pose_sample.hpp"
#include "core/types/rig_frame.hpp"
#include "core/types/stamped_pose.hpp"

/// Input of a session's observers: plain values of fixed size, made on the estimator's thread
/// without heap, copied through rings.
namespace vergence::app {

/// A file that grows by whole lines, also over a disk that is full for a while.
///
/// Lines are buffered until flush(). What the system does not take stays in the buffer and is
/// written by a later flush(), to the same open file. Lines that find the buffer full are refused
/// and counted, so the file never lacks a line's end in the middle.
///
/// Not thread-safe. Memory  A buffer of `pending` bytes, taken by the constructor.
/// Errors   The constructor throws InputError. Afterwards nothing throws: see fault().
class LineFile {
 public:
  static constexpr std::size_t kPending = std::size_t{1} << 20;  // bytes: minutes of poses

  /// Opens for appending; made when it is not there. `pending`: bytes that may wait.
  explicit LineFile(const std::filesystem::path& file, std::size_t pending = kPending);
  ~LineFile();
  LineFile(const LineFile&) = delete;
  LineFile& operator=(const LineFile&) = delete;

  /// Takes a line, end of line included; flushed first if the buffer is full. False: refused and
  /// counted.
  bool append(std::string_view line);
  /// Hands the buffer to the system. False: not all was taken; fault() says why.
  bool flush();
  /// Asks the system to begin writing to the disk, and does not wait. Without it the kernel begins
  /// after 30 s (vm.dirty_expire_centisecs), which a power cut would cost.
  void write_back() noexcept;
  /// flush(), then asks the system to put it on the disk, and closes. Twice is harmless.
  bool close();

  /// Simulates a disk without room, until called with false.
  void pretend_full(bool full) noexcept { pretend_full_ = full; }

  /// errno of the last flush() or close(); 0: it succeeded.
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

/// Counts up to a frame, so that they stay true for a reader that misses frames.
struct FrameCounts {
  std::uint64_t read = 0, ok = 0, degraded = 0, lost = 0;
  std::uint64_t skipped = 0;  // not read, for instance because the image file is broken
  std::uint64_t missing = 0;  // numbers of frames that never came
  double path_m = 0;          // sum of the steps between successive poses
};

/// Report of one frame: its input but for the images, its pose, also in ENU beside the INS where
/// there is one, and its times. format_frame() makes the line of poses.csv of it; unless lost, it
/// is a line of trajectory.tum, too.
struct FrameReport : ComparedPose {
  FrameCounts counts{};
  Duration stamp_error{}, spread{};  // as in RigFrame
  Pairing pairing = Pairing::assumed;
  int cameras = 0;
  std::uint8_t images_present = 0;  // mask by camera
  HostStamp estimated{};            // when the estimator was done
  float decode_ms = 0;
  /// The reference's pose of the left camera, in the reference's own frame.
  std::optional<Transform> T_reference_left{};

  /// Adds the comparison with the INS, which becomes the reference.
  void set_comparison(const ComparedPose& with_ins) noexcept;
  /// ours − INS: east, north, up, m; heading, deg clockwise. Meaningful where `compared`.
  [[nodiscard]] std::array<double, 4> error() const noexcept;
};

/// A number or a constant word beside an event's message. `name` null: not used.
struct EventField {
  const char* name = nullptr;
  std::variant<std::int64_t, double, const char*> value{std::int64_t{0}};
};

/// A line of events.jsonl. `kind` and the fields' names point to constants.
struct EventRecord {
  Stamp stamp{};
  const char* kind = "";
  /// Ends with 0.
  std::array<char, 256> message{};
  std::array<EventField, 4> fields{};

  /// Cut at the array's end, at a whole UTF-8 character.
  void set_message(std::string_view text) noexcept;
  /// Formats the message without heap.
  template <class... Arguments>
  [[nodiscard]] static EventRecord make(Stamp stamp, const char* kind,
                                        fmt::format_string<Arguments...> format,
                                        Arguments&&... arguments) noexcept {
    std::array<char, 256> text;
    const char* end =
        fmt::format_to_n(text.data(), text.size(), format, std::forward<Arguments>(arguments)...)
            .out;
    EventRecord event;
    event.stamp = stamp;
    event.kind = kind;
    event.set_message({text.data(), static_cast<std::size_t>(end - text.data())});
    return event;
  }
  [[nodiscard]] static EventRecord of(const EstimatorEvent& event) noexcept;
};

/// A calibration that was accepted or rejected, or that the drive began with: a line of
/// calibrations.csv for every camera but the left one.
struct CalibrationRecord : CalibrationDecision {
  /// Decided while driving; false for the initial calibration.
  bool decided = true;
  /// Source of the initial calibration: `given`, `state_file` …, a constant.
  const char* began_as = "";
  /// Where it is from, if the drive began with it; ends with 0. A copy: the owner of a record may
  /// outlive the source that has the text.
  std::array<char, 256> origin{};

  /// Record of the initial calibration. `origin` is copied, cut at the array's end, at a whole
  /// UTF-8 character; `cause` is a constant.
  [[nodiscard]] static CalibrationRecord begin(const RigCalibration& rig, Stamp stamp,
                                               const char* cause, std::string_view origin) noexcept;
  [[nodiscard]] std::string_view cause_name() const noexcept {
    return decided ? to_string(cause) : began_as;
  }
  /// The decision's reason, or the origin of what the drive began with.
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
void format_frame(const FrameReport& report, std::string* line);
/// Formats a line of a TUM file: the stamp in seconds, position, quaternion.
void format_tum(Stamp stamp, const Transform& T, std::string* line);

/// The line of calibrations.csv (kCalibrationsHeader) of camera k, 1 ≤ k < cameras, end of line
/// included.
///
/// Memory  None where the capacity of *line is enough.
void format_calibration(const CalibrationRecord& calibration, int k, std::string* line);

/// A line of events.jsonl, end of line included: `stamp_ns`, `kind`, `message`, `fields`. Bytes
/// that are no UTF-8, which file names may hold, become U+FFFD: the line stays JSON.
///
/// Memory  None where the capacity of *line is enough.
void format_event(const EventRecord& event, std::string* line);

}  // namespace vergence::app
