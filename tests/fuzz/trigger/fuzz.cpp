// Entry point of libFuzzer.
#include "tests/fuzz/trigger/probe.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                      std::size_t size) {  // NOLINT(readability-identifier-naming)
  vergence::probe_trigger(data, size);
  return 0;
}
