// render_film FOLDER: the drive that tests play into emulated cameras. Does nothing if it is there.
#include <cstdio>
#include <exception>

#include "tests/rigs/film.hpp"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("render_film: name one folder\n", stderr);
    return 2;
  }
  try {
    vergence::test::render_film(argv[1]);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "render_film: %s\n", e.what());
    return 1;
  }
  return 0;
}
