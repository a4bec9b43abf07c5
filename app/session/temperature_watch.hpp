#pragma once
#include <array>
#include <mutex>
#include <optional>
#include <thread>

#include "app/session/frame_source.hpp"
#include "core/types/calibration.hpp"

namespace vergence::app {

/// Asks the cameras of a source for their temperatures every few seconds: they take minutes to warm
/// up. On a thread of its own, since one whose cable was pulled takes seconds to answer.
///
/// Ownership  The source outlives it. Threads: the caller's, and one from begin() on.
/// Errors     None: where no thread can be had there are no temperatures.
class TemperatureWatch {
 public:
  using Celsius = std::array<std::optional<double>, kMaxCameras>;

  explicit TemperatureWatch(FrameSource& source) : source_(source) {}
  /// Waits for a camera that is being asked.
  ~TemperatureWatch() = default;

  void begin() noexcept;
  /// No further camera is asked; does not wait for the one that is.
  void end() noexcept { thread_.request_stop(); }
  /// What was told since the last call, by camera.
  [[nodiscard]] Celsius take_new() noexcept;

 private:
  void work(const std::stop_token& stop);

  FrameSource& source_;
  std::mutex mutex_;
  Celsius new_{};
  std::jthread thread_;  // last: it uses the others
};

}  // namespace vergence::app
