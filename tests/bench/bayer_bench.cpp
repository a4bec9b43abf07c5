// Raw Bayer to grey, bytes of image a second: one 1024 x 768 image over and over, in and out of the
// second-level cache.
#include <benchmark/benchmark.h>

#include <vector>

#include "core/math/random.hpp"
#include "core/types/bayer.hpp"

namespace {

void bayer_to_grey(benchmark::State& state) {
  const int width = 1024, height = 768;
  vergence::Random random(1);
  std::vector<std::uint8_t> raw(static_cast<std::size_t>(width) * height), out(raw.size());
  for (auto& v : raw) v = static_cast<std::uint8_t>(random.below(256));
  for (auto _ : state) {
    vergence::bayer_to_grey(raw.data(), width, width, height, out.data(), width);
    benchmark::DoNotOptimize(out.data());
    benchmark::ClobberMemory();
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) * width * height);
}
BENCHMARK(bayer_to_grey);

}  // namespace
