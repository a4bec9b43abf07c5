// Entry point of libFuzzer.
#include "tests/fuzz/gnss/probe.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                      std::size_t size) {  // NOLINT(readability-identifier-naming)
  vergence::test::probe_gnss({data, size});
  return 0;
}
