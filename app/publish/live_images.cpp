#include "app/publish/live_images.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string_view>

#include "app/datasets/jpeg_writer.hpp"
#include "core/camera/camera.hpp"
#include "core/geometry/epipolar.hpp"
#include "core/geometry/triangulate.hpp"

namespace vergence::app {

void LiveImages::reserve(std::size_t image_bytes) {
  for (Picture& picture : pictures_) picture.rows.resize(image_bytes);
}

void LiveImages::want() noexcept {
  Owner nobody = Owner::nobody;
  (void)owner_.compare_exchange_strong(nobody, Owner::estimator, std::memory_order_acq_rel);
}

void LiveImages::take_images(const RigFrame& frame) noexcept {
  if (owner_.load(std::memory_order_acquire) != Owner::estimator) return;
  for (std::size_t k = 0; k < pictures_.size(); ++k) {
    Picture& picture = pictures_[k];
    const ImageView image = static_cast<int>(k) < frame.cameras ? frame.images[k] : ImageView{};
    picture.width = picture.height = 0;
    if (image.empty()) continue;
    const int step = (image.width + kWidth - 1) / kWidth, taken = std::min(step, 2);
    const auto width = static_cast<std::size_t>(image.width);
    const auto rows = static_cast<std::size_t>(image.height / step * taken);
    if (width * rows > picture.rows.size()) continue;  // no image of this rig
    std::uint8_t* out = picture.rows.data();
    for (int y = 0; y + step <= image.height; y += step)
      for (int i = 0; i < taken; ++i, out += width) std::memcpy(out, image.row(y + i), width);
    picture.width = image.width;
    picture.height = image.height;
    picture.step = step;
    picture.taken = taken;
  }
  frame_ = frame.number;
  points_.clear();
  owner_.store(Owner::filling, std::memory_order_relaxed);
}

void LiveImages::take_points(const RigFrame& frame, const calibration::TrackLog& tracks) noexcept {
  if (owner_.load(std::memory_order_relaxed) != Owner::filling) return;
  if (!tracks.empty() && tracks.frame(tracks.size() - 1).number == frame.number)
    for (const calibration::LoggedObservation& o : tracks.frame(tracks.size() - 1).observations) {
      if (!o.by(0)) continue;
      LivePoint point{{o.raw[0].x(), o.raw[0].y()}, {}, o.by(1)};
      if (point.both) point.right = {o.raw[1].x(), o.raw[1].y()};
      if (!points_.push(point)) break;  // as many as a page can show
    }
  owner_.store(Owner::viewer, std::memory_order_release);
}

namespace {

/// Means of `step` columns by `taken` rows.
std::vector<std::uint8_t> shrunk(const LiveImages::Picture& p, int width, int height) {
  std::vector<std::uint8_t> out(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const int count = p.step * p.taken;
  auto to = out.begin();
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* band =
        p.rows.data() + static_cast<std::size_t>(y * p.taken) * static_cast<std::size_t>(p.width);
    for (int x = 0; x < width; ++x) {
      int sum = count / 2;
      for (int row = 0; row < p.taken; ++row)
        for (int i = 0; i < p.step; ++i) sum += band[row * p.width + x * p.step + i];
      *to++ = static_cast<std::uint8_t>(sum / count);
    }
  }
  return out;
}

}  // namespace

std::string thumbnail(const LiveImages::Picture& picture) {
  const int width = picture.width / picture.step, height = picture.height / picture.step;
  if (width < 1 || height < 1) return {};
  constexpr int kQuality = 70;  // grey blocks do not show beside the points
  const std::vector<std::uint8_t> pixels = shrunk(picture, width, height);
  return grey_jpeg({pixels.data(), width, height, width}, kQuality);
}

std::string base64(std::string_view bytes) {
  constexpr const char* kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  const auto byte = [&bytes](std::size_t i) {
    return i < bytes.size() ? static_cast<unsigned>(static_cast<unsigned char>(bytes[i])) : 0U;
  };
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const unsigned three = byte(i) << 16U | byte(i + 1) << 8U | byte(i + 2);
    for (unsigned k = 0; k < 4; ++k)
      out += i + k > bytes.size() ? '=' : kDigits[three >> (18U - 6U * k) & 63U];
  }
  return out;
}

std::vector<JudgedPoint> judge_points(std::span<const LivePoint> points,
                                      const RigCalibration& rig) {
  const Camera left(rig.intrinsics[0]), right(rig.intrinsics[1]);
  const Transform& T_right_left = rig.T_camera_left[1];
  const EpipolarGeometry epipolar(T_right_left);
  const double focal = rig.intrinsics[0].fx;
  std::vector<JudgedPoint> out(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const LivePoint& p = points[i];
    Vec3 a, b;
    if (!p.both ||
        !left.unproject({static_cast<double>(p.left[0]), static_cast<double>(p.left[1])}, &a) ||
        !right.unproject({static_cast<double>(p.right[0]), static_cast<double>(p.right[1])}, &b))
      continue;
    double off = 0;
    if (epipolar.sampson(a.head<2>(), b.head<2>(), &off, nullptr) != EpipolarStatus::ok) continue;
    const std::array views{RayView{Transform{}, a.head<2>(), 1 / focal},
                           RayView{T_right_left, b.head<2>(), 1 / focal}};
    const TriangulatedPoint found = triangulate(views, {});
    out[i].rejected =
        std::abs(off) * focal > kRejectedPx || found.status == TriangulateStatus::behind;
    if (found.status == TriangulateStatus::ok)
      out[i].depth_m = static_cast<float>(found.p_world.z());
  }
  return out;
}

}  // namespace vergence::app
