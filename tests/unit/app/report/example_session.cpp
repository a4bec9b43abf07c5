#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "tests/support/session_writer.hpp"

/// example_session FOLDER FRAMES [no-ins] [no-faults]
int main(int argc, char** argv) {
  if (argc < 3) {
    std::fputs("usage: example_session FOLDER FRAMES [no-ins] [no-faults]\n", stderr);
    return 2;
  }
  vergence::test::SessionWriter writer;
  writer.frames = std::strtoul(argv[2], nullptr, 10);
  for (int i = 3; i < argc; ++i) {
    if (std::string_view(argv[i]) == "no-ins") writer.ins = false;
    if (std::string_view(argv[i]) == "no-faults") writer.faults = false;
  }
  writer.write(argv[1]);
  return 0;
}
