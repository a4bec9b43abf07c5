#include "tests/system/odometry/faults.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "core/math/random.hpp"

namespace vergence::test {
namespace {

constexpr double kBlackLevel = 6.0, kNoise = 1.0;  // grey levels

bool within(std::size_t i, std::size_t first, std::size_t last) { return i >= first && i < last; }

}  // namespace

OwnedImage dark_image(int width, int height, std::uint64_t seed) {
  OwnedImage p(width, height);
  Random random(seed);
  for (std::uint8_t& b : p.bytes)
    b = static_cast<std::uint8_t>(
        std::clamp(std::lround(kBlackLevel + kNoise * random.normal()), 0L, 255L));
  return p;
}

Edit cover(const StereoDrive& drive, Cover which, std::size_t first, std::size_t last) {
  constexpr std::size_t kImages =
      4;  // different ones in turn, so that the noise does not stand still
  auto dark = std::make_shared<std::vector<OwnedImage>>();
  for (std::size_t i = 0; i < kImages; ++i)
    dark->push_back(dark_image(drive.pairs[0][0].width, drive.pairs[0][0].height, i + 1));
  return [=](std::size_t i, RigFrame* frame) {
    if (!within(i, first, last)) return true;
    if (which != Cover::right) frame->images[0] = (*dark)[(2 * i) % kImages].view();
    if (which != Cover::left) frame->images[1] = (*dark)[(2 * i + 1) % kImages].view();
    return true;
  };
}

Edit swap_cameras(std::size_t first, std::size_t last) {
  return [=](std::size_t i, RigFrame* frame) {
    if (within(i, first, last)) std::swap(frame->images[0], frame->images[1]);
    return true;
  };
}

Edit leave_out(std::size_t first, std::size_t last) {
  return [=](std::size_t i, RigFrame*) { return !within(i, first, last); };
}

Edit take_away(int k, std::size_t first, std::size_t last) {
  return [=](std::size_t i, RigFrame* frame) {
    if (within(i, first, last)) frame->images[static_cast<std::size_t>(k)] = {};
    return true;
  };
}

}  // namespace vergence::test
