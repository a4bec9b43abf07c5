#pragma once
#include "app/config/calibration_file.hpp"
#include "app/runtime/queue_thread.hpp"
#include "app/session/session_observer.hpp"
#include "app/session/session_totals.hpp"

namespace vergence::app {

/// Columns of calibrations.csv: rotation vectors and their sigmas in rad, lengths in m, image
/// values in px; `sigma_` by noise alone, `sigma_total_` including uncertain intrinsics. d0 … d3
/// are k1 k2 p1 p2, or k1 … k4 of an equidistant lens. The latency is in frames since the alarm,
/// the request or the start; held-out errors are medians before and after. Outcome `unchanged`
/// means that the measurement was no better than the calibration in use. The last five columns are
/// those of CalibrationDecision.
inline constexpr const char* kCalibrationsHeader =
    "stamp_ns,outcome,cause,reason,frames,latency_frames,onset_frame,reprojection_px,held_out_"
    "before_px,held_out_after_px,scale_sigma,camera,rx,ry,rz,tx,ty,tz,sigma_rx,sigma_ry,sigma_rz,"
    "sigma_tx,sigma_ty,sigma_tz,sigma_total_rx,sigma_total_ry,sigma_total_rz,sigma_total_tx,sigma_"
    "total_ty,sigma_total_tz,fx,fy,cx,cy,sigma_fx,sigma_fy,sigma_cx,sigma_cy,d0,d1,d2,d3,sigma_d0,"
    "sigma_d1,sigma_d2,sigma_d3,left_d0,left_d1,left_d2,left_d3,sigma_left_d0,sigma_left_d1,sigma_"
    "left_d2,sigma_left_d3,reference_depth_m,depth_sigma_percent,depth_error_percent,verified";

/// Writes the calibrations of a session: a line of calibrations.csv for each, calibration.yaml with
/// the one in use, and the state file for the next run. The state file gets an estimated
/// calibration, or the initial one once verified.
///
/// Threads  One producer calls on_…(), one consumer next(). A separate thread (`vergence-state`)
///          writes the files, because YAML allocates and a disk may block.
/// Memory   Fixed for the producer.
/// Full     A producer of a replay waits. In a live run the calibration is dropped and counted.
/// Errors   The constructor throws InputError. Later failures are an event, or a fault of
///          close().
class CalibrationWriter final : public SessionObserver {
 public:
  struct Options {
    /// Directory of the session.
    std::filesystem::path session{};
    /// Names, serials, configured values and source.
    CalibrationFile content{};
    /// Empty if the next run must not use it.
    std::optional<std::filesystem::path> state{};
    WhenFull when_full = WhenFull::drop;
  };

  explicit CalibrationWriter(Options options);
  ~CalibrationWriter() override { thread_.stop(); }

  void on_event(const EventRecord& event) noexcept override {
    if (std::string_view(event.kind) == "calibration_verified") post(event.stamp);
  }

  void on_calibration(const CalibrationRecord& calibration) noexcept override { post(calibration); }

  /// Pops the oldest event about writing the state file: `calibration_saved`, or
  /// `calibration_save_failed`. Returns false if there is none.
  [[nodiscard]] bool next(EventRecord* event) noexcept { return events_.pop(event); }
  /// Writes the pending data, and calibration.yaml with the calibration in use at the end (null if
  /// there is none). Messages about incomplete files go to *faults. Call once, after the last
  /// on_…().
  void close(const RigCalibration* in_use, std::vector<std::string>* faults);

  /// Valid after close().
  [[nodiscard]] const CalibrationTotals& totals() const noexcept { return totals_; }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }
  /// Bytes allocated at construction.
  [[nodiscard]] std::size_t memory() const noexcept { return sizeof *this + lines_.pending(); }

 private:
  // Sufficient, because calibrations are seconds apart.
  static constexpr std::size_t kMaxWaiting = 8;
  // A Stamp means that the calibration in use was verified then.
  using Item = std::variant<CalibrationRecord, Stamp>;

  void post(const Item& item) noexcept {
    if (!thread_.post(item)) ++dropped_;
  }

  void process(const Item& item);
  void write(const CalibrationRecord& calibration);
  void write(Stamp verified);
  void keep(Stamp stamp, const RigCalibration& rig, bool found);
  void write_session_file(const RigCalibration& rig);

  const Options options_;
  LineFile lines_;
  Ring<EventRecord, 2 * kMaxWaiting> events_;
  // Counted by the producer.
  std::uint64_t dropped_ = 0;

  // Used by the writer's thread, and by the owner after joining it.
  std::string line_;
  // Initial calibration.
  std::optional<RigCalibration> unverified_{};
  // Fault of calibration.yaml; empty if it is complete.
  std::string fault_;
  CalibrationTotals totals_{};
  QueueThread<Item, kMaxWaiting> thread_;
};

}  // namespace vergence::app
