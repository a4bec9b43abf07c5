// The rendered suburb measured against the geometry it was rendered from.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

#include <Eigen/LU>
#include <opencv2/imgproc.hpp>

#include "drivers/mock/world/drive.hpp"
#include "drivers/mock/world/renderer.hpp"

namespace vergence::mock {
namespace {

std::shared_ptr<const World> town() {
  static const auto world = std::make_shared<const World>(WorldOptions{});
  return world;
}

Camera lens() {
  Intrinsics k;
  k.width = 640;
  k.height = 480;
  k.fx = k.fy = 554;
  k.cx = 321;
  k.cy = 238;
  k.distortion = {-0.2, 0.06, 0.0003, -0.0005, 0};
  return Camera(k);
}

cv::Mat take(Renderer* renderer, const Transform& T_camera_enu) {
  cv::Mat image(480, 640, CV_8UC1);
  renderer->render(T_camera_enu, Shot{.vignetting = 0}, image.data,
                   static_cast<std::ptrdiff_t>(image.step));
  return image;
}

/// A picture between its pixels: blurred a little, so that cubic interpolation (Catmull–Rom) has no
/// bias of its own.
class Interpolated {
 public:
  explicit Interpolated(const cv::Mat& image) {
    image.convertTo(values_, CV_64F);
    cv::GaussianBlur(values_, values_, cv::Size(9, 9), 1.0);
  }
  struct Sample {
    double value, dx, dy;
  };
  [[nodiscard]] Sample at(const Vec2& p) const {
    const int x = static_cast<int>(std::floor(p.x())), y = static_cast<int>(std::floor(p.y()));
    const auto [wx, sx] = weights(p.x() - x);
    const auto [wy, sy] = weights(p.y() - y);
    Sample out{0, 0, 0};
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i) {
        const double v = values_.at<double>(y - 1 + j, x - 1 + i);
        out.value += wy[j] * wx[i] * v;
        out.dx += wy[j] * sx[i] * v;
        out.dy += sy[j] * wx[i] * v;
      }
    return out;
  }

 private:
  static std::pair<Vec4, Vec4> weights(double t) {
    return {Vec4(((-0.5 * t + 1) * t - 0.5) * t, (1.5 * t - 2.5) * t * t + 1,
                 ((-1.5 * t + 2) * t + 0.5) * t, (0.5 * t - 0.5) * t * t),
            Vec4((-1.5 * t + 2) * t - 0.5, (4.5 * t - 5) * t, (-4.5 * t + 4) * t + 0.5,
                 (1.5 * t - 1) * t)};
  }
  cv::Mat values_;
};

constexpr int kReach = 5;  // px: patches of 11 x 11
using Patch = std::array<Vec2, (2 * kReach + 1) * (2 * kReach + 1)>;

/// Where the patch round a pixel of view a lies in view b by the geometry. False: out of sight in
/// either, behind leaves, or not on one smooth surface.
bool carry(const Camera& camera, const Transform& T_a_enu, const Transform& T_b_enu,
           const Vec2& centre, Patch* a, Patch* b) {
  constexpr int kSide = 2 * kReach + 1;
  const Transform T_enu_a = T_a_enu.inverse(), T_enu_b = T_b_enu.inverse();
  std::array<double, kSide * kSide> inverse_depth{};
  for (int k = 0; k < kSide * kSide; ++k) {
    const auto i = static_cast<std::size_t>(k);
    (*a)[i] = centre + Vec2(k % kSide - kReach, k / kSide - kReach);
    Vec3 ray;
    if (!camera.unproject((*a)[i], &ray)) return false;
    const auto hit = town()->cast(T_enu_a.t, T_enu_a.R * ray);
    if (!hit || hit->veiled) return false;
    const Vec3 point = T_enu_a * (hit->distance * ray);
    if (camera.project(T_b_enu * point, &(*b)[i], nullptr) != ProjectStatus::ok ||
        !camera.inside((*b)[i], 4))
      return false;
    inverse_depth[i] = 1 / hit->distance;
    if (k % 5 == 0) {
      const auto seen = town()->cast(T_enu_b.t, point - T_enu_b.t);
      if (!seen || seen->veiled || seen->distance < 0.999) return false;
    }
  }
  // Inverse depth is linear over a plane: a jump or a fold shows in second differences.
  for (int k = 0; k < kSide * kSide; ++k)
    for (const int step : {1, kSide}) {
      const int place = step == 1 ? k % kSide : k / kSide;
      if (place == 0 || place == kSide - 1) continue;
      const auto at = [&](int i) { return inverse_depth[static_cast<std::size_t>(i)]; };
      if (std::abs(at(k - step) - 2 * at(k) + at(k + step)) > 0.003 * at(k)) return false;
    }
  return true;
}

/// The shift that is left between two patches which should show the same, by Gauss–Newton. False:
/// no structure, no convergence.
bool left_over(const Interpolated& image_a, const Interpolated& image_b, const Patch& a,
               const Patch& b, Vec2* shift) {
  *shift = Vec2::Zero();
  for (int turn = 0; turn < 20; ++turn) {
    Mat2 H = Mat2::Zero();
    Vec2 g = Vec2::Zero();
    double offset = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
      offset += (image_b.at(b[i] + *shift).value - image_a.at(a[i]).value) /
                static_cast<double>(a.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      const auto sa = image_a.at(a[i]), sb = image_b.at(b[i] + *shift);
      const Vec2 slope(sb.dx, sb.dy);
      H += slope * slope.transpose();
      g += slope * (sa.value + offset - sb.value);
    }
    if (H.determinant() < 1e-3 * H.trace() * H.trace() || H.trace() < 100) return false;
    const Vec2 step = H.inverse() * g;
    *shift += step;
    if (shift->norm() > 2) return false;
    if (step.norm() < 1e-5) return true;
  }
  return false;
}

/// How far, px, corners of one view are off in another from where the geometry puts them; sorted.
std::vector<double> errors_between(const Transform& T_a_enu, const Transform& T_b_enu) {
  const Camera camera = lens();
  Renderer renderer(town(), camera);
  const cv::Mat a = take(&renderer, T_a_enu), b = take(&renderer, T_b_enu);
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(a, corners, 250, 0.03, 10);
  const Interpolated image_a(a), image_b(b);
  std::vector<double> errors;
  for (const cv::Point2f& c : corners) {
    const Vec2 centre(static_cast<double>(c.x), static_cast<double>(c.y));
    Patch patch_a, patch_b;
    Vec2 shift;
    if (!camera.inside(centre, kReach + 4.0) ||
        !carry(camera, T_a_enu, T_b_enu, centre, &patch_a, &patch_b))
      continue;
    if (left_over(image_a, image_b, patch_a, patch_b, &shift)) errors.push_back(shift.norm());
  }
  std::sort(errors.begin(), errors.end());
  return errors;
}

Transform view(double seconds) {
  static const Drive drive(DriveOptions{}, *town());
  return camera_pose(drive.at(Duration::seconds(seconds)), default_T_body_left());
}

double quantile(const std::vector<double>& sorted, double q) {
  return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))];
}

