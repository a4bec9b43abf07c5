// Runs an entry point of libFuzzer without libFuzzer: NAME_mutations SECONDS CORPUS. Inputs of the
// corpus as they are, then mutated, in an order that is always the same; what crashes is left in
// CORPUS/../NAME-last. Blind to coverage, but it needs no second compiler: scripts/fuzz searches.
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "core/math/random.hpp"
#include "tests/support/mutated.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using Bytes = std::vector<std::uint8_t>;
using Clock = std::chrono::steady_clock;

std::vector<Bytes> read_corpus(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<Bytes> inputs;
  for (const auto& file : files) {
    std::ifstream in(file, std::ios::binary);
    inputs.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  }
  return inputs;
}

/// Where the input at hand lies, should the next one not come.
void keep(const std::filesystem::path& file, const Bytes& input) {
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  out.write(reinterpret_cast<const char*>(input.data()),
            static_cast<std::streamsize>(input.size()));
}

/// Some of one and the rest of another.
Bytes crossed(const Bytes& a, const Bytes& b, vergence::Random* random) {
  const auto part = [random](const Bytes& v) {
    return static_cast<std::ptrdiff_t>(random->below(static_cast<std::uint32_t>(v.size() + 1)));
  };
  Bytes out(a.begin(), a.begin() + part(a));
  out.insert(out.end(), b.begin() + part(b), b.end());
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  constexpr double kLongest = 2;  // s, of an input
  if (argc != 3) {
    std::fprintf(stderr, "%s SECONDS CORPUS\n", argv[0]);
    return 2;
  }
  const std::vector<Bytes> corpus = read_corpus(argv[2]);
  if (corpus.empty()) {
    std::fprintf(stderr, "%s: %s holds no inputs\n", argv[0], argv[2]);
    return 2;
  }
  const std::filesystem::path last = std::string(argv[2]) + "-last";
  for (const Bytes& input : corpus) {
    keep(last, input);
    (void)LLVMFuzzerTestOneInput(input.data(), input.size());
  }
  const auto until = Clock::now() + std::chrono::duration<double>(std::strtod(argv[1], nullptr));
  vergence::Random random(1, 24);
  const auto any = [&] { return corpus[random.below(static_cast<std::uint32_t>(corpus.size()))]; };
  std::uint64_t inputs = corpus.size();
  for (auto begun = Clock::now(); begun < until; ++inputs) {
    const Bytes input = vergence::test::mutated(
        random.below(8) == 0 ? crossed(any(), any(), &random) : any(), &random);
    keep(last, input);
    (void)LLVMFuzzerTestOneInput(input.data(), input.size());
    const auto now = Clock::now();
    if (std::chrono::duration<double>(now - begun).count() > kLongest) {
      std::fprintf(stderr, "%s: takes longer than %.0f s\n", last.c_str(), kLongest);
      return 1;
    }
    begun = now;
  }
  std::filesystem::remove(last);
  std::printf("%llu inputs: no finding\n", static_cast<unsigned long long>(inputs));
  return 0;
}
