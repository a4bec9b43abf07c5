// Seeded random inputs for the same probe, without a fuzzer's library:  trigger_random [INPUTS]
// [SEED]
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "core/math/random.hpp"
#include "firmware_iface/trigger/trigger.h"
#include "tests/fuzz/trigger/probe.hpp"

int main(int argc, char** argv) {
  const unsigned long long inputs = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 1'000'000;
  vergence::Random random(argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1);
  std::vector<std::uint8_t> bytes;
  for (unsigned long long n = 0; n < inputs; ++n) {
    bytes.resize(random.below(300));
    for (std::uint8_t& b : bytes)
      b = random.below(4) == 0 ? static_cast<std::uint8_t>(random.below(8))
                               : static_cast<std::uint8_t>(random.next() >> 24U);
    if (random.below(4) == 0) {  // a whole frame somewhere, perhaps with one bit wrong
      std::uint8_t frame[trigger_max_frame];
      const std::size_t size =
          trigger_write_frame(static_cast<std::uint8_t>(random.below(8)), 1, bytes.data(),
                              std::min<std::size_t>(bytes.size(), random.below(65)), frame);
      if (random.below(2) == 0)
        frame[random.below(static_cast<std::uint32_t>(size))] ^=
            static_cast<std::uint8_t>(1U << random.below(8));
      bytes.insert(bytes.begin(), frame, frame + size);
    }
    vergence::probe_trigger(bytes.data(), bytes.size());
  }
  std::printf("%llu inputs, nothing found\n", inputs);
}
