#include <malloc.h>

#include "app/commands/commands.hpp"

int main(int argc, char** argv) {
  // One heap for all threads: they take memory at the start only, so none waits for another, and a
  // heap of their own for each would be 2 MiB more resident in a drive.
  (void)mallopt(M_ARENA_MAX, 1);
  return static_cast<int>(vergence::app::run_program(argc, argv, vergence::app::add_all_commands));
}
