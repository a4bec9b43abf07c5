#pragma once
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <new>
#include <numbers>
#include <vector>

#include "core/features/pyramid.hpp"
#include "core/math/random.hpp"
#include "core/math/types.hpp"
#include "tests/support/simd_targets.hpp"

namespace vergence::features::test {

/// A grey image with its own memory; the padding of its rows is filled with `padding`.
struct Image {
  int width, height;
  std::ptrdiff_t stride;
  std::vector<std::uint8_t> bytes;

  Image(int w, int h, int extra = 0, std::uint8_t padding = 0)
      : width(w),
        height(h),
        stride(w + extra),
        bytes(static_cast<std::size_t>(stride) * static_cast<std::size_t>(h), padding) {}
  [[nodiscard]] ImageView view() const { return {bytes.data(), width, height, stride}; }
  [[nodiscard]] std::uint8_t& at(int x, int y) {
    return bytes[static_cast<std::size_t>(y * stride + x)];
  }
};

inline Image copy_of(const ImageView& view) {
  Image copy(view.width, view.height);
  for (int y = 0; y < view.height; ++y)
    std::copy_n(view.row(y), view.width, copy.bytes.data() + y * copy.stride);
  return copy;
}

template <class Value>
Image draw(int width, int height, const Value& value, int extra = 0) {
  Image image(width, height, extra);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      image.at(x, y) =
          static_cast<std::uint8_t>(std::clamp(std::lround(value(Vec2(x, y))), 0L, 255L));
  return image;
}

inline Image white_noise(int width, int height, std::uint64_t seed, int extra = 0,
                         std::uint8_t padding = 0) {
  Random random(seed);
  Image image(width, height, extra, padding);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) image.at(x, y) = static_cast<std::uint8_t>(random.below(256));
  return image;
}

/// Grey values as a function of the plane: a sum of waves, so that any shift of it is known
/// exactly. Sigma of the grey values 24.
class Texture {
 public:
  /// Lengths of the waves, px.
  explicit Texture(std::uint64_t seed, double shortest = 8, double longest = 24) {
    Random random(seed);
    for (Wave& w : waves_) {
      const double length = random.uniform(shortest, longest),
                   angle = random.uniform(0, 2 * std::numbers::pi);
      w.k = 2 * std::numbers::pi / length * Vec2(std::cos(angle), std::sin(angle));
      w.phase = random.uniform(0, 2 * std::numbers::pi);
    }
  }
  [[nodiscard]] double operator()(const Vec2& p) const {
    double v = 128;
    for (const Wave& w : waves_) v += 11.0 * std::cos(w.k.dot(p) + w.phase);
    return v;
  }

 private:
  struct Wave {
    // Wave vector in rad/px.
    Vec2 k = Vec2::Zero();
    double phase = 0;
  };
  std::array<Wave, 10> waves_;
};

/// An image whose last byte is followed, or whose first is preceded, by a page that must not be
/// touched.
class GuardedImage {
 public:
  enum class Guard : std::uint8_t { before, behind };
  GuardedImage(const Image& from, Guard guard) : width_(from.width), height_(from.height) {
    const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
    const auto bytes = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
    const std::size_t room = (bytes + page - 1) / page * page;
    length_ = room + page;
    void* const at =
        mmap(nullptr, length_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (at == MAP_FAILED) throw std::bad_alloc();
    memory_ = static_cast<std::uint8_t*>(at);
    data_ = guard == Guard::before ? memory_ + page : memory_ + room - bytes;
    for (int y = 0; y < height_; ++y)
      std::copy_n(from.bytes.data() + y * from.stride, width_, data_ + y * width_);
    mprotect(guard == Guard::before ? memory_ : memory_ + room, page, PROT_NONE);
  }
  ~GuardedImage() { munmap(memory_, length_); }
  GuardedImage(const GuardedImage&) = delete;
  GuardedImage& operator=(const GuardedImage&) = delete;
  [[nodiscard]] ImageView view() const { return {data_, width_, height_, width_}; }
  /// From now on no byte of the image may be touched.
  void forbid() { mprotect(memory_, length_, PROT_NONE); }

 private:
  int width_, height_;
  std::size_t length_ = 0;
  std::uint8_t* memory_ = nullptr;
  std::uint8_t* data_ = nullptr;
};

/// A pyramid of an image, with the arena it lies in.
struct Built {
  Arena arena;
  Pyramid pyramid;
  explicit Built(const ImageView& image, int levels = 3)
      : pyramid(image.width, image.height, levels, arena) {
    pyramid.build(image);
  }
};

using vergence::test::on_every_target;

}  // namespace vergence::features::test
