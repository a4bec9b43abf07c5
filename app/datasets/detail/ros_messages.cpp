#include "app/datasets/detail/ros_messages.hpp"

#include <cmath>

#include "app/datasets/detail/image_kinds.hpp"
#include "app/datasets/detail/names.hpp"
#include "app/datasets/detail/ros_reader.hpp"

namespace vergence::app::detail {
namespace {

constexpr std::uint32_t kMaxCoefficients = 64;

struct Encodings {
  // Names in lower case, because drivers write them in either.
  std::string_view names;
  PixelLayout layout;
  // Bytes per pixel.
  std::uint32_t bytes;
};
constexpr std::array kEncodings{
    Encodings{" mono8 8uc1 i420 yuv420 yuv422p nv12 nv21 nv24 ", PixelLayout::grey, 1},
    Encodings{" mono16 16uc1 ", PixelLayout::grey16, 2},
    Encodings{" bayer_rggb8 bayer_bggr8 bayer_gbrg8 bayer_grbg8 ", PixelLayout::bayer, 1},
    Encodings{" bayer_rggb16 bayer_bggr16 bayer_gbrg16 bayer_grbg16 ", PixelLayout::bayer16, 2},
    Encodings{" rgb8 ", PixelLayout::rgb, 3},
    Encodings{" bgr8 8uc3 ", PixelLayout::bgr, 3},
    Encodings{" rgba8 ", PixelLayout::rgba, 4},
    Encodings{" bgra8 8uc4 ", PixelLayout::bgra, 4},
    Encodings{" yuyv yuv422_yuy2 ", PixelLayout::luma_first, 2},
    Encodings{" uyvy yuv422 ", PixelLayout::luma_second, 2}};

/// Returns true if a CompressedImage's format names a Bayer mosaic that was compressed without
/// demosaicing: its encoding comes first, and `compressed` is followed by the converted encoding.
bool is_mosaic(const std::string& format) {
  const std::size_t bayer = format.find("bayer_"), compressed = format.find("compressed");
  if (bayer == std::string::npos) return false;
  if (compressed == std::string::npos) return true;
  const std::string_view target = std::string_view(format).substr(compressed);
  return target.find("bgr") == std::string_view::npos &&
         target.find("rgb") == std::string_view::npos &&
         target.find("mono") == std::string_view::npos;
}

bool is_rotation(const Mat3& R) {
  return (R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff() <= 1e-3;
}

// Tolerance of a quaternion's length.
constexpr double kUnitLength = 1e-2;
// Standard deviation in m of a height that is not measured.
constexpr double kUnknownHeight = 1000;

/// Standard deviation from the variances of two axes, or of one axis twice.
double sigma(double a, double b) noexcept {
  const double variance = (a + b) / 2;
  return a >= 0 && b >= 0 && variance > 0 && std::isfinite(variance) ? std::sqrt(variance) : 0;
}

}  // namespace

std::optional<RosImage> read_ros_image(std::span<const std::uint8_t> head, std::size_t size,
                                       MessageEncoding encoding, std::string* name) {
  RosReader in(head, encoding);
  RosImage image{.stamp = in.header()};
  const auto height = in.get<std::uint32_t>(), width = in.get<std::uint32_t>();
  const std::string pixels = in.text();
  if (name != nullptr) *name = pixels.substr(0, 40);
  image.big_endian = in.get<std::uint8_t>() != 0;
  image.step = in.get<std::uint32_t>();
  image.bytes = in.get<std::uint32_t>();
  if (!in.ok() || width < 2 || height < 2 ||
      accept_size(width, height, &image.size) != ImageFileStatus::ok)
    return std::nullopt;
  image.offset = static_cast<std::uint32_t>(in.position());
  for (const Encodings& known : kEncodings) {
    if (known.names.find(" " + lower(pixels) + " ") == std::string_view::npos) continue;
    // Some publishers do not set it.
    if (image.step == 0) image.step = width * known.bytes;
    if (image.step < width * known.bytes || std::uint64_t{image.step} * height > image.bytes ||
        image.bytes > size - image.offset)
      return std::nullopt;
    image.layout = known.layout;
    return image;
  }
  return std::nullopt;
}

std::optional<RosImage> read_ros_compressed_image(std::span<const std::uint8_t> head,
                                                  std::size_t size, MessageEncoding encoding,
                                                  std::string* name) {
  RosReader in(head, encoding);
  RosImage image{.stamp = in.header()};
  // The format is only used to detect mosaics, because the data identify PNG and JPEG.
  const std::string format = in.text();
  if (name != nullptr) *name = format.substr(0, 40);
  image.layout = is_mosaic(format) ? PixelLayout::encoded_bayer : PixelLayout::encoded;
  image.bytes = in.get<std::uint32_t>();
  if (!in.ok()) return std::nullopt;
  image.offset = static_cast<std::uint32_t>(in.position());
  if (image.bytes > size - image.offset) return std::nullopt;
  const auto data = head.subspan(image.offset)
                        .first(std::min<std::size_t>(image.bytes, head.size() - image.offset));
  if (read_image_size(data, &image.size) != ImageFileStatus::ok) return std::nullopt;
  return image;
}

std::optional<RosCameraInfo> read_ros_camera_info(std::span<const std::uint8_t> message,
                                                  MessageEncoding encoding) {
  RosReader in(message, encoding);
  (void)in.header();
  const auto height = in.get<std::uint32_t>(), width = in.get<std::uint32_t>();
  const std::string model = in.text();
  const auto count = in.get<std::uint32_t>();
  if (!in.ok() || count > kMaxCoefficients) return std::nullopt;
  std::vector<double> d(count);
  for (double& v : d) v = in.get<double>();
  const auto k = in.doubles<9>();
  RosCameraInfo info;
  RosCamera& camera = info.camera;
  for (int i = 0; i < 9; ++i) camera.R(i / 3, i % 3) = in.get<double>();
  for (int i = 0; i < 12; ++i) camera.P(i / 4, i % 4) = in.get<double>();
  if (!in.ok()) return std::nullopt;
  RosCrop crop;
  for (std::uint32_t* value :
       {&crop.binning_x, &crop.binning_y, &crop.x, &crop.y, &crop.height, &crop.width})
    *value = in.get<std::uint32_t>();
  if (in.ok()) info.crop = crop;
  Intrinsics& lens = camera.lens;
  ImageSize size;
  if (accept_size(width, height, &size) != ImageFileStatus::ok) return std::nullopt;
  lens.width = size.width, lens.height = size.height;
  lens.fx = k[0], lens.fy = k[4], lens.cx = k[2], lens.cy = k[5];
  if (!(camera.P(0, 0) > 0 && camera.P(1, 1) > 0))
    info.fault_rectified = "P has no positive focal lengths, so the driver has no calibration";
  info.fault = info.fault_rectified;
  if (!(lens.fx > 0 && lens.fy > 0)) info.fault = "K has no positive focal lengths";
  if (const std::string fault = set_ros_distortion(model, d, &lens); !fault.empty())
    info.fault = "D " + fault;
  if (camera.R.isZero(0) && is_rectified(camera)) camera.R.setIdentity();
  if (!is_rotation(camera.R)) info.fault = "R is not a rotation";
  return info;
}

RosCamera rectified(RosCamera camera) noexcept {
  Intrinsics& lens = camera.lens;
  lens.kind = CameraModelKind::pinhole_radtan;
  lens.distortion = {};
  lens.fx = camera.P(0, 0), lens.fy = camera.P(1, 1), lens.cx = camera.P(0, 2),
  lens.cy = camera.P(1, 2);
  camera.R = Mat3::Identity();
  return camera;
}

std::optional<InsRecord> read_ros_fix(std::span<const std::uint8_t> message,
                                      MessageEncoding encoding) {
  RosReader in(message, encoding);
  InsRecord record;
  InsSample& fix = record.sample;
  fix.stamp = in.header();
  // −1 is no fix, 0 a fix, 1 and 2 a fix with corrections.
  const auto status = in.get<std::int8_t>();
  // The satellite systems are skipped.
  (void)in.get<std::uint16_t>();
  fix.position.latitude_deg = in.get<double>();
  fix.position.longitude_deg = in.get<double>();
  // Height above the ellipsoid; NaN if unknown.
  fix.position.height_m = in.get<double>();
  // In m²: east, north, up.
  const auto covariance = in.doubles<9>();
  const auto covariance_type = in.get<std::uint8_t>();
  if (!in.ok()) return std::nullopt;
  record.quality.status = static_cast<std::uint8_t>(status);
  if (covariance_type != 0) {
    fix.position_sigma = sigma(covariance[0], covariance[4]);
    fix.height_sigma = sigma(covariance[8], covariance[8]);
  }
  if (status < 0) {
    if (!fix.position.plausible()) fix.position = {};
    return record;
  }
  record.quality.filter_valid = true;
  fix.fix = FixStatus::fix_3d;
  if (std::isnan(fix.position.height_m)) {
    fix.fix = FixStatus::fix_2d;
    fix.position.height_m = 0;
    fix.height_sigma = kUnknownHeight;
  }
  if (!fix.position.plausible()) return std::nullopt;
  return record;
}

std::optional<RosAttitude> read_ros_attitude(std::span<const std::uint8_t> message,
                                             MessageEncoding encoding) {
  RosReader in(message, encoding);
  RosAttitude attitude{.stamp = in.header(), .q_world_body = in.doubles<4>()};
  // In rad² about x, y, z; the first is −1 without an orientation.
  const auto covariance = in.doubles<9>();
  auto& q = attitude.q_world_body;
  const double length = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3]));
  if (!in.ok() || covariance[0] < 0 || !(std::abs(length - 1) <= kUnitLength)) return std::nullopt;
  for (double& v : q) v /= length;
  attitude.tilt_sigma = sigma(covariance[0], covariance[4]);
  attitude.heading_sigma = sigma(covariance[8], covariance[8]);
  return attitude;
}

}  // namespace vergence::app::detail
