#pragma once
#include <functional>
#include <string>
#include <vector>

#include "app/config/configuration.hpp"
#include "app/devices/drive_devices.hpp"
#include "app/runtime/signals.hpp"

namespace vergence::app {

/// One synchronised set, while its images are there.
struct TakenSet {
  int index = 0;  // 0, 1, …
  Stamp stamp{};
  Duration stamp_error{}, spread{};
  SyncProof proof = SyncProof::counted;
  std::vector<ImageView> images;  // by camera
};

/// What came of waiting for them.
struct Taking {
  enum class End : std::uint8_t { done, timeout, interrupted } end = End::timeout;
  int sets = 0;                          // complete ones that were handed on
  std::vector<std::uint64_t> delivered;  // images by camera, also those of incomplete sets
  std::vector<bool> gone;                // by camera, at the end
};

struct TakingOptions {
  int count = 1;
  int skip = 0;  // complete sets passed over first: the first exposures after a start may be
                 // another's, or dark
  Duration limit = Duration::seconds(5);  // for the first set, and between two
};

/// Starts the devices and hands on complete sets. The devices are stopped when it returns.
///
/// Of the INS only the pulses are used, where it makes them.
/// Threads  `use` on the caller's. Time: `limit` a set, and what starting and stopping take.
///          Errors: InputError as start_acquisition(), and
/// what `use` throws.
[[nodiscard]] Taking take_sets(DriveDevices& devices, const TakingOptions& options,
                               const SignalGuard& signals,
                               const std::function<void(const TakenSet&)>& use);

}  // namespace vergence::app
