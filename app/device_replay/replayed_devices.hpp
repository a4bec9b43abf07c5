#pragma once
#include <memory>
#include <string>
#include <vector>

#include "app/config/configuration.hpp"
#include "app/datasets/device_recording.hpp"
#include "app/datasets/recorded_ins.hpp"
#include "app/device_replay/recorded_camera.hpp"
#include "app/device_replay/recorded_line.hpp"
#include "app/recording/session_description.hpp"
#include "drivers/acquisition/acquisition.hpp"

namespace vergence::app {

/// What of a recorded drive's devices is replayed.
struct ReplayedDrive {
  const SessionDescription& description;
  const DeviceRecording& recording;
  const std::vector<RecordedReading>& readings;  // for an INS whose line was not recorded
  std::string name;                              // of the session, for sentences
};

/// The devices of a recorded drive for an Acquisition: INS and board are the real drivers on their
/// recorded lines, where those were recorded, else what they had handed out; cameras are always
/// that.
///
///     ReplayedDevices devices(configuration, drive, pixels);
///     Acquisition acquisition(devices.cameras(), devices.ins(), devices.trigger(),
///                             devices.acquisition_options());
///
/// Ownership  The recording outlives it, it outlives the Acquisition. Threads: one caller.
/// Errors     The constructor throws InputError: devices were not recorded, a driver does not find
///            its device in the recorded conversation.
class ReplayedDevices {
 public:
  /// `pixels`: of frame i of camera k.
  using Pixels = std::function<ImageView(std::size_t camera, std::size_t frame)>;

  ReplayedDevices(const Configuration& configuration, const ReplayedDrive& drive,
                  const Pixels& pixels);

  [[nodiscard]] std::vector<CameraDevice*> cameras() const;
  [[nodiscard]] InsDevice* ins() const noexcept { return ins_.get(); }  // null: none
  [[nodiscard]] TriggerDevice* trigger() const noexcept { return trigger_.get(); }
  /// In virtual time, on the clock of the recording's stamps.
  [[nodiscard]] const Acquisition::Options& acquisition_options() const noexcept {
    return options_;
  }
  /// Null: not on a line. When its device is stopped.
  [[nodiscard]] const LineReplayCounters* ins_line() const noexcept {
    return ins_place_ != nullptr ? &ins_place_->counters() : nullptr;
  }
  [[nodiscard]] const LineReplayCounters* board_line() const noexcept {
    return board_place_ != nullptr ? &board_place_->counters() : nullptr;
  }

 private:
  void open_ins(const Configuration& configuration, const ReplayedDrive& drive);
  void open_trigger(const Configuration& configuration, const ReplayedDrive& drive);

  std::vector<DeviceStep<InsReading>> readings_;
  std::vector<std::unique_ptr<RecordedCamera>> cameras_;
  std::unique_ptr<InsDevice> ins_;
  std::unique_ptr<TriggerDevice> trigger_;
  const RecordedPlace* ins_place_ = nullptr;    // in ins_
  const RecordedPlace* board_place_ = nullptr;  // in trigger_
  Acquisition::Options options_;
};

}  // namespace vergence::app
