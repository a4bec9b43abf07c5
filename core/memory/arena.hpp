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

/// Size in bytes, also the alignment of the widest SIMD vector (AVX-512).
inline constexpr std::size_t kCacheLine = 64;

/// Bytes of an arena under one name.
struct ArenaRow {
  const char* name = "";
  std::size_t bytes = 0;
};

/// All memory of the real-time path, allocated once at start and never returned in parts.
///
///     Arena arena(odometry::Map::memory_needed());
///     odometry::Map map(10, arena);  // 10 keyframes
///     for (const ArenaRow& row : arena.rows()) use(row.name, row.bytes);
///
/// Ownership  The arena owns the bytes; objects in it live as long as the arena.
/// Threads    One thread, during initialisation.
/// Memory     Reserved as zero pages, which become resident when first written, so that unused
///            capacity costs address space only. The program can lock all of it
///            (realtime.lock_memory), which makes it resident.
/// Errors     Throws std::length_error with the requester's name if full, and std::bad_alloc; at
///            construction only.
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

  /// Makes n value-initialised objects on separate cache lines. `who`: a constant that outlives the
  /// arena.
  template <class T>
  [[nodiscard]] std::span<T> make(std::size_t n, const char* who) {
    const std::span<T> all = take<T>(n, who);
    // If a default value is all zero bytes, the zero pages stay untouched.
    if (n > 0 && !zero_by_default<T>(all.data()))
      std::uninitialized_value_construct_n(all.data(), n);
    return all;
  }

  /// Makes n objects of zero bytes, for callers that write before they read, such as BoundedVector:
  /// pages stay untouched until then.
  template <class T>
  [[nodiscard]] std::span<T> make_unset(std::size_t n, const char* who) {
    static_assert(std::is_trivially_copyable_v<T>);
    return take<T>(n, who);
  }

  [[nodiscard]] std::size_t used() const noexcept { return used_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return capacity_; }
  /// Bytes by name, in the order of their first request.
  [[nodiscard]] std::span<const ArenaRow> rows() const noexcept { return rows_; }
  /// All bytes, to query the system for resident pages.
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

  /// Returns true if a value-initialised T is all zero bytes; constructs one at `at`, which is
  /// zero.
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
