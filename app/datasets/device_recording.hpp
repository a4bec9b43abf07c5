#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "app/recording/device_records.hpp"
#include "app/recording/session_description.hpp"
#include "drivers/camera.hpp"
#include "drivers/trigger.hpp"

/// What `record: [pulses, raw]` wrote of a drive's devices. Host times are stamps of the session's
/// clock, as if that were the host's: only their differences matter.
namespace vergence::app {

[[nodiscard]] inline HostStamp host_of(Stamp stamp) noexcept { return HostStamp(stamp.ns()); }

/// What a device handed out, or that it was gone: then value.arrival says when.
template <class Value>
struct DeviceStep {
  bool gone = false;
  Value value{};
};

/// A serial line from beginning to end.
struct LineRecord {
  struct Step {
    LineEvent event{};  // without its bytes
    std::size_t from = 0, size = 0;
  };
  std::vector<Step> steps{};
  std::vector<std::uint8_t> bytes{};

  [[nodiscard]] std::span<const std::uint8_t> bytes_of(const Step& step) const noexcept {
    return std::span(bytes).subspan(step.from, step.size);
  }
  void add(const LineEvent& event);
};

/// Memory  60 bytes a frame, 150 a pulse, 60 a read beside its bytes.
struct DeviceRecording {
  std::array<std::vector<DeviceStep<Frame>>, kMaxCameras> cameras{};
  std::vector<DeviceStep<Pulse>> pulses{};
  LineRecord ins{}, board{};
  std::vector<SetArrivals> sets{};  // that the estimator was given, numbers ascending
  std::size_t damaged = 0;          // messages that are none

  /// Arrival of the last frame or pulse that was taken: what lines brought after it came too late.
  [[nodiscard]] HostStamp end() const noexcept;
};

/// Of a session's folder. InputError: no recording, more of anything than is held.
[[nodiscard]] DeviceRecording read_device_recording(const std::filesystem::path& folder,
                                                    const SessionDescription& description);

}  // namespace vergence::app
