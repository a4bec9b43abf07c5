#include "app/datasets/detail/ros_ins_messages.hpp"

#include <cmath>

#include "app/datasets/detail/ros_reader.hpp"

namespace vergence::app::detail {
namespace {

// Tolerance of a quaternion's length.
constexpr double kUnitLength = 1e-2;
// Standard deviation in m of a height that is not measured.
constexpr double kUnknownHeight = 1000;

/// Standard deviation from the variances of two axes, or of one axis twice.
double sigma(double a, double b) noexcept {
  const double variance = (a + b) / 2;
  return a >= 0 && b >= 0 && variance > 0 && std::isfinite(variance) ? std::sqrt(variance) : 0;
}

bool make_unit(std::array<double, 4>* q) noexcept {
  const double length = std::hypot(std::hypot((*q)[0], (*q)[1]), std::hypot((*q)[2], (*q)[3]));
  if (!(std::abs(length - 1) <= kUnitLength)) return false;
  for (double& v : *q) v /= length;
  return true;
}

}  // namespace

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
  RosAttitude attitude;
  attitude.stamp = in.header();
  attitude.q_world_body = in.doubles<4>();
  // In rad² about x, y, z; the first is −1 without an orientation.
  const auto covariance = in.doubles<9>();
  if (!in.ok() || covariance[0] < 0 || !make_unit(&attitude.q_world_body)) return std::nullopt;
  attitude.tilt_sigma = sigma(covariance[0], covariance[4]);
  attitude.heading_sigma = sigma(covariance[8], covariance[8]);
  return attitude;
}

}  // namespace vergence::app::detail
