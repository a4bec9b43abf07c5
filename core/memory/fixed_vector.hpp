#pragma once
#include <array>
#include <cassert>
#include <cstddef>
#include <span>
#include <type_traits>

namespace vergence {

/// At most N values in place, never a heap. When full, push() refuses and says so.
template <class T, std::size_t N>
class FixedVector {
  static_assert(std::is_trivially_copyable_v<T> || std::is_default_constructible_v<T>);

 public:
  /// False: full, nothing changed; the caller counts it.
  [[nodiscard]] bool push(const T& value) noexcept {
    if (size_ == N) return false;
    items_[size_++] = value;
    return true;
  }
  /// Removes by moving the last into its place: order is not kept.
  void remove_swapping(std::size_t i) noexcept {
    assert(i < size_);
    items_[i] = items_[--size_];
  }
  /// Drops everything from n on. Precondition: n ≤ size().
  void truncate(std::size_t n) noexcept {
    assert(n <= size_);
    size_ = n;
  }
  void clear() noexcept { size_ = 0; }

  [[nodiscard]] T& operator[](std::size_t i) noexcept {
    assert(i < size_);
    return items_[i];
  }
  [[nodiscard]] const T& operator[](std::size_t i) const noexcept {
    assert(i < size_);
    return items_[i];
  }
  [[nodiscard]] T& back() noexcept { return (*this)[size_ - 1]; }
  [[nodiscard]] const T& back() const noexcept { return (*this)[size_ - 1]; }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] bool full() const noexcept { return size_ == N; }
  [[nodiscard]] static constexpr std::size_t capacity() noexcept { return N; }
  [[nodiscard]] T* begin() noexcept { return items_.data(); }
  [[nodiscard]] T* end() noexcept { return items_.data() + size_; }
  [[nodiscard]] const T* begin() const noexcept { return items_.data(); }
  [[nodiscard]] const T* end() const noexcept { return items_.data() + size_; }
  [[nodiscard]] std::span<T> span() noexcept { return {items_.data(), size_}; }
  [[nodiscard]] std::span<const T> span() const noexcept { return {items_.data(), size_}; }

 private:
  std::array<T, N> items_{};
  std::size_t size_ = 0;
};

/// The same over memory of an arena: capacity chosen at construction. When full, push() refuses and says so.
template <class T>
class BoundedVector {
 public:
  BoundedVector() noexcept = default;
  explicit BoundedVector(std::span<T> storage) noexcept : storage_(storage) {}

  [[nodiscard]] bool push(const T& value) noexcept {
    if (size_ == storage_.size()) return false;
    storage_[size_++] = value;
    return true;
  }
  void remove_swapping(std::size_t i) noexcept {
    assert(i < size_);
    storage_[i] = storage_[--size_];
  }
  void truncate(std::size_t n) noexcept {
    assert(n <= size_);
    size_ = n;
  }
  void clear() noexcept { size_ = 0; }

  [[nodiscard]] T& operator[](std::size_t i) noexcept {
    assert(i < size_);
    return storage_[i];
  }
  [[nodiscard]] const T& operator[](std::size_t i) const noexcept {
    assert(i < size_);
    return storage_[i];
  }
  [[nodiscard]] T& back() noexcept { return (*this)[size_ - 1]; }
  [[nodiscard]] const T& back() const noexcept { return (*this)[size_ - 1]; }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return storage_.size(); }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] bool full() const noexcept { return size_ == storage_.size(); }
  [[nodiscard]] T* begin() noexcept { return storage_.data(); }
  [[nodiscard]] T* end() noexcept { return storage_.data() + size_; }
  [[nodiscard]] const T* begin() const noexcept { return storage_.data(); }
  [[nodiscard]] const T* end() const noexcept { return storage_.data() + size_; }
  [[nodiscard]] std::span<T> span() noexcept { return storage_.first(size_); }
  [[nodiscard]] std::span<const T> span() const noexcept { return storage_.first(size_); }

 private:
  std::span<T> storage_;
  std::size_t size_ = 0;
};

}  // namespace vergence
