#include "app/capture/picture_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>

#include <fmt/format.h>

namespace vergence::app {
namespace {

constexpr int kSaturated = 254, kDark = 4;  // grey levels
constexpr double kMuch = 0.5,
                 kSome = 0.05;  // shares of an image: nothing left to see, a sky that may be lost
constexpr double kBlack = 6, kDim = 30;  // mean, grey levels
constexpr double kFlat = 1.5;            // contrast, grey levels: less is noise
constexpr double kBlurred = 0.2;         // of the sharpest camera's sharpness

PictureRemark remark(bool unusable, std::string sentence) {
  return {unusable, std::move(sentence)};
}

std::optional<std::string> why_unusable(const PictureFigures& f, const std::string& who) {
  if (f.mean < kBlack) return who + " is black: a cap on the lens, no light, or no exposure";
  if (f.saturated > kMuch)
    return fmt::format(
        "{} is overexposed: {:.0f} % of it is white; lower exposure_us, then gain_db", who,
        100 * f.saturated);
  if (f.contrast < kFlat)
    return who + " shows nothing: one grey all over; a cap, fog on the glass, or no sensor signal";
  return std::nullopt;
}

}  // namespace

PictureFigures figures_of(const ImageView& image) noexcept {
  PictureFigures f;
  double sum = 0, squares = 0, gradients = 0;
  std::int64_t bright = 0, dark = 0;
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* row = image.row(y);
    for (int x = 0; x < image.width; ++x) {
      const int v = row[x];
      sum += v;
      squares += v * v;
      bright += v >= kSaturated ? 1 : 0;
      dark += v <= kDark ? 1 : 0;
      if (x == 0 || y == 0 || x + 1 == image.width || y + 1 == image.height) continue;
      const int dx = row[x + 1] - row[x - 1], dy = image.at(x, y + 1) - image.at(x, y - 1);
      gradients += dx * dx + dy * dy;
    }
  }
  const double n = static_cast<double>(image.width) * image.height;
  const double inner = static_cast<double>(image.width - 2) * (image.height - 2);
  f.mean = sum / n;
  f.contrast = std::sqrt(std::max(0.0, squares / n - f.mean * f.mean));
  f.saturated = static_cast<double>(bright) / n;
  f.dark = static_cast<double>(dark) / n;
  if (image.width > 2 && image.height > 2) f.sharpness = gradients / 4 / inner;
  return f;
}

std::vector<PictureRemark> judge_pictures(std::span<const std::string> names,
                                          std::span<const PictureFigures> figures) {
  std::vector<PictureRemark> remarks;
  double sharpest = 0;
  std::size_t sharpest_at = 0;
  for (std::size_t k = 0; k < figures.size(); ++k)
    if (figures[k].sharpness > sharpest) sharpest = figures[k].sharpness, sharpest_at = k;
  for (std::size_t k = 0; k < figures.size(); ++k) {
    const PictureFigures& f = figures[k];
    const std::string& who = names[k];
    if (const auto reason = why_unusable(f, who)) {
      remarks.push_back(remark(true, *reason));
      continue;
    }
    if (f.saturated > kSome)
      remarks.push_back(remark(false, fmt::format("{}: {:.0f} % of it is white, where nothing can "
                                                  "be tracked; a shorter exposure_us may help",
                                                  who, 100 * f.saturated)));
    if (f.mean < kDim)
      remarks.push_back(
          remark(false, fmt::format("{} is underexposed (mean {:.0f} of 255); raise exposure_us up "
                                    "to what motion allows, then gain_db",
                                    who, f.mean)));
    if (k != sharpest_at && f.sharpness < kBlurred * sharpest)
      remarks.push_back(
          remark(false, fmt::format("{} is much less sharp than {} ({:.0f} against {:.0f}): focus, "
                                    "dirt, or something near before it",
                                    who, names[sharpest_at], f.sharpness, sharpest)));
  }
  return remarks;
}

bool are_identical(const ImageView& a, const ImageView& b) noexcept {
  if (a.empty() || b.empty() || a.width != b.width || a.height != b.height) return false;
  for (int y = 0; y < a.height; ++y)
    if (std::memcmp(a.row(y), b.row(y), static_cast<std::size_t>(a.width)) != 0) return false;
  return figures_of(a).contrast >= kFlat;
}

}  // namespace vergence::app
