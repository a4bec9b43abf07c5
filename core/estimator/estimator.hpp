#pragma once
#include <cstddef>
#include <memory>
#include <span>

#include "core/memory/arena.hpp"
#include "core/odometry/options.hpp"
#include "core/types/calibration.hpp"
#include "core/types/parallel.hpp"
#include "core/types/pose_sample.hpp"
#include "core/types/rig_frame.hpp"

namespace vergence {

struct EstimatorOptions {
  OdometryOptions odometry{};
};

/// Something worth a line in events.jsonl. `why` points to a constant.
struct EstimatorEvent {
  Stamp stamp{};
  enum class Kind : std::uint8_t { state, scene_restarted, time_gap, relocalised, dropped } kind = Kind::state;
  State from = State::initialising;
  State to = State::initialising;
  const char* why = "";
  double value = 0;  // seconds of a gap, count of what was dropped; 0 where nothing is counted
};

/// Rig frames in, a pose for each out: the front door of core.
///
/// Ownership  Keeps references to the arena and the runner; images are read during process() only.
/// Threads    One caller; process() uses the runner for the second image's front end. Same poses whatever the runner.
/// Memory     All of it from the arena in the constructor. process() allocates nothing.
/// Errors     The constructor throws (std::invalid_argument with a sentence, std::length_error). process() never does.
class Estimator {
 public:
  /// What the arena must offer for these options and this rig, bytes.
  [[nodiscard]] static std::size_t memory_needed(const EstimatorOptions& options, const RigCalibration& rig);

  Estimator(const EstimatorOptions& options, const RigCalibration& rig, Arena& arena, PairRunner& runner);
  ~Estimator();
  Estimator(const Estimator&) = delete;
  Estimator& operator=(const Estimator&) = delete;

  /// One frame, stamps strictly increasing (a frame that is not newer is answered `lost`, reason time_gap, and changes nothing).
  /// An empty image is a camera that gave none. T_world_left never jumps but across a marked gap.
  [[nodiscard]] PoseSample process(const RigFrame& frame) noexcept;

  /// Of the last process() call, oldest first; valid until the next.
  [[nodiscard]] std::span<const EstimatorEvent> events() const noexcept;

  [[nodiscard]] State state() const noexcept;
  /// The calibration in use.
  [[nodiscard]] const RigCalibration& calibration() const noexcept;

 private:
  struct Parts;
  Parts* parts_;  // in the arena
};

}  // namespace vergence
