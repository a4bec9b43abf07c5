#pragma once
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "app/recorder/calibration_keeper.hpp"
#include "app/recorder/histogram.hpp"
#include "app/recorder/ins_file.hpp"
#include "app/recorder/records.hpp"
#include "core/memory/ring.hpp"
#include "drivers/common/wake_event.hpp"

namespace vergence::app {

class LineFile;

/// What poses.csv has, in this order (DESIGN §6).
inline constexpr const char* kPosesHeader =
    "frame,stamp_ns,state,status,reason,x,y,z,qx,qy,qz,qw,east,north,up,latitude_deg,longitude_deg,"
    "height_m,heading_deg,"
    "ins_east,ins_north,ins_up,ins_latitude_deg,ins_longitude_deg,ins_height_m,ins_heading_deg,"
    "error_east_m,error_north_m,error_up_m,error_heading_deg,inliers,reprojection_px,estimate_ms";
/// What calibrations.csv has: rotation vectors and their sigmas in rad, lengths in m, `sigma_` by
/// noise alone, `wide_` with uncertain intrinsics, pixels; d0 … d3 are k1 k2 p1 p2, or k1 … k4 of
/// an equidistant lens. Latency in frames since the alarm, the request or the start; held-out
/// errors are medians before and after. `kept`: what the drive measured is no better than what is
/// in use. The last five are those of CalibrationDecision.
inline constexpr const char* kCalibrationsHeader =
    "stamp_ns,outcome,cause,reason,frames,latency_frames,onset_frame,reprojection_px,held_out_"
    "before_px,held_out_after_px,scale_sigma,"
    "camera,rx,ry,rz,tx,ty,tz,sigma_rx,sigma_ry,sigma_rz,sigma_tx,sigma_ty,sigma_tz,wide_rx,wide_"
    "ry,wide_rz,wide_tx,wide_ty,wide_tz,"
    "fx,fy,cx,cy,sigma_fx,sigma_fy,sigma_cx,sigma_cy,d0,d1,d2,d3,sigma_d0,sigma_d1,sigma_d2,sigma_"
    "d3,"
    "left_d0,left_d1,left_d2,left_d3,sigma_left_d0,sigma_left_d1,sigma_left_d2,sigma_left_d3,"
    "judged_depth_m,depth_sigma_percent,depth_difference_percent,verified,lenses";

/// Makes the folder of a session. InputError: it exists and is not empty, is no folder, or cannot
/// be made.
void make_session_folder(const std::filesystem::path& folder);

/// One attempt to calibrate while driving.
struct CalibrationAttempt {
  Stamp stamp{};
  std::string_view cause{}, reason{};  // CalibrationCause's word; why it was rejected: constants
  bool accepted = false;
  int latency_frames = 0, frames = 0;
  double solve_ms = 0;
};

/// The calibration in use was not that of the rig.
struct Contradiction {
  Stamp stamp{};
  double depth_percent = 0;  // by which its depths were off
};

/// Frames whose time was over before their work was done (docs/realtime.md), and what was left out.
struct WorkDropped {
  std::uint64_t frames = 0, points = 0, keyframes = 0, steps = 0, windows = 0;

