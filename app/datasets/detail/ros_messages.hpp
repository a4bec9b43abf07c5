#pragma once
#include <array>

#include "app/datasets/detail/bag_scan.hpp"
#include "app/datasets/ros_camera.hpp"
#include "core/types/time.hpp"
#include "drivers/ins.hpp"

/// Messages with a sequence's images, cameras and INS, of ROS 2 (CDR) and ROS 1. By REP 103 the
/// world is east, north, up and a body forward, left, up. Lengths are checked against the available
/// bytes before allocation; pixels are not read. Readers return nothing for invalid messages.
namespace vergence::app::detail {

enum class PixelLayout : std::uint8_t {
  /// Includes the first plane of a planar YUV.
  grey,
  grey16,
  bayer,
  bayer16,
  rgb,
  bgr,
  rgba,
  bgra,
  /// YUV 4:2:2 with grey in the first or the second of two bytes.
  luma_first,
  luma_second,
  encoded,
  /// Mosaic in a PNG or JPEG.
  encoded_bayer,
};

struct RosImage {
  Stamp stamp{};
  ImageSize size{};
  PixelLayout layout = PixelLayout::grey;
  /// Applies to 16-bit samples.
  bool big_endian = false;
  /// Bytes per row; 0 if encoded.
  std::uint32_t step = 0;
  /// Offset of the data in the message.
  std::uint32_t offset = 0;
  /// Size of the data in bytes.
  std::uint32_t bytes = 0;
};

/// Maximum length in bytes of an image's fields before the data.
inline constexpr std::size_t kRosImageHead = 4096;

/// `head` has the first bytes of a message of `size` bytes. Returns nothing also for encodings not
/// in docs/datasets.md. *pixels (may be null) receives the encoding's name.
[[nodiscard]] std::optional<RosImage> read_ros_image(std::span<const std::uint8_t> head,
                                                     std::size_t size, MessageEncoding encoding,
                                                     std::string* pixels = nullptr);
/// `head` must also contain the header of the PNG or JPEG.
[[nodiscard]] std::optional<RosImage> read_ros_compressed_image(std::span<const std::uint8_t> head,
                                                                std::size_t size,
                                                                MessageEncoding encoding,
                                                                std::string* pixels = nullptr);

struct RosCameraInfo {
  /// Camera of raw images, as if of the whole sensor.
  RosCamera camera;
  /// Region that the images actually show.
  RosCrop crop{};
  /// Phrase about why it is invalid for raw images; empty if valid.
  std::string fault{};
  /// Phrase about why it is invalid for rectified images; empty if valid.
  std::string fault_rectified{};
};
[[nodiscard]] std::optional<RosCameraInfo> read_ros_camera_info(
    std::span<const std::uint8_t> message, MessageEncoding encoding);
/// Returns the camera of the rectified images.
[[nodiscard]] RosCamera rectified(RosCamera camera) noexcept;

/// Content of sensor_msgs/NavSatFix, without an attitude. With fix_2d there is no height; sigmas
/// are 0 if unknown. The status is that of the message, as an unsigned byte.
[[nodiscard]] std::optional<InsRecord> read_ros_fix(std::span<const std::uint8_t> message,
                                                    MessageEncoding encoding);

struct RosAttitude {
  Stamp stamp{};
  /// Unit quaternion x y z w.
  std::array<double, 4> q_world_body{0, 0, 0, 1};
  /// In rad; 0 if unknown.
  double tilt_sigma = 0, heading_sigma = 0;
};
/// Orientation of a sensor_msgs/Imu. Empty also if its covariance or norm marks it as absent.
[[nodiscard]] std::optional<RosAttitude> read_ros_attitude(std::span<const std::uint8_t> message,
                                                           MessageEncoding encoding);

}  // namespace vergence::app::detail
