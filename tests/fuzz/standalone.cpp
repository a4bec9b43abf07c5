// Runs an entry point of libFuzzer without libFuzzer: NAME_mutations SECONDS CORPUS. Inputs of the
// corpus as they are, then mutated, in an order that is always the same; what crashes is left in
// CORPUS-last. Blind to coverage, but it needs no second compiler: scripts/fuzz searches.
#include <fcntl.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "tests/support/mutated.hpp"
#include "tests/support/temporary_folder.hpp"

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
    const std::string bytes = vergence::test::read_file(file);
    inputs.emplace_back(bytes.begin(), bytes.end());
  }
  return inputs;
}

// Input of the entry point, for the signal handler.
const Bytes* at_hand = nullptr;
// File in which the last input is stored.
std::string last;

/// Only what a handler may call.
extern "C" void leave_input(int number) {
  const int fd = ::open(last.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd >= 0 && at_hand != nullptr) (void)!::write(fd, at_hand->data(), at_hand->size());
  std::signal(number, SIG_DFL);
  std::raise(number);
}

void probe(const Bytes& input) {
  at_hand = &input;
  (void)LLVMFuzzerTestOneInput(input.data(), input.size());
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
  // Maximum processor time per input in s; the machine may be busy.
  constexpr double kLongest = 2;
  if (argc != 3) {
    std::fprintf(stderr, "%s SECONDS CORPUS\n", argv[0]);
    return 2;
  }
  const std::vector<Bytes> corpus = read_corpus(argv[2]);
  if (corpus.empty()) {
    std::fprintf(stderr, "%s: %s holds no inputs\n", argv[0], argv[2]);
    return 2;
  }
  last = std::string(argv[2]) + "-last";
  for (const int number : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTERM})
    std::signal(number, leave_input);
  for (const Bytes& input : corpus) probe(input);
  const auto until = Clock::now() + std::chrono::duration<double>(std::strtod(argv[1], nullptr));
  vergence::Random random(1, 24);
  const auto any = [&] { return corpus[random.below(static_cast<std::uint32_t>(corpus.size()))]; };
  std::uint64_t inputs = corpus.size();
  for (std::clock_t begun = std::clock(); Clock::now() < until; ++inputs) {
    const Bytes input = vergence::test::mutated(
        random.below(8) == 0 ? crossed(any(), any(), &random) : any(), &random);
    probe(input);
    const std::clock_t now = std::clock();
    if (static_cast<double>(now - begun) > kLongest * CLOCKS_PER_SEC) {
      std::fprintf(stderr, "an input takes longer than %.0f s\n", kLongest);
      std::abort();
    }
    begun = now;
  }
  std::printf("%llu inputs: no finding\n", static_cast<unsigned long long>(inputs));
  return 0;
}
