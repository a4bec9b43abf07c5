#pragma once
#include "core/memory/ring.hpp"
#include "drivers/camera.hpp"

namespace vergence::exposure {

/// Which exposure a frame had, of a camera that does not say: the one that was in its registers
/// when the frame's exposure began.
///
/// Threads  reset(): while no other call runs. change(): one thread. at(): the transport's
///          thread.
class AppliedExposure {
 public:
  void reset(const ExposureSetting& setting) noexcept {
    for (Change c; changes_.pop(&c);) current_ = c.setting;
    current_ = setting;
    any_ = false;
  }
  /// The camera has it from `written` on. False: more changes than frames come, the camera's say
  /// would be wrong; not made.
  [[nodiscard]] bool change(const ExposureSetting& setting, HostStamp written) noexcept {
    return changes_.push({written, setting});
  }
  /// Setting of an exposure that began then; later ones do not begin earlier.
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
  bool any_ = false;  // next_ is one that is not yet due
};

}  // namespace vergence::exposure
