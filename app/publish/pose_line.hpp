#pragma once
#include <optional>
#include <string>

#include "app/recorder/records.hpp"
#include "core/comparison/geodesy.hpp"
#include "core/comparison/placement.hpp"
#include "core/types/pose_sample.hpp"

namespace vergence::app {

/// Where the odometry's world lies on the earth, as plain numbers for a ring.
struct PublishedPlacement {
  PoseNumbers T_enu_world{};
  Geodetic origin{};  // of enu
};

/// One pose on its way from the estimator's thread to a publisher's.
struct PublishedPose {
  std::uint64_t frame = 0;
  Stamp stamp{};    // mid-exposure
  HostStamp out{};  // when the estimator was done
  State state = State::initialising;
  PoseStatus status = PoseStatus::lost;
  Reason reason = Reason::none;
  PoseNumbers world_left{};                       // meaningless when `lost`
  Covariance6 covariance{}, motion_covariance{};  // as PoseSample's
  float length_sigma = 0;
  int inliers = 0, stereo_inliers = 0;
  double reprojection_px = 0;
  float estimate_ms = 0;

  [[nodiscard]] static PublishedPose of(const PoseSample& sample, HostStamp out) noexcept;
};

/// The placement with its tangent plane, for one thread that brings poses to the earth.
class Earth {
 public:
  explicit Earth(const PublishedPlacement& placement)
      : T_enu_world_(placement.T_enu_world.transform()), plane_(placement.origin) {}
  [[nodiscard]] EarthNumbers of(const PoseNumbers& world_left) const;

 private:
  Transform T_enu_world_;
  LocalTangentPlane plane_;
};

/// One JSON object and a line feed (docs/publish.md is its schema). `age_ms`: from mid-exposure
/// to now, where stamps are tied to this machine's clock. `dropped`: lines that were not made
/// since the start. `line` is replaced; its memory is used again.
void write_pose_line(const PublishedPose& pose, const std::optional<EarthNumbers>& earth,
                     std::optional<double> age_ms, std::uint64_t dropped, std::string* line);

}  // namespace vergence::app
