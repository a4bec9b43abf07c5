#include <memory>
#include <numbers>

#include "app/command_line/common_options.hpp"
#include "app/commands/commands.hpp"
#include "app/simulation/experiment.hpp"

namespace vergence::app {

void add_simulate(CLI::App& root, ExitCode* exit_code) {
  const auto a = std::make_shared<Experiment>();
  CLI::App* command = root.add_subcommand(
      "simulate", "Repeat the calibration experiment on simulated point clouds");
  command->group("Research");
  command->option_defaults()->always_capture_default();
  SimulationOptions& s = a->simulation;
  command->add_option("--points", s.points, "Number of points in the cloud")
      ->check(CLI::Range(5, 100000));
  command->add_option("--radius", s.radius, "Radius of the cloud in metres")
      ->check(CLI::Range(1e-3, 1e4));
  command->add_option("--shape", a->shape, "Points fill a ball, or lie on its surface (shell)")
      ->check(one_of({"ball", "shell"}));
  command
      ->add_option("--noise", a->noise,
                   "Standard deviations of the image noise in pixels, one experiment each")
      ->delimiter(',')
      ->check(CLI::Range(0.0, 100.0));
  command->add_option("--runs", a->runs, "Number of random rigs per noise level")
      ->check(CLI::Range(1, 1000000));
  command->add_option("--seed", a->seed, "Seed of the random numbers");
  command
      ->add_option("--generator", a->generator,
                   "Distance of the rig from the cloud: 20 to 25 m (ring), or the shortest with "
                   "all points in view (tight)")
      ->check(one_of({"ring", "tight"}));
  command
      ->add_option("--start-position", s.start_position,
                   "Largest error of the initial rig positions, metres per axis")
      ->check(CLI::Range(0.0, 1e3));
  command
      ->add_option("--start-rotation", s.start_rotation,
                   "Largest error of the initial rotation between cameras, rad per axis")
      ->check(CLI::Range(0.0, std::numbers::pi));
  command
      ->add_option("--start-translation", s.start_translation,
                   "Largest error of the initial translation between cameras, metres per axis")
      ->check(CLI::Range(0.0, 1e3));
  command->add_option("--length", a->length, "Baseline length: known exactly, or measured to 1 mm")
      ->check(one_of({"exact", "measured"}));
  command->add_option("--cameras", s.cameras, "Number of cameras, 2 to 4")->check(CLI::Range(2, 4));
  command->add_option("--json", a->json, "File to write with one JSON object per noise level");
  command->footer(
      "Example: vergence simulate --runs 20 --noise 0.1\nExit codes: 0 success; 2 bad arguments.");
  command->add_flag("--quiet", a->quiet, "Print no progress line");
  command->callback([a, exit_code] { *exit_code = run_experiment(*a); });
}

}  // namespace vergence::app
