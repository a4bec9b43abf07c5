// Entry point of libFuzzer.
#include "tests/fuzz/xbus/probe.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                      std::size_t size) {  // NOLINT(readability-identifier-naming)
  vergence::xbus::probe({data, size});
  return 0;
}
