#include "app/devices/image_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>

#include <fmt/format.h>

namespace vergence::app {

namespace {

// Limits in grey levels.
constexpr int kSaturated = 254, kDark = 4;
// Fractions of an image. kMuch leaves nothing visible, and kSome may be a saturated sky.
constexpr double kMuch = 0.5, kSome = 0.05;
// Limits of the mean in grey levels.
constexpr double kBlack = 6, kDim = 30;
// Minimum contrast in grey levels. A smaller one is noise.
constexpr double kFlat = 1.5;
// Minimum sharpness relative to the sharpest camera.
constexpr double kBlurred = 0.2;

std::optional<std::string> why_unusable(const ImageStatistics& f, const std::string& who) {
  if (f.mean < kBlack) return who + " is black; check the lens cap, the light and exposure_us";
  if (f.saturated > kMuch)
    return fmt::format(
        "{} is overexposed: {:.0f} % of it is white; lower exposure_us, then gain_db", who,
        100 * f.saturated);
  if (f.contrast < kFlat)
    return who +
           " is one uniform grey; check for a lens cap, fog on the glass, or a missing sensor "
           "signal";
  return std::nullopt;
}

}  // namespace

ImageStatistics image_statistics(const ImageView& image) noexcept {
  ImageStatistics f;
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

std::vector<ImageIssue> evaluate_images(std::span<const std::string> names,
                                        std::span<const ImageStatistics> statistics) {
  std::vector<ImageIssue> remarks;
  const auto add = [&](bool unusable, std::string message) {
    remarks.push_back({unusable, std::move(message)});
  };
  double sharpest = 0;
  std::size_t sharpest_at = 0;
  for (std::size_t k = 0; k < statistics.size(); ++k)
    if (statistics[k].sharpness > sharpest) sharpest = statistics[k].sharpness, sharpest_at = k;
  for (std::size_t k = 0; k < statistics.size(); ++k) {
    const ImageStatistics& f = statistics[k];
    const std::string& who = names[k];
    if (const auto reason = why_unusable(f, who)) {
      add(true, *reason);
      continue;
    }
    if (f.saturated > kSome)
      add(false, fmt::format("{} is partly overexposed: {:.0f} % of it is white, where nothing can "
                             "be tracked; a shorter exposure_us may help",
                             who, 100 * f.saturated));
    if (f.mean < kDim)
      add(false, fmt::format("{} is underexposed (mean {:.0f} of 255); raise exposure_us up to "
                             "what motion allows, then gain_db",
                             who, f.mean));
    if (k != sharpest_at && f.sharpness < kBlurred * sharpest)
      add(false, fmt::format("{} is much less sharp than {} ({:.0f} against {:.0f}); check focus, "
                             "dirt and near obstacles",
                             who, names[sharpest_at], f.sharpness, sharpest));
  }
  return remarks;
}

bool are_identical(const ImageView& a, const ImageView& b) noexcept {
  if (a.empty() || b.empty() || a.width != b.width || a.height != b.height) return false;
  for (int y = 0; y < a.height; ++y)
    if (std::memcmp(a.row(y), b.row(y), static_cast<std::size_t>(a.width)) != 0) return false;
  return image_statistics(a).contrast >= kFlat;
}

}  // namespace vergence::app
