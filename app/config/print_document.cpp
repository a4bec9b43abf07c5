// Prints docs/configuration.md; the target `docs` writes it there.
#include <iostream>

#include "app/config/schema.hpp"

int main() {
  std::cout << vergence::app::configuration_document() << std::flush;
  return std::cout ? 0 : 1;
}
