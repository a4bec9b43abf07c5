#include "app/commands/commands.hpp"

int main(int argc, char** argv) {
  return static_cast<int>(vergence::app::run_program(argc, argv, vergence::app::add_all_commands));
}
