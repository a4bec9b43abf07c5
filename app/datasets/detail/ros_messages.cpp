#include "app/datasets/detail/ros_messages.hpp"

#include <array>
#include <string_view>
#include <vector>

#include "app/datasets/detail/image_size.hpp"
#include "app/datasets/detail/ros_reader.hpp"

namespace vergence::app::detail {
namespace {

constexpr std::uint32_t kMostCoefficients = 64;

struct Encoding {
  std::string_view name;
  PixelLayout layout;
  std::uint32_t bytes;  // a pixel
};
constexpr std::array kEncodings{
    Encoding{"mono8", PixelLayout::grey, 1},        Encoding{"8UC1", PixelLayout::grey, 1},
    Encoding{"bayer_rggb8", PixelLayout::bayer, 1}, Encoding{"bayer_bggr8", PixelLayout::bayer, 1},
    Encoding{"bayer_gbrg8", PixelLayout::bayer, 1}, Encoding{"bayer_grbg8", PixelLayout::bayer, 1},
    Encoding{"rgb8", PixelLayout::rgb, 3},          Encoding{"bgr8", PixelLayout::bgr, 3},
    Encoding{"mono16", PixelLayout::grey16, 2},     Encoding{"16UC1", PixelLayout::grey16, 2}};

bool is_rotation(const Mat3& R) {
  return (R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff() <= 1e-3;
}

}  // namespace

std::optional<RosImage> read_ros_image(std::span<const std::uint8_t> head, std::size_t size,
                                       MessageEncoding encoding) {
  RosReader in(head, encoding);
  RosImage image;
  image.stamp = in.header();
  const auto height = in.get<std::uint32_t>(), width = in.get<std::uint32_t>();
  const std::string pixels = in.text();
  image.big_endian = in.get<std::uint8_t>() != 0;
  image.step = in.get<std::uint32_t>();
  image.bytes = in.get<std::uint32_t>();
  if (!in.ok() || width < 2 || height < 2 ||
      accept_size(width, height, &image.size) != ImageFileStatus::ok)
    return std::nullopt;
  image.offset = static_cast<std::uint32_t>(in.position());
  for (const Encoding& known : kEncodings) {
    if (pixels != known.name) continue;
    if (image.step < width * known.bytes || std::uint64_t{image.step} * height > image.bytes ||
        image.bytes > size - image.offset)
      return std::nullopt;
    image.layout = known.layout;
    return image;
  }
  return std::nullopt;
}

std::optional<RosImage> read_ros_compressed_image(std::span<const std::uint8_t> head,
                                                  std::size_t size, MessageEncoding encoding) {
  RosReader in(head, encoding);
  RosImage image;
  image.layout = PixelLayout::encoded;
  image.stamp = in.header();
  (void)in.text();  // the format's name: the bytes tell it better
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
  if (!in.ok() || count > kMostCoefficients) return std::nullopt;
  std::vector<double> d(count);
  for (double& v : d) v = in.get<double>();
  const auto k = in.doubles<9>();
  RosCameraInfo info;
  RosCamera& camera = info.camera;
  for (int i = 0; i < 9; ++i) camera.R(i / 3, i % 3) = in.get<double>();
  for (int i = 0; i < 12; ++i) camera.P(i / 4, i % 4) = in.get<double>();
  if (!in.ok()) return std::nullopt;
  Intrinsics& lens = camera.lens;
  ImageSize size;
  if (accept_size(width, height, &size) != ImageFileStatus::ok) return std::nullopt;
  lens.width = size.width, lens.height = size.height;
  lens.fx = k[0], lens.fy = k[4], lens.cx = k[2], lens.cy = k[5];
  if (!(camera.P(0, 0) > 0 && camera.P(1, 1) > 0))
    info.fault_rectified = "p has no positive focal lengths";
  info.fault = info.fault_rectified;
  if (const std::string fault = set_ros_distortion(model, d, &lens); !fault.empty())
    info.fault = "d " + fault;
  if (!is_rotation(camera.R)) info.fault = "r is not a rotation";
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

}  // namespace vergence::app::detail
