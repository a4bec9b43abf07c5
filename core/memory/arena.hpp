#pragma once
#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace vergence {

inline constexpr std::size_t kCacheLine =
    64;  // bytes; also the widest SIMD vector's natural alignment (AVX-512)

/// Bytes of an arena by name.
struct ArenaRow {
  const char* name = "";  // a constant
  std::size_t bytes = 0;
};

/// All memory of the real-time path, taken once at start. Hands out, never takes back.
///
///     Arena arena(odometry::Map::memory_needed());
///     odometry::Map map(10, arena);  // 10 keyframes
///     for (const ArenaRow& row : arena.rows()) use(row.name, row.bytes);
///
/// Ownership  The arena owns the bytes; what is made in it lives as long as the arena.
/// Threads    One thread, before the seal.
/// Memory     Reserved as zero pages: one becomes resident when it is first written to, so what a
///            capacity holds beyond its use costs addresses alone. What must not fault later is
///            locked by the program (realtime.lock_memory), which makes all of it resident.
/// Errors     Throws std::length_error when full, naming who asked, and std::bad_alloc:
///            construction time only, outside the real-time path.
class Arena {
 public:
  explicit Arena(std::size_t bytes)
      : capacity_(bytes), storage_(std::calloc(bytes + kCacheLine, 1)) {
    if (!storage_) throw std::bad_alloc();
    void* first = storage_.get();
    std::size_t space = bytes + kCacheLine;
    begin_ = static_cast<std::byte*>(std::align(kCacheLine, bytes, first, space));
  }

  Arena(const Arena&) = delete;
  Arena& operator=(const Arena&) = delete;

  /// n value-initialised objects on a cache line of their own. `who`: a constant that outlives the
  /// arena.
  template <class T>
  [[nodiscard]] std::span<T> make(std::size_t n, const char* who) {
    const std::span<T> all = take<T>(n, who);
    // Zero pages are values already where a default is all zero bytes: they stay untouched.
    if (n > 0 && !zero_by_default<T>(all.data()))
      std::uninitialized_value_construct_n(all.data(), n);
    return all;
  }

  /// n objects of zero bytes, whatever a T is by default, for callers that write before they read,
  /// as a BoundedVector does: pages stay untouched until then.
  template <class T>
  [[nodiscard]] std::span<T> make_unset(std::size_t n, const char* who) {
    static_assert(std::is_trivially_copyable_v<T>);
    return take<T>(n, who);
  }

  [[nodiscard]] std::size_t used() const noexcept { return used_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return capacity_; }
  /// Bytes by name, in the order of their first request.
  [[nodiscard]] std::span<const ArenaRow> rows() const noexcept { return rows_; }
  /// All of it, to ask the system which pages are resident.
  [[nodiscard]] std::span<const std::byte> bytes() const noexcept { return {begin_, capacity_}; }

 private:
  struct Free {
    void operator()(void* p) const noexcept { std::free(p); }
  };

  template <class T>
  [[nodiscard]] std::span<T> take(std::size_t n, const char* who) {
    static_assert(std::is_trivially_destructible_v<T>, "nothing in the arena is destroyed");
    static_assert(alignof(T) <= kCacheLine);
    const std::size_t bytes = (n * sizeof(T) + kCacheLine - 1) / kCacheLine * kCacheLine;
    if (n > capacity_ / sizeof(T) || bytes > capacity_ - used_)
      throw std::length_error(
          std::string("arena full: ") + who + " asks for " + std::to_string(bytes) + " bytes, " +
          std::to_string(capacity_ - used_) + " of " + std::to_string(capacity_) + " are left");
    T* first = reinterpret_cast<T*>(begin_ + used_);
    used_ += bytes;
    count(who, bytes);
    return {first, n};
  }

  /// Returns true if a value-initialised T is all zero bytes; one is made at `at`, which is zero.
  template <class T>
  [[nodiscard]] static bool zero_by_default(T* at) {
    if constexpr (!std::is_arithmetic_v<T> && !std::is_enum_v<T> && !std::is_pointer_v<T>) {
      ::new (static_cast<void*>(at)) T();
      const auto* bytes = reinterpret_cast<const unsigned char*>(at);
      return std::all_of(bytes, bytes + sizeof(T), [](unsigned char b) { return b == 0; });
    }
    return true;
  }

  void count(const char* who, std::size_t bytes) {
    const auto row = std::find_if(rows_.begin(), rows_.end(), [who](const ArenaRow& r) {
      return std::strcmp(r.name, who) == 0;
    });
    if (row != rows_.end())
      row->bytes += bytes;
    else
      rows_.push_back({who, bytes});
  }

  std::size_t capacity_;
  std::size_t used_ = 0;
  std::unique_ptr<void, Free> storage_;
  std::byte* begin_ = nullptr;
  std::vector<ArenaRow> rows_;
};

}  // namespace vergence
