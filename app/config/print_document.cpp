// Prints the tables of docs/configuration.md; the target `docs` writes them there, behind
// configuration_opening.md.
#include <iostream>

#include "app/config/schema.hpp"

int main() {
  std::cout << vergence::app::configuration_tables() << std::flush;
  return std::cout ? 0 : 1;
}
