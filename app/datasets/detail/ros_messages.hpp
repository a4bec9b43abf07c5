#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "app/datasets/detail/bag_scan.hpp"
#include "app/datasets/image_file.hpp"
#include "app/datasets/ros_camera.hpp"
#include "core/types/time.hpp"

/// The messages with a drive's images and cameras, of ROS 2 (CDR) and ROS 1. Lengths are checked
/// against the bytes that are there before anything is reserved; pixels are not touched. Nothing:
/// the bytes are no such message.
namespace vergence::app::detail {

enum class PixelLayout : std::uint8_t {
  grey,  // also of a planar YUV: its first plane
  grey16,
  bayer,
  bayer16,
  rgb,
  bgr,
  rgba,
  bgra,
  luma_first,  // YUV 4:2:2: of two bytes the first, or the second, is grey
  luma_second,
  encoded,
  encoded_bayer,  // a mosaic in a PNG or JPEG
};

struct RosImage {
  Stamp stamp{};
  ImageSize size{};
  PixelLayout layout = PixelLayout::grey;
  bool big_endian = false;   // of samples of 16 bits
  std::uint32_t step = 0;    // bytes a row; 0: encoded
  std::uint32_t offset = 0;  // of the data in the message
  std::uint32_t bytes = 0;   // of the data
};

inline constexpr std::size_t kRosImageHead =
    4096;  // bytes in which an image's own fields have to end

/// `head`: the first bytes of a message of `size` bytes. Also nothing: other encodings than
/// those of docs/datasets.md. `pixels`: the encoding as the message names it, where that is not
/// null.
[[nodiscard]] std::optional<RosImage> read_ros_image(std::span<const std::uint8_t> head,
                                                     std::size_t size, MessageEncoding encoding,
                                                     std::string* pixels = nullptr);
/// The head of the PNG or JPEG has to lie in `head`, too.
[[nodiscard]] std::optional<RosImage> read_ros_compressed_image(std::span<const std::uint8_t> head,
                                                                std::size_t size,
                                                                MessageEncoding encoding,
                                                                std::string* pixels = nullptr);

struct RosCameraInfo {
  RosCamera camera;               // of raw images, as if these were of the whole sensor
  RosCrop crop{};                 // which they are not
  std::string fault{};            // why it is no calibration of these: a phrase; empty: it is one
  std::string fault_rectified{};  // nor of rectified images
};
[[nodiscard]] std::optional<RosCameraInfo> read_ros_camera_info(
    std::span<const std::uint8_t> message, MessageEncoding encoding);
/// Returns the camera of the rectified images.
[[nodiscard]] RosCamera rectified(RosCamera camera) noexcept;

}  // namespace vergence::app::detail
