#pragma once
#include <array>
#include <cassert>
#include <cstddef>
#include <span>
#include <type_traits>

namespace vergence {

/// Base of the two vectors below: at most capacity() values of type T without a heap. If full,
/// push() returns false. Storage has data() and size().
template <class T, class Storage>
class VectorOn {
 public:
  /// Returns false and changes nothing if full; the caller counts it.
  [[nodiscard]] bool push(const T& value) noexcept {
    if (full()) return false;
    storage_[size_++] = value;
    return true;
  }
  /// Drops the elements from n on. Precondition: n ≤ size().
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
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] bool full() const noexcept { return size_ == storage_.size(); }
  [[nodiscard]] T* begin() noexcept { return storage_.data(); }
  [[nodiscard]] T* end() noexcept { return storage_.data() + size_; }
  [[nodiscard]] const T* begin() const noexcept { return storage_.data(); }
  [[nodiscard]] const T* end() const noexcept { return storage_.data() + size_; }
  [[nodiscard]] std::span<T> span() noexcept { return {storage_.data(), size_}; }
  [[nodiscard]] std::span<const T> span() const noexcept { return {storage_.data(), size_}; }

 protected:
  VectorOn() noexcept = default;
  explicit VectorOn(const Storage& storage) noexcept : storage_(storage) {}
  Storage storage_{};

 private:
  std::size_t size_ = 0;
};

/// Vector with in-place storage and its capacity in the type.
template <class T, std::size_t N>
class FixedVector : public VectorOn<T, std::array<T, N>> {
  static_assert(std::is_trivially_copyable_v<T> || std::is_default_constructible_v<T>);

 public:
  [[nodiscard]] static constexpr std::size_t capacity() noexcept { return N; }
};

/// Vector in an arena's memory, with its capacity set at construction. Copies share the storage.
template <class T>
class BoundedVector : public VectorOn<T, std::span<T>> {
 public:
  BoundedVector() noexcept = default;
  explicit BoundedVector(std::span<T> storage) noexcept : VectorOn<T, std::span<T>>(storage) {}
  [[nodiscard]] std::size_t capacity() const noexcept { return this->storage_.size(); }
};

}  // namespace vergence
