// Entry of libFuzzer (clang): cmake --build … --target xbus_fuzz; build/fuzz/xbus_fuzz CORPUS
#include "tests/fuzz/xbus/probe.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                      std::size_t size) {  // NOLINT(readability-identifier-naming)
  vergence::xbus::probe({data, size});
  return 0;
}
