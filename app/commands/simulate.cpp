#include <memory>

#include "app/commands/commands.hpp"
#include "app/simulation/experiment.hpp"

namespace vergence::app {

void add_simulate(CLI::App& root, ExitCode* exit_code) {
  const auto a = std::make_shared<Experiment>();
  CLI::App* command = root.add_subcommand(
      "simulate", "Repeat the calibration experiment on simulated point clouds");
  command->group("Research");
  SimulationOptions& s = a->simulation;
  command->add_option("--points", s.points, "Points of the cloud")->capture_default_str();
  command->add_option("--radius", s.radius, "Radius of the cloud, m")->capture_default_str();
  command->add_option("--shape", a->shape, "Points fill a ball or lie on its shell")
      ->check(CLI::IsMember({"ball", "shell"}))
      ->capture_default_str();
  command->add_option("--noise", a->noise, "Noise levels, px of each coordinate")
      ->capture_default_str();
  command->add_option("--runs", a->runs, "Random problems a level")->capture_default_str();
  command->add_option("--seed", a->seed, "Of the random problems")->capture_default_str();
  command
      ->add_option("--generator", a->generator,
                   "ring: rigs 20 to 25 m away; tight: as near as all points stay in view, points "
                   "triangulated")
      ->check(CLI::IsMember({"ring", "tight"}))
      ->capture_default_str();
  command
      ->add_option("--start-position", s.start_position,
                   "Start of the rigs' positions off by up to ±, m an axis")
      ->capture_default_str();
  command
      ->add_option("--start-rotation", s.start_rotation,
                   "Start of the stereo rotation off by up to ±, rad an axis")
      ->capture_default_str();
  command
      ->add_option("--start-translation", s.start_translation,
                   "Start of the stereo translation off by up to ±, m an axis")
      ->capture_default_str();
  command
      ->add_option("--length", a->length,
                   "The baseline's length is known exactly, or measured to 1 mm")
      ->check(CLI::IsMember({"exact", "measured"}))
      ->capture_default_str();
  command->add_option("--cameras", s.cameras, "Cameras of the rig, 2 to 4")->capture_default_str();
  command->add_option("--json", a->json, "Write one object a noise level to this file");
  command->add_flag("--quiet", a->quiet, "No progress line");
  command->callback([a, exit_code] { *exit_code = run_experiment(*a); });
}

}  // namespace vergence::app
