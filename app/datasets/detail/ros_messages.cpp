#include "app/datasets/detail/ros_messages.hpp"

#include <array>
#include <bit>
#include <cstring>
#include <string_view>
#include <type_traits>
#include <vector>

#include "app/datasets/detail/image_size.hpp"

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
    Encoding{"rgb8", PixelLayout::rgb, 3},          Encoding{"bgr8", PixelLayout::bgr, 3}};

bool is_rotation(const Mat3& R) {
  return (R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff() <= 1e-3;
}

}  // namespace

CdrReader::CdrReader(std::span<const std::uint8_t> bytes) noexcept : bytes_(bytes) {
  ok_ = bytes.size() >= 4 && bytes[0] == 0 && bytes[1] <= 1;
  little_ = ok_ && bytes[1] == 1;
}

template <typename T>
T CdrReader::get() noexcept {
  static_assert(std::is_arithmetic_v<T>);
  const std::size_t at = (at_ - 4 + sizeof(T) - 1) / sizeof(T) * sizeof(T) + 4;
  T value{};
  if (!ok_ || at > bytes_.size() || sizeof(T) > bytes_.size() - at) {
    ok_ = false;
    return value;
  }
  std::array<std::uint8_t, sizeof(T)> raw{};
  for (std::size_t i = 0; i < sizeof(T); ++i)
    raw[i] =
        bytes_[at +
               (little_ == (std::endian::native == std::endian::little) ? i : sizeof(T) - 1 - i)];
  std::memcpy(&value, raw.data(), sizeof(T));
  at_ = at + sizeof(T);
  return value;
}

std::string CdrReader::text() {
  const auto length = get<std::uint32_t>();  // with the 0 at its end
  if (!ok_ || length > bytes_.size() - at_) {
    ok_ = false;
    return "";
  }
  const auto* begin = reinterpret_cast<const char*>(bytes_.data() + at_);
  at_ += length;
  return length == 0 ? "" : std::string(begin, length - 1);
}

Stamp CdrReader::header() {
  const auto seconds = get<std::int32_t>();
  const auto ns = get<std::uint32_t>();
  (void)text();
  return Stamp(std::int64_t{seconds} * 1'000'000'000 + ns);
}

std::optional<RosImage> read_ros_image(std::span<const std::uint8_t> head, std::size_t size) {
  CdrReader in(head);
  RosImage image;
  image.stamp = in.header();
  const auto height = in.get<std::uint32_t>(), width = in.get<std::uint32_t>();
  const std::string encoding = in.text();
  (void)in.get<std::uint8_t>();  // bytes of 8 bits have no order
  image.step = in.get<std::uint32_t>();
  image.bytes = in.get<std::uint32_t>();
  if (!in.ok() || width < 2 || height < 2 ||
      accept_size(width, height, &image.size) != ImageFileStatus::ok)
    return std::nullopt;
  image.offset = static_cast<std::uint32_t>(in.position());
  for (const Encoding& known : kEncodings) {
    if (encoding != known.name) continue;
    if (image.step < width * known.bytes || std::uint64_t{image.step} * height > image.bytes ||
        image.bytes > size - image.offset)
      return std::nullopt;
    image.layout = known.layout;
    return image;
  }
  return std::nullopt;
}

std::optional<RosImage> read_ros_compressed_image(std::span<const std::uint8_t> head,
                                                  std::size_t size) {
  CdrReader in(head);
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

std::optional<RosCameraInfo> read_ros_camera_info(std::span<const std::uint8_t> message) {
  CdrReader in(message);
  (void)in.header();
  const auto height = in.get<std::uint32_t>(), width = in.get<std::uint32_t>();
  const std::string model = in.text();
  const auto count = in.get<std::uint32_t>();
  if (!in.ok() || count > kMostCoefficients) return std::nullopt;
  std::vector<double> d(count);
  for (double& v : d) v = in.get<double>();
  std::array<double, 9> k{};
  for (double& v : k) v = in.get<double>();
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
