#pragma once

#include "app/runtime/errors.hpp"
#include "app/simulation/rig_simulation.hpp"

namespace vergence::app {

/// Options of `vergence simulate`.
struct Experiment {
  SimulationOptions simulation{};
  std::string shape = "ball", generator = "ring", length = "exact", json;
  /// In px.
  std::vector<double> noise{0, 0.1, 0.2, 0.3};
  int runs = 100;
  std::uint64_t seed = 1;
  bool quiet = false;
};

/// Repeats the calibration experiment on simulated point clouds, with the same geometry at every
/// noise level. Prints a table, and JSON on request. Throws InputError if no view shows the whole
/// cloud, or a file cannot be written.
[[nodiscard]] ExitCode run_experiment(const Experiment& given);

}  // namespace vergence::app
