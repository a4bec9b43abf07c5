#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "app/datasets/image_file.hpp"
#include "app/datasets/ros_camera.hpp"
#include "core/types/time.hpp"

/// The ROS 2 messages that a drive is made of, out of CDR bytes (XCDR1, either byte order). Lengths
/// are checked against the bytes that are there before anything is reserved; pixels are not
/// touched. Nothing: the bytes are no such message.
namespace vergence::app::detail {

/// Reads aligned values one after the other; once something is not there, ok() is false and every
/// further value 0.
class CdrReader {
 public:
  explicit CdrReader(std::span<const std::uint8_t> bytes) noexcept;
  template <typename T>
  [[nodiscard]] T get() noexcept;
  [[nodiscard]] std::string text();
  [[nodiscard]] Stamp header();  // std_msgs/msg/Header
  [[nodiscard]] bool ok() const noexcept { return ok_; }
  [[nodiscard]] std::size_t position() const noexcept {
    return at_;
  }  // from the message's first byte

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 4;  // behind the encapsulation, from which alignment counts
  bool little_ = true, ok_ = true;
};

enum class PixelLayout : std::uint8_t { grey, bayer, rgb, bgr, encoded };

struct RosImage {
  Stamp stamp{};
  ImageSize size{};
  PixelLayout layout = PixelLayout::grey;
  std::uint32_t step = 0;    // bytes a row; 0: encoded
  std::uint32_t offset = 0;  // of the data in the message
  std::uint32_t bytes = 0;   // of the data
};

inline constexpr std::size_t kRosImageHead =
    4096;  // bytes in which an image's own fields have to end

/// `head`: the first bytes of a message of `size` bytes. Also nothing: mono16 and other encodings.
[[nodiscard]] std::optional<RosImage> read_ros_image(std::span<const std::uint8_t> head,
                                                     std::size_t size);
/// The head of the PNG or JPEG has to lie in `head`, too.
[[nodiscard]] std::optional<RosImage> read_ros_compressed_image(std::span<const std::uint8_t> head,
                                                                std::size_t size);

struct RosCameraInfo {
  RosCamera camera;               // of raw images
  std::string fault{};            // why it is no calibration of these: a phrase; empty: it is one
  std::string fault_rectified{};  // nor of rectified images
};
[[nodiscard]] std::optional<RosCameraInfo> read_ros_camera_info(
    std::span<const std::uint8_t> message);
/// Of the images that the camera's rectification makes.
[[nodiscard]] RosCamera rectified(RosCamera camera) noexcept;

}  // namespace vergence::app::detail
