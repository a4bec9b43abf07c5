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

/// A grey picture of float pixels, small enough to be searched through.
struct Small {
  int width = 0, height = 0;
  std::vector<float> pixels;
  [[nodiscard]] float at(int x, int y) const {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
};

constexpr int kSearchedWidth = 240;  // px, about
constexpr int kRadius = 4;           // of a patch, px of the small picture
constexpr int kPatch = (2 * kRadius + 1) * (2 * kRadius + 1);

Small shrunk(const ImageView& image) {
  const int factor = std::max(1, image.width / kSearchedWidth);
  Small s;
  s.width = image.width / factor;
  s.height = image.height / factor;
  s.pixels.resize(static_cast<std::size_t>(s.width) * static_cast<std::size_t>(s.height));
  const float scale = 1.0F / static_cast<float>(factor * factor);
  for (int y = 0; y < s.height; ++y)
    for (int x = 0; x < s.width; ++x) {
      int sum = 0;
      for (int v = 0; v < factor; ++v)
        for (int u = 0; u < factor; ++u) sum += image.at(x * factor + u, y * factor + v);
      s.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(s.width) +
               static_cast<std::size_t>(x)] = static_cast<float>(sum) * scale;
    }
  return s;
}

/// A patch less its mean, of length 1. False: flat.
bool cut(const Small& s, int x, int y, std::array<float, kPatch>* patch) {
  float sum = 0;
  std::size_t i = 0;
  for (int v = -kRadius; v <= kRadius; ++v)
    for (int u = -kRadius; u <= kRadius; ++u) sum += (*patch)[i++] = s.at(x + u, y + v);
  const float mean = sum / kPatch;
  float squares = 0;
  for (float& p : *patch) p -= mean, squares += p * p;
  constexpr float kLeastDeviation = 6;  // grey levels
  if (squares < kLeastDeviation * kLeastDeviation * kPatch) return false;
  const float scale = 1 / std::sqrt(squares);
  for (float& p : *patch) p *= scale;
  return true;
}

float correlation(const std::array<float, kPatch>& a, const std::array<float, kPatch>& b) {
  float sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

/// Where the patch around (x, y) of the first picture is in the second: by how much further left.
/// False: nowhere, or at several places.
bool find_shift(const Small& first, const Small& second, int x, int y, int* shift) {
  std::array<float, kPatch> requested{}, seen{};
  if (!cut(first, x, y, &requested)) return false;
  const int reach = first.width / 4, up = std::max(1, first.height * 6 / 100);
  constexpr float kAlike = 0.85F, kSecondBest = 0.92F;
  float best = 0, second_best = 0;
  int where = 0;
  for (int u = std::max(kRadius, x - reach); u <= std::min(second.width - 1 - kRadius, x + reach);
       ++u) {
    float here = 0;  // of this column
    for (int v = std::max(kRadius, y - up); v <= std::min(second.height - 1 - kRadius, y + up); ++v)
      if (cut(second, u, v, &seen)) here = std::max(here, correlation(requested, seen));
    if (here > best) {
      if (u - where > 2) second_best = std::max(second_best, best);
      best = here;
      where = u;
    } else if (u - where > 2) {
      second_best = std::max(second_best, here);
    }
  }
  *shift = x - where;
  return best > kAlike && second_best < kSecondBest * best;
}

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

HorizontalShift horizontal_shift(const ImageView& first, const ImageView& second) {
  HorizontalShift result;
  const Small a = shrunk(first), b = shrunk(second);
  constexpr int kColumns = 12, kRows = 8;
  std::vector<int> shifts;
  for (int j = 0; j < kRows; ++j)
    for (int i = 0; i < kColumns; ++i) {
      const int x = kRadius + (a.width - 2 * kRadius - 1) * (2 * i + 1) / (2 * kColumns);
      const int y = kRadius + (a.height - 2 * kRadius - 1) * (2 * j + 1) / (2 * kRows);
      int shift = 0;
      if (x < a.width - kRadius && y < a.height - kRadius && find_shift(a, b, x, y, &shift))
        shifts.push_back(shift);
    }
  if (shifts.empty()) return result;
  result.patches = static_cast<int>(shifts.size());
  result.negative = static_cast<double>(
                        std::count_if(shifts.begin(), shifts.end(), [](int s) { return s < 0; })) /
                    result.patches;
  std::nth_element(shifts.begin(), shifts.begin() + static_cast<std::ptrdiff_t>(shifts.size() / 2),
                   shifts.end());
  result.median = static_cast<double>(shifts[shifts.size() / 2]) / a.width;
  return result;
}

bool look_exchanged(const HorizontalShift& shift) noexcept {
  constexpr int kEnough = 10;
  constexpr double kMost = 0.8, kBeyondRotation = -0.02;
  return shift.patches >= kEnough && shift.negative > kMost && shift.median < kBeyondRotation;
}

}  // namespace vergence::app
