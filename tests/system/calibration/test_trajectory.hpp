#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/estimator/estimator.hpp"
#include "tests/support/rendered_drive.hpp"
#include "tests/system/odometry/stereo_drive.hpp"

namespace vergence::test {

/// Settings of an estimator for one trajectory.
struct CourseSetting {
  EstimatorOptions options;
  RigCalibration given;    // what the estimator is handed
  RigCalibration nominal;  // what the gates compare with
  int threads = 2;  // 1: everything on the caller's; 2: front end on two, the solver on a third
};

/// Cameras side by side looking the same way, as far apart as the true ones: all that a
/// configuration knows.
[[nodiscard]] RigCalibration nominal_of(const RigCalibration& rig);
/// Uses only the rig's intrinsics and baseline length. Focal lengths held: the mock's are exact.
[[nodiscard]] CourseSetting from_scratch(const RigCalibration& rig);
/// The rig's own calibration in use, watched; with sigmas as sixty frames give them.
[[nodiscard]] CourseSetting with_calibration(const RigCalibration& rig);

struct Decided {
  std::uint64_t frame;
  CalibrationDecision decision;
};
struct TimedEvent {
  std::uint64_t frame;
  EstimatorEvent event;
};

/// One estimator over a drive, and everything it said.
class Course {
 public:
  explicit Course(const CourseSetting& setting);
  ~Course();

  void give(const RigFrame& frame, const Transform& T_reference_left);
  /// Frames [first, last) of a drive in memory.
  void give(const StereoDrive& drive, std::size_t first, std::size_t last, const Edit& edit = {});
  void finish();

  [[nodiscard]] const std::vector<Answer>& answers() const noexcept { return answers_; }
  /// About calibrations that were sought; not what the drive measured while it went on.
  [[nodiscard]] const std::vector<Decided>& decisions() const noexcept { return decisions_; }
  [[nodiscard]] const std::vector<TimedEvent>& events() const noexcept { return events_; }
  [[nodiscard]] const CalibrationDecision* accepted() const noexcept;  // the last one; null: none
  [[nodiscard]] int count_accepted() const noexcept;
  /// The first event of a kind; null: none.
  [[nodiscard]] const TimedEvent* first(EstimatorEvent::Kind kind) const noexcept;
  /// A decision against the new calibration gave this reason.
  [[nodiscard]] bool rejected_for(const std::string& reason) const noexcept;
  /// Since the constructor, on the estimator's thread while it worked and on the threads that help
  /// it.
  [[nodiscard]] std::uint64_t allocations() const noexcept;
  [[nodiscard]] const Estimator& estimator() const noexcept;
  /// Statuses, events and decisions in words, for the message of a failed expectation.
  [[nodiscard]] std::string story() const;

 private:
  void note(std::uint64_t frame);
  struct Parts;
  std::unique_ptr<Parts> parts_;
  std::vector<Answer> answers_;
  std::vector<Decided> decisions_;
  std::vector<TimedEvent> events_;
  std::uint64_t allocations_before_;
  std::uint64_t last_ = 0;
};

/// Difference of a calibration from the true one.
struct RigError {
  double rotation = 0;  // rad, the largest about an axis
  Vec3 t = Vec3::Zero();
  double sigmas = 0;  // the largest of the six in its noise-only sigma; t_x of the camera whose
                      // length is known is no error
};
[[nodiscard]] RigError rig_error(const RigCalibration& found, int k, const Transform& truth);
[[nodiscard]] std::string to_string(const RigError& e);

/// Frames [0, n) of a rendered drive, in memory; two cameras.
[[nodiscard]] StereoDrive film(const RenderedDriveOptions& options, std::size_t frames);

}  // namespace vergence::test
