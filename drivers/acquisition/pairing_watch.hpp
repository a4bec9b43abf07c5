#pragma once
#include <array>
#include <cstddef>
#include <optional>

#include "core/types/calibration.hpp"
#include "core/types/time.hpp"

namespace vergence {

/// Whether it is proven which pulses the cameras' frames belong to: tells when that changes.
///
/// A camera begins as proven, so that where nothing can be proven nothing is told; and as one of
/// which no frame has come, so that a camera that is not yet there is not told of either.
///
/// Threads  One. Memory: in place. Time: constant a call. Errors: none.
class PairingWatch {
 public:
  struct Change {
    bool proven = false;
    double seconds = 0;  // proven: since the change before it
  };

  /// A frame of that camera has come.
  void frame(std::size_t camera) noexcept { cameras_[camera].any = true; }
  /// It was started again.
  void restarted(std::size_t camera) noexcept { cameras_[camera] = {}; }
  /// What the synchroniser says of it now. None: as before, or no frame has come yet.
  [[nodiscard]] std::optional<Change> look(std::size_t camera, bool proven,
                                           HostStamp now) noexcept {
    Camera& own = cameras_[camera];
    if (proven == own.proven || !own.any) return std::nullopt;
    const double seconds = proven ? (now - own.since).to_seconds() : 0;
    own = {true, proven, now};
    return Change{proven, seconds};
  }

 private:
  struct Camera {
    bool any = false;
    bool proven = true;
    HostStamp since{};  // of the last change
  };

  std::array<Camera, kMaxCameras> cameras_{};
};

}  // namespace vergence
