#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "app/runtime/errors.hpp"
#include "app/simulation/rig_simulation.hpp"

namespace vergence::app {

/// Options of `vergence simulate`.
struct Experiment {
  SimulationOptions simulation{};
  std::string shape = "ball", generator = "ring", length = "exact", json;
  std::vector<double> noise{0, 0.1, 0.2, 0.3};  // px
  int runs = 100;
  std::uint64_t seed = 1;
  bool quiet = false;
};

/// Repeats the calibration experiment on simulated point clouds, every noise level with the same
/// geometry; a table on standard output, and JSON if asked for.
/// Errors  InputError: a cloud that no view shows whole, a file that cannot be written.
[[nodiscard]] ExitCode run_experiment(const Experiment& given);

}  // namespace vergence::app
