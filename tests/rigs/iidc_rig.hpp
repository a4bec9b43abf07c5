#pragma once

#include "drivers/camera.hpp"
#include "tests/rigs/emulator.hpp"

namespace vergence::test {

/// Data that an emulated camera wrote into row 0 of an image.
struct ImageStamp {
  bool valid = false;
  /// Number of the exposure.
  std::uint32_t number = 0;
  /// Middle of the exposure on CLOCK_MONOTONIC.
  std::int64_t middle_ns = 0;
  std::uint64_t guid = 0;
};
[[nodiscard]] ImageStamp read_stamp(ImageView image);
/// Returns true if every row shows the emulator's pattern of that exposure.
[[nodiscard]] bool shows_pattern(ImageView image, std::uint32_t number);

/// The GUIDs of the emulated cameras: the serials under which the drivers list them.
[[nodiscard]] std::string emulated_serial(unsigned camera);

/// 640 × 480 at 30 Hz, 4 ms.
[[nodiscard]] CameraConfiguration usual(CameraTrigger trigger = CameraTrigger::free);

/// One camera's account of what it delivered.
struct Account {
  std::uint64_t complete = 0, incomplete = 0;
  /// Gaps in the counters after the first frame.
  std::uint64_t gaps = 0;
  /// Complete frames with pixels, a number or a GUID of another frame.
  std::uint64_t wrong = 0;
  /// Middles of the exposures by the emulator.
  std::vector<std::int64_t> middles;
  /// Starts of the exposures by the camera's stamps.
  std::vector<std::int64_t> starts;
};

/// Takes frames from several cameras in turn, and holds each against what stands in it.
class FrameCollector {
 public:
  explicit FrameCollector(std::vector<CameraDevice*> cameras)
      : cameras_(std::move(cameras)), accounts_(cameras_.size()), counters_(cameras_.size(), -1) {}

  /// Until every camera has given so many more, or `limit` has passed. True: they have.
  bool read(std::uint64_t frames, Duration limit = Duration::seconds(20));
  /// Until nothing has come for `quiet`.
  void drain(Duration quiet = Duration::milliseconds(700));
  /// Before a restart: the counters begin anew.
  void restarted(std::size_t camera) { counters_[camera] = -1; }

  [[nodiscard]] const Account& account(std::size_t camera) const { return accounts_[camera]; }

 private:
  bool read_one(std::size_t camera, Duration limit);
  std::vector<CameraDevice*> cameras_;
  std::vector<Account> accounts_;
  std::vector<std::int64_t> counters_;
};

/// Opens and configures; fails the test with the message when it cannot.
[[nodiscard]] std::unique_ptr<CameraDevice> open_camera(CameraDriver* driver, unsigned camera,
                                                        const CameraConfiguration& requested);

/// Until the driver lists so many cameras; the kernel takes two seconds to forget those of an
/// emulator that ended.
bool await_cameras(CameraDriver* driver, std::size_t count, Duration limit = Duration::seconds(15));

/// start() until it is ok: what a supervisor does after `disconnected`.
[[nodiscard]] bool start_again(CameraDevice* camera, Duration limit = Duration::seconds(15));

/// Open descriptors of this process, and mappings of device files.
struct Holdings {
  std::size_t descriptors = 0, mappings = 0;
  [[nodiscard]] static Holdings now();
  [[nodiscard]] bool operator==(const Holdings&) const = default;
};

}  // namespace vergence::test
