// Recorded drives spoilt in the ways in which rigs, lenses, weather and cables spoil them.
#include "tests/bench/integrity_variants.hpp"

#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace vergence::bench {
namespace {

// Focal length over width of KITTI; EuRoC's is 0.61.
constexpr double kFocalOfWidth = 0.58;

/// Image moved by (dx, dy) px, turned by `roll_deg` and magnified about its centre.
void warp(cv::Mat* image, double dx, double dy, double roll_deg, double zoom) {
  cv::Mat m = cv::getRotationMatrix2D(
      {static_cast<float>(image->cols) / 2, static_cast<float>(image->rows) / 2}, roll_deg, zoom);
  m.at<double>(0, 2) += dx;
  m.at<double>(1, 2) += dy;
  cv::Mat out;
  cv::warpAffine(*image, out, m, image->size(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
  *image = out;
}

double pixels(const cv::Mat& image, double degrees) {
  return degrees * CV_PI / 180 * kFocalOfWidth * image.cols;
}

bool later(std::size_t at, std::size_t count) { return at >= count / 2; }

void noise(cv::Mat* image, double sigma, std::size_t seed) {
  cv::RNG random(seed + 1);
  cv::Mat n(image->size(), CV_16S), wide;
  random.fill(n, cv::RNG::NORMAL, 0, sigma);
  image->convertTo(wide, CV_16S);
  wide += n;
  wide.convertTo(*image, CV_8U);
}

void darken(cv::Mat* image, double gain, std::size_t seed) {
  image->convertTo(*image, CV_8U, gain, 4);
  noise(image, 2.5, seed);
}

void jpeg(cv::Mat* image, int quality) {
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", *image, bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
  *image = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
}

/// Blurred grey spots that stay where they are, as drops and mud on a glass.
void spots(cv::Mat* image, std::uint64_t seed, int count) {
  cv::RNG random(seed);
  for (int i = 0; i < count; ++i) {
    const cv::Point at(random.uniform(0, image->cols), random.uniform(0, image->rows));
    cv::circle(*image, at, random.uniform(image->cols / 60, image->cols / 20),
               cv::Scalar(random.uniform(40, 120)), cv::FILLED, cv::LINE_AA);
  }
  cv::GaussianBlur(*image, *image, {}, 1.0);
}

void rain(cv::Mat* image, std::uint64_t seed) {
  cv::RNG random(seed);
  for (int i = 0; i < 250; ++i) {
    const cv::Point at(random.uniform(0, image->cols), random.uniform(0, image->rows));
    cv::line(*image, at, at + cv::Point(random.uniform(-2, 3), random.uniform(8, 25)),
             cv::Scalar(random.uniform(160, 240)), 1, cv::LINE_AA);
  }
}

/// A textured wall that crosses from left to right and hides up to half of both images.
void occlude(cv::Mat* left, cv::Mat* right, std::size_t at, std::size_t count) {
  const double along = 2.0 * static_cast<double>(at) / static_cast<double>(count) - 0.5;
  const int width = left->cols / 2, x = static_cast<int>(along * left->cols) - width / 2;
  cv::RNG random(7);
  cv::Mat texture(left->rows * 3 / 4 / 6, width / 6, CV_8U);
  random.fill(texture, cv::RNG::UNIFORM, 40, 200);
  cv::resize(texture, texture, {width, left->rows * 3 / 4}, 0, 0, cv::INTER_CUBIC);
  const int disparity = left->cols / 25;
  for (cv::Mat* image : {left, right}) {
    const int begin = image == left ? x : x - disparity;
    const cv::Rect whole(begin, image->rows / 8, texture.cols, texture.rows);
    const cv::Rect seen = whole & cv::Rect(0, 0, image->cols, image->rows);
    if (seen.empty()) continue;
    texture(seen - whole.tl()).copyTo((*image)(seen));
  }
}

using Pairs = std::vector<app::StereoPair>;

/// Removes the pairs whose number, counted from 0, `unwanted` is true for.
template <class Unwanted>
void drop(Pairs* pairs, const Unwanted& unwanted) {
  std::size_t i = 0;
  std::erase_if(*pairs, [&](const app::StereoPair&) { return unwanted(i++); });
}

template <std::size_t kStep>
void keep_every(Pairs* pairs) {
  drop(pairs, [](std::size_t i) { return i % kStep != 0; });
}

void drop_some(Pairs* pairs) {
  cv::RNG random(3);
  drop(pairs, [&](std::size_t /*i*/) { return random.uniform(0.0, 1.0) < 0.3; });
}

void lag_right(Pairs* pairs, std::size_t from) {
  for (std::size_t i = pairs->size() - 1; i > from; --i)
    (*pairs)[i].file[1] = (*pairs)[i - 1].file[1];
}

/// Stamps `step` apart, from the first one's on.
void restamp(Pairs* pairs, Duration step) {
  for (std::size_t i = 1; i < pairs->size(); ++i) (*pairs)[i].stamp = (*pairs)[i - 1].stamp + step;
}

/// Every tenth pair is left out: the interval there is twice as long, and so is the motion.
void leave_out_every_tenth(Pairs* pairs) {
  drop(pairs, [](std::size_t i) { return i % 10 == 9; });
}

void leave_out_two_seconds(Pairs* pairs) {
  const Stamp from = (*pairs)[pairs->size() / 3].stamp;
  std::erase_if(*pairs, [&](const app::StereoPair& p) {
    return p.stamp > from && p.stamp < from + Duration::milliseconds(2000);
  });
}

/// A textured plane so near that only this camera sees it, over the lower half; it slides by.
void cover_lower_half(cv::Mat* image, std::size_t at) {
  cv::RNG random(5);
  cv::Mat texture(image->rows / 2 / 4, image->cols, CV_8U);
  random.fill(texture, cv::RNG::UNIFORM, 40, 200);
  cv::resize(texture, texture, {}, 4, 4, cv::INTER_CUBIC);
  const int slid = static_cast<int>(6 * at) % (texture.cols - image->cols);
  texture(cv::Rect(slid, 0, image->cols, texture.rows))
      .copyTo((*image)(cv::Rect(0, image->rows - texture.rows, image->cols, texture.rows)));
}

using M = cv::Mat;
using N = std::size_t;

/// Changes both images by `kChange`, each with a number of its own.
template <auto kChange>
void both(M* left, M* right, N i, N /*count*/) {
  kChange(left, 2 * i);
  kChange(right, 2 * i + 1);
}

/// The right image moved and turned, from the start or half-way on.
template <bool HalfWay, int Pixels, int YawCentidegrees, int PitchCentidegrees,
          int RollCentidegrees, int ZoomPercent>
void knock(M* /*left*/, M* right, N i, N n) {
  if (!HalfWay || later(i, n))
    warp(right, Pixels + pixels(*right, 0.01 * YawCentidegrees),
         pixels(*right, 0.01 * PitchCentidegrees), 0.01 * RollCentidegrees, 1 + 0.01 * ZoomPercent);
}

constexpr IntegrityVariant kVariants[] = {
    {"untouched"},
    {"yaw 0.3° from the start", knock<false, 0, 30, 0, 0, 0>},
    {"yaw 1° from the start", knock<false, 0, 100, 0, 0, 0>},
    {"yaw 0.3° half-way", knock<true, 0, 30, 0, 0, 0>},
    {"yaw −0.3° half-way", knock<true, 0, -30, 0, 0, 0>},
    {"2 px to the side half-way", knock<true, 2, 0, 0, 0, 0>},
    {"−2 px to the side half-way", knock<true, -2, 0, 0, 0, 0>},
    {"pitch 0.3° half-way", knock<true, 0, 0, 30, 0, 0>},
    {"roll 0.5° half-way", knock<true, 0, 0, 0, 50, 0>},
    {"zoom 1 % from the start", knock<false, 0, 0, 0, 0, 1>},
    {"zoom 1 % half-way", knock<true, 0, 0, 0, 0, 1>},
    {"both zoomed by 25 % from the start", both<[](M* m, N) { warp(m, 0, 0, 0, 1.25); }>},
    {"knock while covered",
     [](M* l, M* r, N i, N n) {
       if (i >= n / 2) warp(r, pixels(*r, 0.5), 0, 0, 1);
       if (i >= n / 2 - 5 && i < n / 2 + 5) l->setTo(0), r->setTo(0);
     }},
    {"right one frame late", nullptr, [](Pairs* p) { lag_right(p, 0); }},
    {"right one frame late half-way", nullptr, [](Pairs* p) { lag_right(p, p->size() / 2); }},
    {"cameras swapped", [](M* l, M* r, N, N) { std::swap(*l, *r); }},
    {"right mirrored", [](M*, M* r, N, N) { cv::flip(*r, *r, 1); }},
    {"right covered for a while",
     [](M*, M* r, N i, N n) {
       if (i >= n / 2 && i < n / 2 + 15) r->setTo(3);
     }},
    {"both covered for a while",
     [](M* l, M* r, N i, N n) {
       if (i >= n / 2 && i < n / 2 + 8) l->setTo(3), r->setTo(3);
     }},
    {"right dark", [](M*, M* r, N i, N) { darken(r, 0.12, i); }},
    {"night", both<[](M* m, N number) { darken(m, 0.15, number); }>},
    {"flicker",
     [](M* l, M* r, N i, N) {
       l->convertTo(*l, CV_8U, i % 2 == 0 ? 1.3 : 0.7);
       r->convertTo(*r, CV_8U, i % 3 == 0 ? 1.3 : 0.7);
     }},
    {"dirt on both", both<[](M* m, N number) { spots(m, 11 + number % 2, 25); }>},
    {"rain", both<[](M* m, N number) { rain(m, number + 1); }>},
    {"JPEG 20", both<[](M* m, N) { jpeg(m, 20); }>},
    {"blurred", both<[](M* m, N) { cv::GaussianBlur(*m, *m, {}, 2); }>},
    {"a wall drives past", occlude},
    {"30 % of the pairs lost", nullptr, drop_some},
    {"every second pair", nullptr, keep_every<2>},
    {"every third pair", nullptr, keep_every<3>},
};
constexpr IntegrityVariant kTimes[] = {
    {"right one frame late", nullptr, [](Pairs* p) { lag_right(p, 0); }},
    {"right one frame late half-way", nullptr, [](Pairs* p) { lag_right(p, p->size() / 2); }},
    {"every tenth interval doubled", nullptr, leave_out_every_tenth},
    {"every second pair", nullptr, keep_every<2>},
    {"every third pair", nullptr, keep_every<3>},
    {"even 1 Hz", nullptr, [](Pairs* p) { restamp(p, Duration::milliseconds(1000)); }},
    {"one frame 2.5 rows off",
     [](M*, M* r, N i, N n) {
       if (i == n / 2) warp(r, 0, 2.5, 0, 1);
     }},
    {"a gap of two seconds", nullptr, leave_out_two_seconds},
    // Three milliradians about each axis, in periods that do not fit each other.
    {"right camera not rigid",
     [](M*, M* r, N i, N) {
       const auto turn = [i](double period) {
         return 0.17 * std::sin(2 * CV_PI * static_cast<double>(i) / period);
       };
       warp(r, pixels(*r, turn(23)), pixels(*r, turn(31)), turn(17), 1);
     }},
};
constexpr IntegrityVariant kScenes[] = {
    {"contrast a quarter",
     both<[](M* m, N) { m->convertTo(*m, CV_8U, 0.25, 0.75 * cv::mean(*m)[0]); }>},
    {"brightness a half", both<[](M* m, N) { m->convertTo(*m, CV_8U, 0.5); }>},
    {"noise of 10 grey levels", both<[](M* m, N number) { noise(m, 10, number); }>},
    {"left half covered", [](M* l, M*, N i, N) { cover_lower_half(l, i); }},
    {"right half covered", [](M*, M* r, N i, N) { cover_lower_half(r, i); }},
    {"half resolution", both<[](M* m, N) { cv::resize(*m, *m, {}, 0.5, 0.5, cv::INTER_AREA); }>},
};

}  // namespace

std::span<const IntegrityVariant> integrity_variants() { return kVariants; }
std::span<const IntegrityVariant> time_variants() { return kTimes; }
std::span<const IntegrityVariant> scene_variants() { return kScenes; }

app::StereoSequence spoil(const test::RecordedSequence& drive, const IntegrityVariant& variant,
                          const std::filesystem::path& folder) {
  app::StereoSequence s = drive.sequence;
  if (variant.pairs != nullptr) variant.pairs(&s.pairs);
  if (variant.image == nullptr) return s;
  std::filesystem::create_directories(folder);
  for (std::size_t i = 0; i < s.pairs.size(); ++i) {
    std::array<cv::Mat, 2> images;
    for (std::size_t k = 0; k < 2; ++k)
      images[k] = cv::imread((s.root / s.pairs[i].file[k]).string(), cv::IMREAD_GRAYSCALE);
    variant.image(&images[0], &images[1], i, s.pairs.size());
    for (std::size_t k = 0; k < 2; ++k) {
      const std::filesystem::path file = folder / fmt::format("{}_{:06d}.png", k, i);
      if (!cv::imwrite(file.string(), images[k], {cv::IMWRITE_PNG_COMPRESSION, 1}))
        throw std::runtime_error("cannot write " + file.string());
      s.pairs[i].file[k] = file.string();
      // Images of another size have another lens in pixels, whose centres are half a pixel in.
      Intrinsics& lens = s.calibration.intrinsics[k];
      const double scale = static_cast<double>(images[k].cols) / lens.width;
      lens.fx *= scale;
      lens.fy *= scale;
      lens.cx = scale * (lens.cx + 0.5) - 0.5;
      lens.cy = scale * (lens.cy + 0.5) - 0.5;
      lens.width = images[k].cols;
      lens.height = images[k].rows;
    }
  }
  return s;
}

}  // namespace vergence::bench
