#pragma once
#include <mutex>
#include <type_traits>
#include <utility>

namespace vergence {

/// A value that one thread keeps up to date and others read, whole.
///
/// Threads  offer(), set(): the writer. get(): any. Time: offer() never waits for a reader.
/// Memory   That of the value. Errors: what its copying throws.
template <class Value>
class Published {
 public:
  /// While a reader holds it, the value before stays until the next call.
  void offer(const Value& value) noexcept(kCopies) {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (lock.owns_lock()) value_ = value;
  }
  /// Waits for a reader's copy.
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
