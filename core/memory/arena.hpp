#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace vergence {

inline constexpr std::size_t kCacheLine =
    64;  // bytes; also the widest SIMD vector's natural alignment (AVX-512)

/// All memory of the real-time path, taken once at start. Hands out, never takes back (DESIGN §4).
///
/// Ownership  The arena owns the bytes; what is made in it lives as long as the arena.
/// Threads    One thread, before the seal.
/// Errors     Throws std::length_error when full, naming who asked: construction time only, outside
///            the real-time path.
class Arena {
 public:
  explicit Arena(std::size_t bytes)
      : capacity_(bytes),
        storage_(static_cast<std::byte*>(::operator new (bytes, std::align_val_t{kCacheLine}))) {}

  Arena(const Arena&) = delete;
  Arena& operator=(const Arena&) = delete;

  /// n value-initialised objects on a cache line of their own.
  template <class T>
  [[nodiscard]] std::span<T> make(std::size_t n, const char* who) {
    static_assert(std::is_trivially_destructible_v<T>, "nothing in the arena is destroyed");
    static_assert(alignof(T) <= kCacheLine);
    const std::size_t bytes = (n * sizeof(T) + kCacheLine - 1) / kCacheLine * kCacheLine;
    if (n > capacity_ / sizeof(T) || bytes > capacity_ - used_)
      throw std::length_error(
          std::string("arena full: ") + who + " asks for " + std::to_string(bytes) + " bytes, " +
          std::to_string(capacity_ - used_) + " of " + std::to_string(capacity_) + " are left");
    std::byte* at = storage_.get() + used_;
    used_ += bytes;
    T* first = reinterpret_cast<T*>(at);
    std::uninitialized_value_construct_n(first, n);
    return {first, n};
  }

  [[nodiscard]] std::size_t used() const noexcept { return used_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return capacity_; }

 private:
  struct Free {
    void operator()(std::byte* p) const noexcept {
      ::operator delete (p, std::align_val_t{kCacheLine});
    }
  };
  std::size_t capacity_;
  std::size_t used_ = 0;
  std::unique_ptr<std::byte, Free> storage_;
};

}  // namespace vergence
