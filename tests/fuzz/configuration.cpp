/// Any bytes as a configuration. Entry point of libFuzzer.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "app/config/configuration.hpp"
#include "tests/fuzz/input_errors.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace vergence::app;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  vergence::test::probe([&] {
    const Configuration c = parse_configuration(text, "fuzz.yaml", {});
    // Every command relies on these minimums.
    if (c.threads < 1 || c.cameras.size() < 2) std::abort();
    if (configuration_hash(c).size() != 16) std::abort();
  });
  return 0;
}