TEST(Town, standingCameraSeesTheSamePicture) {
  Renderer renderer(town(), lens());
  const cv::Mat a = take(&renderer, view(0.5)), b = take(&renderer, view(1.5));
  cv::Mat difference;
  cv::absdiff(a, b, difference);
  // The spline's weights add up to one within a rounding, which may tip a grey value that lies on a
  // half.
  EXPECT_LE(cv::norm(difference, cv::NORM_INF), 1);
  EXPECT_LE(cv::countNonZero(difference), 30);
}

TEST(Town, cornersAreStableUnderSubPixelTurns) {
  // A turn moves all depths alike: what is left is aliasing, 8-bit rounding of weak corners and the
  // measurement's own error, of which a picture of 16 times as many rays still shows 0.012 px.
  for (const double seconds : {0.0, 30.0, 60.0, 90.0})
    for (const double fraction : {0.25, 0.5, 0.75}) {
      const double angle = fraction / 554;
      const Transform T = view(seconds),
                      turned =
                          Transform{exp_so3({0.6 * angle, angle, 0.1 * angle}), Vec3::Zero()} * T;
      const auto errors = errors_between(T, turned);
      ASSERT_GT(errors.size(), 20U) << seconds;
      EXPECT_LT(quantile(errors, 0.5), 0.025) << seconds << " s, " << fraction << " px";
      EXPECT_LT(quantile(errors, 0.9), 0.08) << seconds << " s, " << fraction << " px";
    }
}

TEST(Town, disparityOfARenderedPairFitsItsDepth) {
  const Transform T_right_left{exp_so3({0.003, -0.008, 0.005}), Vec3(-0.75, 0.01, -0.02)};
  for (const double seconds : {10.0, 45.0, 100.0}) {
    const auto errors = errors_between(view(seconds), T_right_left * view(seconds));
    ASSERT_GT(errors.size(), 20U) << seconds;
    EXPECT_LT(quantile(errors, 0.5), 0.06) << seconds;
    EXPECT_LT(quantile(errors, 0.8), 0.15) << seconds;
  }
}

TEST(Town, cornersFollowTheDriveFromFrameToFrame) {
  for (const double seconds : {8.0, 26.0, 58.0}) {
    const auto errors = errors_between(view(seconds), view(seconds + 0.05));
    ASSERT_GT(errors.size(), 20U) << seconds;
    EXPECT_LT(quantile(errors, 0.5), 0.06) << seconds;
    EXPECT_LT(quantile(errors, 0.8), 0.15) << seconds;
  }
}

