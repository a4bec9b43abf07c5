#pragma once
#include "core/memory/ring.hpp"
#include "drivers/camera.hpp"

namespace vergence::exposure {

/// Exposure of a frame from a camera that does not report it: the setting in its registers when the
/// frame's exposure began.
///
/// reset() requires that no other call runs. One thread calls change(), the transport's thread
/// at().
class AppliedExposure {
 public:
  void reset(const ExposureSetting& setting) noexcept {
    for (Change c; changes_.pop(&c);) current_ = c.setting;
    current_ = setting;
    any_ = false;
  }
  /// Records that the camera has this setting since `written`. Returns false, without recording, if
  /// there are more changes than frames.
  [[nodiscard]] bool change(const ExposureSetting& setting, HostStamp written) noexcept {
    return changes_.push({written, setting});
  }
  /// Setting of an exposure that began then; calls must be in order of time.
  [[nodiscard]] const ExposureSetting& at(HostStamp began) noexcept {
    while (any_ || changes_.pop(&next_)) {
      any_ = true;
      if (began < next_.from) break;
      current_ = next_.setting;
      any_ = false;
    }
    return current_;
  }

 private:
  struct Change {
    HostStamp from{};
    ExposureSetting setting{};
  };
  Ring<Change, 8> changes_;
  ExposureSetting current_{};
  Change next_{};
  // True if next_ is not yet due.
  bool any_ = false;
};

}  // namespace vergence::exposure
