#pragma once
#include <array>

#include "tests/support/bag_writer.hpp"

/// Messages of ROS as their publishers serialise them, byte by byte. Stamps in ns.
namespace vergence::test {

struct ImageMessage {
  /// px.
  std::uint32_t width = 0, height = 0;
  /// Bytes a row.
  std::uint32_t step = 0;
  std::string encoding = "mono8";
  std::string data{};
  bool big_endian = false;
};
[[nodiscard]] std::string image_message(Wire wire, std::int64_t stamp, const ImageMessage& image);
[[nodiscard]] std::string compressed_message(Wire wire, std::int64_t stamp, std::string_view format,
                                             std::string_view file);

struct CameraInfoMessage {
  std::uint32_t width = 0, height = 0;
  std::string model = "plumb_bob";
  std::vector<double> d{0, 0, 0, 0, 0};
  /// Numbers of K and, with fy = fx, of P.
  double fx = 0, fy = 0, cx = 0, cy = 0;
  /// Fourth number of P, px·m.
  double fx_times_b = 0;
};
[[nodiscard]] std::string camera_info_message(Wire wire, std::int64_t stamp,
                                              const CameraInfoMessage& info);

struct FixMessage {
  std::int8_t status = 0;
  /// deg, m.
  double latitude = 0, longitude = 0, altitude = 0;
  /// East and north, m²; up four times.
  double variance = 0;
};
[[nodiscard]] std::string fix_message(Wire wire, std::int64_t stamp, const FixMessage& fix);

/// q: x y z w. `variance`: rad², of all three; −1: there is no orientation.
[[nodiscard]] std::string imu_message(Wire wire, std::int64_t stamp, const std::array<double, 4>& q,
                                      double variance = 0);

}  // namespace vergence::test
