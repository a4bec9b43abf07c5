#pragma once
#include <optional>
#include <string>

#include "core/estimator/estimator.hpp"
#include "tests/unit/core/odometry/corridor.hpp"

namespace vergence::test {

/// An estimator on the corridor's rig, and everything that it has reported.
struct CorridorDrive {
  odometry::test::Corridor corridor;
  EstimatorOptions options;
  RigCalibration given = corridor.rig(), nominal = given;
  SequentialRunner runner;
  ImmediateRunner solver;
  std::optional<Arena> arena;
  std::optional<Estimator> estimator;

  std::vector<PoseSample> samples;
  std::vector<EstimatorEvent> events;
  // Frame numbers of the events.
  std::vector<std::uint64_t> frames;
  std::vector<CalibrationDecision> decisions;
  // Text of all of these, for the messages of failed checks.
  std::string story;

  CorridorDrive() {
    nominal.T_camera_left[1] = {Mat3::Identity(), {-given.baseline, 0, 0}};
    given.sigma_noise[1] = {2e-4, 4e-4, 2e-4, 1e-5, 2e-3, 4e-3};
  }
  void begin() {
    arena.emplace();
    estimator.emplace(options, given, nominal, *arena, runner, solver);
  }
  const PoseSample& give(const RigFrame& frame) {
    samples.push_back(estimator->process(frame));
    const PoseSample& s = samples.back();
    story += std::to_string(s.frame) + ' ' + std::string(to_string(s.status)) + ' ' +
             std::string(to_string(s.reason)) + '\n';
    note();
    return s;
  }
  /// Stores the events and decisions of the last call.
  void note() {
    for (const EstimatorEvent& e : estimator->events()) {
      events.push_back(e);
      frames.push_back(samples.back().frame);
      story += std::to_string(static_cast<int>(e.kind)) + ' ' + std::string(to_string(e.from)) +
               " → " + std::string(to_string(e.to)) + ": " + e.why + ' ' + std::to_string(e.value) +
               '\n';
    }
    for (const CalibrationDecision& d : estimator->calibrations()) {
      decisions.push_back(d);
      story += std::string(d.accepted ? "accepted " : "rejected ") + d.reason + ", depth off by " +
               std::to_string(d.depth_error_percent) + " %, sigma " +
               std::to_string(d.depth_sigma_percent) + " %\n";
    }
  }
  [[nodiscard]] int count(EstimatorEvent::Kind kind) const {
    return static_cast<int>(std::count_if(
        events.begin(), events.end(), [kind](const EstimatorEvent& e) { return e.kind == kind; }));
  }
  /// Frame of the first event of a kind from frame `from` on; −1 if there is none.
  [[nodiscard]] int first(EstimatorEvent::Kind kind, int from = 0) const {
    for (std::size_t i = 0; i < events.size(); ++i)
      if (events[i].kind == kind && static_cast<int>(frames[i]) >= from)
        return static_cast<int>(frames[i]);
    return -1;
  }
};

}  // namespace vergence::test