TEST(Town, hasNearAndFarStructureAllAlongTheLoop) {
  const Drive drive(DriveOptions{}, *town());
  for (double seconds = 0; seconds < drive.duration().to_seconds(); seconds += 9) {
    const Transform T_camera_enu = view(seconds), T_enu_camera = T_camera_enu.inverse();
    Renderer renderer(town(), lens());
    const cv::Mat image = take(&renderer, T_camera_enu);
    std::vector<cv::Point2f> corners;
    cv::goodFeaturesToTrack(image, corners, 500, 0.01, 8);
    int near = 0, far = 0;
    for (const cv::Point2f& c : corners) {
      Vec3 ray;
      ASSERT_TRUE(lens().unproject({static_cast<double>(c.x), static_cast<double>(c.y)}, &ray));
      const auto depth = town()->cast(T_enu_camera.t, T_enu_camera.R * ray);
      if (!depth) continue;
      near += depth->distance < 15;
      far += depth->distance > 40;
    }
    EXPECT_GT(corners.size(), 150U) << seconds;
    EXPECT_GT(near, 20) << seconds;
    EXPECT_GT(far, 20) << seconds;
    const double brightness = cv::mean(image)[0];
    EXPECT_GT(brightness, 70) << seconds;
    EXPECT_LT(brightness, 170) << seconds;
  }
}

TEST(Town, nothingStandsInTheVehiclesWay) {
  for (const DriveKind kind :
       {DriveKind::loop, DriveKind::figure_eight, DriveKind::straight, DriveKind::brief}) {
    DriveOptions options;
    options.kind = kind;
    const Drive drive(options, *town());
    for (Duration t{}; t < drive.duration(); t = t + Duration::milliseconds(400)) {
      const BodyState s = drive.at(t);
      for (const double side : {-0.9, 0.9}) {  // a car is 1.8 m wide; 1 m ahead at bumper height
        const Vec3 origin = s.T_enu_body * Vec3(0, side, 0.6);
        const auto hit = town()->cast(origin, s.T_enu_body.R.col(0));
        if (hit) {
          EXPECT_GT(hit->distance, 1.0) << static_cast<int>(kind) << " at " << t.to_seconds();
        }
      }
    }
  }
}

TEST(Town, sameSeedSamePictureOtherSeedOtherTown) {
  const Camera camera = lens();
  WorldOptions options;
  options.texture_detail = 0;
  Renderer a(std::make_shared<const World>(options), camera),
      b(std::make_shared<const World>(options), camera);
  options.seed = 2;
  Renderer c(std::make_shared<const World>(options), camera);
  const Transform T = view(20);
  EXPECT_EQ(cv::norm(take(&a, T), take(&b, T), cv::NORM_INF), 0);
  EXPECT_GT(cv::norm(take(&a, T), take(&c, T), cv::NORM_INF), 50);
}

TEST(Town, aBusThatFillsTheViewHidesTheTownAndIsTexturedItself) {
  Renderer renderer(town(), lens());
  // Its rear 1.2 m ahead: 92 by 106 degrees, the picture is 60 by 47.
  Transform T_camera_bus = view(20) * view(20).inverse();
  T_camera_bus.R << 0, -1, 0, 0, 0, -1, 1, 0, 0;  // its forward, left, up in the camera's axes
  T_camera_bus.t = {0, 1.7, 1.2 + 0.5 * kBusLength};
  const auto take_behind = [&](const Transform& T_camera_enu) {
    cv::Mat image(480, 640, CV_8UC1);
    renderer.render(std::span(&T_camera_enu, 1), Shot{.vignetting = 0}, image.data,
                    static_cast<std::ptrdiff_t>(image.step), std::span(&T_camera_bus, 1));
    return image;
  };
  const cv::Mat here = take_behind(view(20)), there = take_behind(view(45));
  EXPECT_EQ(cv::norm(here, there, cv::NORM_INF), 0) << "something of the town is seen";
  cv::Scalar mean, deviation;
  cv::meanStdDev(here, mean, deviation);
  EXPECT_GT(deviation[0], 15) << "there are edges to be seen on it";
}

TEST(World, refusesImpossibleOptionsByName) {
  WorldOptions options;
  options.built_fraction = 1.5;
  try {
    const World world(options);
    FAIL() << "a fraction over one was accepted";
  } catch (const std::invalid_argument& e) {
    EXPECT_NE(std::string(e.what()).find("built_fraction"), std::string::npos);
  }
}

}  // namespace
}  // namespace vergence::mock
