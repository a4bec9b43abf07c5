#include "app/session/calibration_writer.hpp"

#include <cstring>

#include "app/config/calibration_state.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

// Bytes for about 300 lines.
constexpr std::size_t kPending = std::size_t{1} << 18;

}  // namespace

CalibrationWriter::CalibrationWriter(Options options)
    : options_(std::move(options)),
      lines_(options_.session / "calibrations.csv", kPending),
      thread_(options_.when_full) {
  totals_.attempts.reserve(kMaxAttempts);
  lines_.append(std::string(kCalibrationsHeader) + "\n");
  thread_.start(
      "vergence-state", [this] { (void)lines_.flush(); },
      [this](const Item* item) {
        if (item != nullptr) process(*item);
      });
}

void CalibrationWriter::process(const Item& item) {
  std::visit([this](const auto& value) { write(value); }, item);
  (void)lines_.flush();
  lines_.write_back();
}

void CalibrationWriter::write(const CalibrationRecord& c) {
  for (int k = 1; k < c.calibration.cameras; ++k) {
    format_calibration(c, k, &line_);
    lines_.append(line_);
  }
  if (!c.decided) {
    unverified_ = c.calibration;
    write_session_file(c.calibration);
  } else if (totals_.add(c)) {
    unverified_.reset();
    keep(c.stamp, c.calibration, true);
  }
}

void CalibrationWriter::write(Stamp verified) {
  if (!unverified_) return;
  keep(verified, *unverified_, false);
  unverified_.reset();
}

void CalibrationWriter::keep(Stamp stamp, const RigCalibration& rig, bool found) {
  // The next drive's first: the session's disk may stand still.
  std::string message;
  bool failed = false;
  if (options_.state) try {
      CalibrationFile file = options_.content;
      file.rig = rig;
      if (found) file.source = "online";
      write_state(*options_.state, file);
      message = "the calibration is saved for the next run: " + options_.state->string();
    } catch (const InputError& e) {
      failed = true;
      message = std::string(e.what()) + "; the next run will not use this calibration";
    }
  if (found) write_session_file(rig);
  if (found && !fault_.empty()) {
    failed = failed || !options_.state;
    message += (message.empty() ? "" : "; ") + fault_;
  }
  if (message.empty()) return;
  (void)events_.push({stamp, failed ? "calibration_save_failed" : "calibration_saved", message});
}

void CalibrationWriter::write_session_file(const RigCalibration& rig) {
  CalibrationFile file = options_.content;
  file.rig = rig;
  if (totals_.accepted > 0) file.source = "online";
  fault_.clear();
  try {
    write_calibration(options_.session / "calibration.yaml", file);
  } catch (const InputError& e) {
    fault_ = e.what();
  }
}

void CalibrationWriter::close(const RigCalibration* in_use, std::vector<std::string>* faults) {
  thread_.stop();
  if (in_use != nullptr) write_session_file(*in_use);
  if (!fault_.empty()) faults->push_back(fault_);
  lines_.close(faults);
}

}  // namespace vergence::app
