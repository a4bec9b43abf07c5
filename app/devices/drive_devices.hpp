#pragma once
#include <span>

#include "app/devices/camera_drivers.hpp"
#include "app/devices/mock_drive.hpp"
#include "app/devices/serial_devices.hpp"
#include "drivers/acquisition/acquisition.hpp"

namespace vergence::app {

/// Devices of a run, configured and ready to start: a simulated rig, or real ones. Owns cameras,
/// INS and trigger; must outlive the Acquisition that uses them. One caller.
class DriveDevices {
 public:
  /// Throws InputError with the key, or the device and what it supports; DeviceError if a device is
  /// missing or does not respond. `fast` selects virtual time, for the mock only.
  DriveDevices(const Configuration& configuration, const std::vector<std::string>& faults,
               bool fast, std::optional<double> duration_s);

  [[nodiscard]] const std::vector<CameraDevice*>& cameras() const noexcept { return cameras_; }
  /// Real cameras with their applied configurations; empty for a mock.
  [[nodiscard]] const std::vector<OpenedCamera>& opened() const noexcept { return opened_; }
  /// Null if there is no INS.
  [[nodiscard]] InsDevice* ins() const noexcept { return ins_; }
  /// Null if there are no pulses, or they come from elsewhere.
  [[nodiscard]] TriggerDevice* trigger() const noexcept { return trigger_; }
  [[nodiscard]] const SyncOptions& sync() const noexcept { return sync_; }
  /// Options of an acquisition of these devices; the others have defaults.
  [[nodiscard]] Acquisition::Options acquisition_options() const {
    return {.sync = sync_, .wait_when_full = fast_};
  }

  /// Driver of a trigger board on a serial link; null if there is none.
  [[nodiscard]] const trigger_board::Device* board() const noexcept { return board_.get(); }
  /// Messages about limitations.
  [[nodiscard]] const std::vector<std::string>& remarks() const noexcept { return remarks_; }

  /// Null for real devices.
  [[nodiscard]] const mock::MockRig* mock() const noexcept { return mock_.get(); }
  /// Faults scheduled in the mock.
  [[nodiscard]] std::span<const mock::Fault> faults() const noexcept;
  /// Start of the run; in real time the simulated rig sets it when started.
  [[nodiscard]] HostStamp start() const noexcept { return mock_ ? mock_->start() : start_; }
  /// Number of rig frames of the whole run; 0 if unknown.
  [[nodiscard]] std::uint64_t frames() const noexcept { return frames_; }
  /// Image memory of simulated cameras; unknown for real ones.
  [[nodiscard]] std::size_t image_bytes() const noexcept {
    return mock_ ? mock_->image_bytes() : 0;
  }

 private:
  void open_real(const Configuration& configuration);

  std::unique_ptr<mock::MockRig> mock_;
  std::vector<OpenedCamera> opened_;
  std::unique_ptr<InsDevice> opened_ins_;
  std::unique_ptr<TriggerDevice> software_;
  std::unique_ptr<trigger_board::Device> board_;
  std::vector<CameraDevice*> cameras_;
  InsDevice* ins_ = nullptr;
  TriggerDevice* trigger_ = nullptr;
  SyncOptions sync_;
  // True for virtual time.
  bool fast_ = false;
  std::vector<std::string> remarks_;
  std::uint64_t frames_ = 0;
  HostStamp start_{};
};

/// Calls Acquisition::start(); throws as refuse_device() for a device that fails to start.
void start_acquisition(Acquisition* acquisition, PulseObserver* observer = nullptr);

}  // namespace vergence::app
