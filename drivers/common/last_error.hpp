#pragma once
#include <string>
#include <utility>

#include "drivers/common/published.hpp"

namespace vergence {

/// The message about a device's last failure: what, where, what to do. One thread's calls fail
/// while another asks why.
///
/// Threads  Any. Memory: that of the message. Errors: none but std::bad_alloc of get().
///
///     return last_error_.refuse(DeviceStatus::busy, "the camera streams; stop it first");
class LastError : public Published<std::string> {
 public:
  /// The status as it is, with its reason kept.
  template <class Status>
  [[nodiscard]] Status refuse(Status status, std::string message) noexcept {
    set(std::move(message));
    return status;
  }
  void clear() noexcept { set({}); }
};

}  // namespace vergence
