#pragma once
#include <mutex>
#include <type_traits>
#include <utility>

namespace vergence {

/// Value that one thread updates and others read without tearing.
///
/// The writer calls offer() and set(), any thread get(). offer() never waits for a reader. Errors
/// are those of copying the value.
template <class Value>
class Published {
 public:
  /// Updates the value, unless a reader is copying it: then the old value stays until the next
  /// call.
  void offer(const Value& value) noexcept(kCopies) {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (lock.owns_lock()) value_ = value;
  }
  /// Updates the value; waits while a reader copies it.
  void set(Value value) noexcept {
    const std::lock_guard lock(mutex_);
    value_ = std::move(value);
  }
  [[nodiscard]] Value get() const noexcept(kCopies) {
    const std::lock_guard lock(mutex_);
    return value_;
  }

 private:
  static constexpr bool kCopies =
      std::is_nothrow_copy_assignable_v<Value> && std::is_nothrow_copy_constructible_v<Value>;

  mutable std::mutex mutex_;
  Value value_{};
};

}  // namespace vergence