  void add(const FrameEffort& effort) noexcept;
};

/// What a session has come to: for summary.json.
struct SessionTotals {
  std::uint64_t read = 0, ok = 0, degraded = 0, lost = 0;  // frames
  TimeHistogram estimate, decode;                          // ms
  TimeHistogram calibrating;  // ms, of the frames in other states than stereo_odometry and lost
  std::array<TimeHistogram, kStages> stages;
  std::vector<CalibrationAttempt> attempts;  // the newest kMostAttempts
  std::uint64_t accepted = 0, rejected = 0;  // of all of them
  std::optional<Stamp> confirmed{};  // when the drive first confirmed the calibration in use
  std::optional<std::uint64_t> confirmed_frame{};  // the frame of that stamp
  std::optional<Contradiction>
      contradicted{};                   // the first time that it showed another one than was in use
  double path_m = 0;                    // sum of the steps between successive poses
  std::vector<StampedPose> trajectory;  // if asked for: the poses of trajectory.tum, read back
  std::vector<StampedPose> reference;   // if asked for: of reference.tum, in its own frame
  std::vector<PoseStatus> statuses;   // if asked for: of every frame read, as far as there is room;
                                      // those that are not lost have their pose in trajectory
  std::uint64_t dropped_records = 0;  // the ring was full (live only)
  std::uint64_t dropped_readings = 0;  // theirs was
  std::uint64_t lost_lines = 0;        // the disk took no more
  WorkDropped work_dropped{};
  std::size_t ring_high_water = 0;
  std::vector<std::string> faults;  // a sentence for each file that is not whole
};

/// Frames whose status SessionTotals keeps where nobody knows the drive's length: 58 h at 20 Hz.
inline constexpr std::size_t kMostStatuses = std::size_t{1} << 22;
inline constexpr std::size_t kMostAttempts = 1000;  // in summary.json; calibrations.csv has all

/// Writes trajectory.tum, reference.tum (gone at the end if there was no reference), poses.csv,
/// calibrations.csv, events.jsonl and, with an INS, ins.csv of a session as it goes on, on a thread
/// of its own: the estimator never waits for a disk.
///
///     make_session_folder("sessions/monday");
///     Recorder recorder("sessions/monday", {});
///     recorder.post(PoseRecord::of(sample, 0, std::nullopt));  // of each frame
///     const std::unique_ptr<SessionTotals> totals = recorder.close();
///
/// What has been posted is in the files as soon as the thread comes to it, at the latest after a
/// second, so a killed session keeps its lines. Stamps are printed from their integers. The same
/// records give the same bytes.
/// Threads  post(): one producer. take_errors(): one consumer. close(): the owner's, after the last
///          post(). The recorder's own is sealed: what takes heap memory is done by others.
/// Memory   Fixed, whatever the length of the drive; with keep_trajectory a byte for every frame
///          expected, or for kMostStatuses. close() reads the trajectories back from their files.
/// Full     wait: the producer waits (replay). drop: the record is dropped and counted (live).
///          Readings have a ring of their own: they never push out a pose.
/// Errors   The constructor throws InputError. A disk that takes no more: a complaint and an event
///          `disk_full`, the session goes on, see LineFile; an event `disk_room` when it takes
///          lines again says what was lost. Lines lost in between leave the session usable and are
///          a complaint of close(); a file that could not be ended is a fault of its totals.
class Recorder {
 public:
  enum class WhenFull : std::uint8_t { wait, drop };
  struct Options {
    WhenFull when_full = WhenFull::wait;
    bool keep_trajectory = true;
    std::size_t expected_frames = 0;  // 0: nobody knows
    bool ins = false;                 // readings are posted: ins.csv is there
    /// Called on a thread of its own with every calibration that was accepted while driving: files
    /// may be written there. May be empty.
    std::function<Kept(const RigCalibration&)> keep{};
    /// Whether the disk is to be taken for full at this time of the drive, which a mock's fault
    /// says. Called on the recorder's thread with the stamp of every pose. May be empty.
    std::function<bool(Stamp)> disk_full{};
  };

  /// `folder` exists: make_session_folder().
  Recorder(const std::filesystem::path& folder, const Options& options);
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  void post(const Record& record) noexcept;
  /// Precondition: Options::ins.
  void post(const InsRecord& reading) noexcept;
  /// Bytes taken at the beginning: lines that may wait, statuses of the frames expected.
  [[nodiscard]] std::size_t memory() const noexcept { return memory_; }
  /// Opens every file anew by its name, tables with their heads, as soon as the recorder's thread
  /// comes to it; an event `files_reopened`. Any thread.
  void reopen() noexcept;
  /// Sentences about the disk since the last call.
  [[nodiscard]] std::vector<std::string> take_errors();
  /// Writes what is waiting, closes the files. Once.
  [[nodiscard]] std::unique_ptr<SessionTotals> close();

 private:
  static constexpr std::size_t kRing = 128;       // records: seconds of frames with their events
  static constexpr std::size_t kReadings = 1024;  // 2.5 s of the fastest INS

  template <class Value, std::size_t N>
  bool push(Ring<Value, N>* ring, std::atomic<std::uint64_t>* dropped, const Value& value) noexcept;
  void work();
  bool take();
  bool take_outcome();
  void write(const PoseRecord& pose);
  void write(const EventRecord& event);
  void write(const CalibrationRecord& calibration);
  void write(const InsRecord& reading);
  void note(const CalibrationRecord& calibration);
  void note(const EventRecord& event);
  void match_confirmed();
  void flush();
  void reopen_files();
  void pretend(Stamp stamp);
  void note_disk(bool full);
  [[nodiscard]] std::uint64_t lost_lines() const;
  void stop_and_join() noexcept;
  using Complaint = std::array<char, 512>;  // ends with 0, cut at the array's end
  void complain(const LineFile& file);
  template <class... Arguments>
  void complain(const char* format, const Arguments&... arguments) noexcept;
  void read_back();

  struct Files;
  Options options_;
  std::unique_ptr<Files> files_;
  std::unique_ptr<SessionTotals> totals_;
  PoseNumbers last_pose_{};
  bool have_last_pose_ = false, any_reference_ = false;
  std::string line_;    // being formatted
  std::string folder_;  // for sentences
  std::size_t memory_ = 0;
  Stamp newest_{};  // of the poses
  std::uint64_t newest_frame_ = 0;
  bool disk_full_ = false, pretended_ = false;

  Ring<Record, kRing> ring_;
  Ring<InsRecord, kReadings> readings_;
  WakeEvent filled_, freed_;
  std::atomic<bool> stop_{false}, reopen_{false};
  std::atomic<std::uint64_t> dropped_{0}, dropped_readings_{0};
  std::size_t high_water_ = 0;                 // the producer's
  Ring<Complaint, 16> complaints_;             // full: the newest are lost
  std::vector<std::string> errors_;            // of close()
  std::unique_ptr<CalibrationKeeper> keeper_;  // null: nothing is kept
  std::thread thread_;
};

}  // namespace vergence::app
