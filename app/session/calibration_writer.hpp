#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "app/config/calibration_file.hpp"
#include "app/runtime/queue_thread.hpp"
#include "app/session/session_observer.hpp"
#include "app/session/session_totals.hpp"
#include "core/memory/ring.hpp"

namespace vergence::app {

/// Columns of calibrations.csv: rotation vectors and their sigmas in rad, lengths in m, `sigma_` by
/// noise alone, `sigma_total_` with uncertain intrinsics, pixels; d0 … d3 are k1 k2 p1 p2, or k1 …
/// k4 of an equidistant lens. Latency in frames since the alarm, the request or the start; held-out
/// errors are medians before and after. `kept`: what the drive measured is no better than what is
/// in use. The last five are those of CalibrationDecision.
inline constexpr const char* kCalibrationsHeader =
    "stamp_ns,outcome,cause,reason,frames,latency_frames,onset_frame,reprojection_px,held_out_"
    "before_px,held_out_after_px,scale_sigma,"
    "camera,rx,ry,rz,tx,ty,tz,sigma_rx,sigma_ry,sigma_rz,sigma_tx,sigma_ty,sigma_tz,sigma_total_rx,"
    "sigma_total_"
    "ry,sigma_total_rz,sigma_total_tx,sigma_total_ty,sigma_total_tz,"
    "fx,fy,cx,cy,sigma_fx,sigma_fy,sigma_cx,sigma_cy,d0,d1,d2,d3,sigma_d0,sigma_d1,sigma_d2,sigma_"
    "d3,"
    "left_d0,left_d1,left_d2,left_d3,sigma_left_d0,sigma_left_d1,sigma_left_d2,sigma_left_d3,"
    "reference_depth_m,depth_sigma_percent,depth_error_percent,verified";

/// Writes the calibrations of a session: a line of calibrations.csv for each, calibration.yaml with
/// the one in use, and the state file that the next drive starts from. The state file gets a
/// calibration that was estimated, or the initial one once it is verified.
///
/// Threads  on_…(): one producer. next(): one consumer. The files are written on a thread of its
///          own (`vergence-state`), because YAML takes heap memory and a disk may stand still.
/// Memory   Fixed for the producer.
/// Full     A producer that waits (replay) waits. A live one does not: the calibration is lost and
///          counted.
/// Errors   The constructor throws InputError. What fails later is an Outcome, or a fault of
///          close().
class CalibrationWriter final : public SessionObserver {
 public:
  struct Options {
    std::filesystem::path session{};  // its folder
    CalibrationFile content{};        // names and serials, what the configuration says, the source
    std::optional<std::filesystem::path> state{};  // nothing: the next drive is not to know
    WhenFull when_full = WhenFull::drop;
  };
  /// Outcome of writing the state file: the event `calibration_saved` or `calibration_save_failed`.
  struct Outcome {
    EventRecord event{};
    bool failed = false;
  };

  explicit CalibrationWriter(Options options);
  ~CalibrationWriter() override { thread_.stop(); }

  void on_event(const EventRecord& event) noexcept override;
  void on_calibration(const CalibrationRecord& calibration) noexcept override;
  /// Pops the oldest outcome. Returns false if there is none.
  [[nodiscard]] bool next(Outcome* outcome) noexcept { return outcomes_.pop(outcome); }
  /// Writes what waits and calibration.yaml with what is in use at the end, null: there is none.
  /// Messages about files that are not whole go to *faults. Once, after the last on_…().
  void close(const RigCalibration* in_use, std::vector<std::string>* faults);

  /// After close().
  [[nodiscard]] const CalibrationTotals& totals() const noexcept { return totals_; }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }
  /// Bytes taken at the beginning.
  [[nodiscard]] std::size_t memory() const noexcept { return sizeof *this + lines_.pending(); }

 private:
  static constexpr std::size_t kMaxWaiting = 8;  // they come seconds apart
  using Item =
      std::variant<CalibrationRecord, Stamp>;  // a Stamp: the calibration in use is verified then

  void post(const Item& item) noexcept;
  void take(const Item& item);
  void write(const CalibrationRecord& calibration);
  void write(Stamp verified);
  void keep(Stamp stamp, const RigCalibration& rig, bool found);
  void write_session_file(const RigCalibration& rig);

  const Options options_;
  LineFile lines_;
  Ring<Outcome, 2 * kMaxWaiting> outcomes_;
  std::uint64_t dropped_ = 0;  // of the producer

  // Used by the writer's thread, and by the owner after joining it.
  std::string line_;
  std::optional<RigCalibration> unverified_{};  // what the drive began with
  std::string fault_;                           // of calibration.yaml; empty: it is whole
  CalibrationTotals totals_{};
  QueueThread<Item, kMaxWaiting> thread_;
};

}  // namespace vergence::app
