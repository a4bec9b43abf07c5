// What of `vergence calibrate` needs OpenCV. `vergence` starts it with its own words; nobody has to
// know its name.
#include "app/checkerboard/board_command.hpp"
#include "app/command_line/program.hpp"

int main(int argc, char** argv) {
  using namespace vergence::app;
  return static_cast<int>(run_program(
      argc, argv, [](CLI::App& root, const ProgramWords& /*words*/, ExitCode* exit_code) {
        add_board_calibration(root, exit_code);
      }));
}
