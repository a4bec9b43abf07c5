#pragma once
#include <cstdint>
#include <string>

#include "app/runtime/errors.hpp"
#include "app/simulation/rig_simulation.hpp"

namespace vergence::app {

/// `vergence simulate`: the words as given; checked by run_experiment().
struct Experiment {
  SimulationOptions simulation{};
  std::string shape = "ball", generator = "ring", length = "exact", noise = "0,0.1,0.2,0.3", json;
  int runs = 100;
  std::uint64_t seed = 1;
  bool quiet = false;
};

/// Repeats the calibration experiment on simulated point clouds, every noise level with the same
/// geometry; a table on standard output, and JSON if asked for.
/// Errors  InputError: an option out of its range, a file that cannot be written.
[[nodiscard]] ExitCode run_experiment(const Experiment& given);

}  // namespace vergence::app
