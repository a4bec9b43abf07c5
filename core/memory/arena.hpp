#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace vergence {

/// Size in bytes, also the alignment of the widest SIMD vector (AVX-512).
inline constexpr std::size_t kCacheLine = 64;

/// Bytes of an arena under one name.
struct ArenaRow {
  const char* name = "";
  std::size_t bytes = 0;
};

/// All memory of the real-time path, taken at start and returned only as a whole.
///
///     Arena arena;
///     odometry::Map map(10, arena);  // 10 keyframes
///     for (const ArenaRow& row : arena.rows()) use(row.name, row.bytes);
///
/// Ownership  The arena owns the bytes; objects in it live as long as the arena.
/// Threads    One thread, during initialisation.
/// Memory     Taken from the heap as zero pages, which become resident when first written, so that
///            unused capacity costs address space only. Small requests share blocks of kBlock. The
///            program can lock all of it (realtime.lock_memory), which makes it resident.
/// Errors     Throws std::bad_alloc; at construction of the objects only.
class Arena {
 public:
  Arena() = default;
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
  /// Bytes by name, in the order of their first request.
  [[nodiscard]] std::span<const ArenaRow> rows() const noexcept { return rows_; }

 private:
  // Size of a block in bytes; requests of more than a quarter have blocks of their own.
  static constexpr std::size_t kBlock = std::size_t{1} << 22;
  // Maximum size of a request, which no address space has.
  static constexpr std::size_t kMaxBytes = std::size_t{1} << 62;

  struct Free {
    void operator()(void* p) const noexcept { std::free(p); }
  };

  template <class T>
  [[nodiscard]] std::span<T> take(std::size_t n, const char* who) {
    static_assert(std::is_trivially_destructible_v<T>, "nothing in the arena is destroyed");
    static_assert(alignof(T) <= kCacheLine);
    if (n > kMaxBytes / sizeof(T)) throw std::bad_alloc();
    const std::size_t bytes = (n * sizeof(T) + kCacheLine - 1) / kCacheLine * kCacheLine;
    std::byte* const first = place(bytes);
    used_ += bytes;
    count(who, bytes);
    return {reinterpret_cast<T*>(first), n};
  }

  [[nodiscard]] std::byte* place(std::size_t bytes) {
    if (bytes > kBlock / 4) return allocate(bytes);
    if (bytes > left_) {
      next_ = allocate(kBlock);
      left_ = kBlock;
    }
    left_ -= bytes;
    return std::exchange(next_, next_ + bytes);
  }
  [[nodiscard]] std::byte* allocate(std::size_t bytes) {
    std::size_t space = bytes + kCacheLine;
    void* first = blocks_.emplace_back(std::calloc(space, 1)).get();
    if (first == nullptr) throw std::bad_alloc();
    return static_cast<std::byte*>(std::align(kCacheLine, bytes, first, space));
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

  std::vector<std::unique_ptr<void, Free>> blocks_;
  // Rest of the newest shared block.
  std::byte* next_ = nullptr;
  std::size_t left_ = 0;
  std::size_t used_ = 0;
  std::vector<ArenaRow> rows_;
};

}  // namespace vergence
