#pragma once
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/config/configuration.hpp"
#include "app/devices/camera_drivers.hpp"
#include "app/devices/mock_drive.hpp"
#include "app/devices/serial_devices.hpp"
#include "drivers/acquisition/acquisition.hpp"
#include "drivers/sync/rig_synchronizer.hpp"
#include "drivers/trigger_board/device.hpp"

namespace vergence::app {

/// The devices of a drive, configured and ready to start: a mock's rig, or cameras that exist.
///
/// Ownership  Cameras, INS and trigger live in it and outlive the Acquisition that uses them.
///            Threads: one caller.
class DriveDevices {
 public:
  /// InputError names the key, or the device and what it offers; DeviceError a device that is not
  /// there or does not answer. `fast`: virtual time, mock only.
  DriveDevices(const Configuration& configuration, const std::vector<std::string>& faults,
               bool fast, std::optional<double> duration_s);

  [[nodiscard]] const std::vector<CameraDevice*>& cameras() const noexcept { return cameras_; }
  /// Real cameras with what they made of their configuration; empty: a mock's.
  [[nodiscard]] const std::vector<OpenedCamera>& opened() const noexcept { return opened_; }
  [[nodiscard]] InsDevice* ins() const noexcept { return ins_; }  // null: none
  [[nodiscard]] TriggerDevice* trigger() const noexcept {
    return trigger_;
  }  // null: pulses come from elsewhere, or none
  [[nodiscard]] const SyncOptions& sync() const noexcept { return sync_; }
  /// Options of an acquisition of these devices; the rest are defaults.
  [[nodiscard]] Acquisition::Options acquisition_options() const;
  /// The driver of a board on a line; null: there is none.
  [[nodiscard]] const trigger_board::Device* board() const noexcept { return board_.get(); }
  /// Sentences about what works, but not as well as it should.
  [[nodiscard]] const std::vector<std::string>& remarks() const noexcept { return remarks_; }

  /// Null: the devices are real.
  [[nodiscard]] const mock::MockRig* mock() const noexcept { return mock_.rig.get(); }
  /// Scheduled in the mock.
  [[nodiscard]] std::span<const mock::Fault> faults() const noexcept;
  /// When the drive begins; in real time the simulated rig sets it at the start.
  [[nodiscard]] HostStamp start() const noexcept;
  /// Rig frames of the whole drive; 0 if unknown.
  [[nodiscard]] std::uint64_t frames() const noexcept { return frames_; }
  /// Image memory of simulated cameras; unknown for real ones.
  [[nodiscard]] std::size_t image_bytes() const noexcept {
    return mock_.rig ? mock_.rig->image_bytes() : 0;
  }

 private:
  void open_real(const Configuration& configuration);

  MockDrive mock_;
  std::vector<OpenedCamera> opened_;
  std::unique_ptr<InsDevice> opened_ins_;
  std::unique_ptr<TriggerDevice> software_;
  std::unique_ptr<trigger_board::Device> board_;
  std::vector<CameraDevice*> cameras_;
  InsDevice* ins_ = nullptr;
  TriggerDevice* trigger_ = nullptr;
  SyncOptions sync_;
  bool fast_ = false;  // virtual time
  std::vector<std::string> remarks_;
  std::uint64_t frames_ = 0;
  HostStamp start_{};
};

/// Acquisition::start(); refuse_device() names the device that cannot be started.
void start_acquisition(Acquisition* acquisition, PulseObserver* observer = nullptr);

}  // namespace vergence::app
