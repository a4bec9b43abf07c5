#include "app/commands/commands.hpp"

#include <array>
#include <string>

namespace vergence::app {
namespace {

struct Announced {
  const char* word;
  const char* purpose;
};

constexpr std::array kAnnounced{
    Announced{"calibrate", "Find intrinsics and the stereo transform with a checkerboard"},
};

}  // namespace

void add_announced(CLI::App& root, ExitCode* exit_code) {
  for (const Announced& a : kAnnounced) {
    CLI::App* command = root.add_subcommand(a.word, std::string(a.purpose) + " (not there yet)");
    command->allow_extras();
    command->callback([a, exit_code] {
      *exit_code = ExitCode::bad_input;
      throw InputError(std::string("'") + a.word + "' is not there yet in this version; 'vergence --help' lists the commands that are");
    });
  }
}

}  // namespace vergence::app
