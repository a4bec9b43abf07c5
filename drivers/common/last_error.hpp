#pragma once
#include <string>
#include <utility>

#include "drivers/common/published.hpp"

namespace vergence {

/// Message about a device's last failure: the problem, its place and the fix. One thread may read
/// it while the calls of another fail.
///
/// Every call is thread-safe. Only get() may throw std::bad_alloc.
///
///     return last_error_.refuse(DeviceStatus::busy, "the camera streams; stop it first");
class LastError : public Published<std::string> {
 public:
  /// Stores the message and returns `status` unchanged.
  template <class Status>
  [[nodiscard]] Status refuse(Status status, std::string message) noexcept {
    set(std::move(message));
    return status;
  }
  void clear() noexcept { set({}); }
};

}  // namespace vergence
