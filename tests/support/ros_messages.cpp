#include "tests/support/ros_messages.hpp"

namespace vergence::test {
namespace {

/// Row by row, with the given diagonal.
std::vector<double> diagonal(const std::vector<double>& values) {
  std::vector<double> m(values.size() * values.size(), 0.0);
  for (std::size_t i = 0; i < values.size(); ++i) m[i * (values.size() + 1)] = values[i];
  return m;
}

}  // namespace

std::string image_message(Wire wire, std::int64_t stamp, const ImageMessage& image) {
  return RosWriter(wire)
      .header(stamp)
      .put(image.height)
      .put(image.width)
      .text(image.encoding)
      .put(static_cast<std::uint8_t>(image.big_endian))
      .put(image.step)
      .blob(image.data)
      .bytes();
}

std::string compressed_message(Wire wire, std::int64_t stamp, std::string_view format,
                               std::string_view file) {
  return RosWriter(wire).header(stamp).text(format).blob(file).bytes();
}

std::string camera_info_message(Wire wire, std::int64_t stamp, const CameraInfoMessage& info) {
  return RosWriter(wire)
      .header(stamp)
      .put(info.height)
      .put(info.width)
      .text(info.model)
      .put(static_cast<std::uint32_t>(info.d.size()))
      .put_all(info.d)
      .put_all<double>({info.fx, 0, info.cx, 0, info.fy, info.cy, 0, 0, 1})
      .put_all<double>({1, 0, 0, 0, 1, 0, 0, 0, 1})
      .put_all<double>({info.fx, 0, info.cx, info.fx_times_b, 0, info.fx, info.cy, 0, 0, 0, 1, 0})
      // Binning and region of interest.
      .put_all<std::uint32_t>({0, 0, 0, 0, 0, 0})
      .put(std::uint8_t{0})
      .bytes();
}

std::string fix_message(Wire wire, std::int64_t stamp, const FixMessage& fix) {
  return RosWriter(wire)
      .header(stamp)
      .put(fix.status)
      .put(std::uint16_t{1})
      .put_all<double>({fix.latitude, fix.longitude, fix.altitude})
      .put_all(diagonal({fix.variance, fix.variance, 4 * fix.variance}))
      .put(static_cast<std::uint8_t>(fix.variance > 0 ? 2 : 0))
      .bytes();
}

std::string imu_message(Wire wire, std::int64_t stamp, const std::array<double, 4>& q,
                        double variance) {
  RosWriter w(wire);
  w.header(stamp).put_all<double>({q[0], q[1], q[2], q[3]});
  w.put_all(diagonal({variance, variance, variance}));
  // Angular velocity and acceleration.
  for (int i = 0; i < 2; ++i) w.put_all<double>({0, 0, 0}).put_all(diagonal({0, 0, 0}));
  return w.bytes();
}

}  // namespace vergence::test
