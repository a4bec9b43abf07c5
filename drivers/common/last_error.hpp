#pragma once
#include <mutex>
#include <string>
#include <utility>

namespace vergence {

/// The sentence about a device's last failure: what, where, what to do. One thread's calls fail
/// while another asks why.
///
/// Threads  Any. Memory: that of the sentence. Errors: none but std::bad_alloc of get().
///
///     return last_error_.refuse(DeviceStatus::busy, "the camera streams; stop it first");
class LastError {
 public:
  void set(std::string sentence) noexcept {
    const std::lock_guard lock(mutex_);
    sentence_ = std::move(sentence);
  }
  /// The status as it is, with its reason kept.
  template <class Status>
  [[nodiscard]] Status refuse(Status status, std::string sentence) noexcept {
    set(std::move(sentence));
    return status;
  }
  void clear() noexcept { set({}); }
  [[nodiscard]] std::string get() const {
    const std::lock_guard lock(mutex_);
    return sentence_;
  }

 private:
  mutable std::mutex mutex_;
  std::string sentence_;
};

}  // namespace vergence
