#include <benchmark/benchmark.h>

#include <filesystem>

#include "app/report/report.hpp"
#include "tests/support/session_writer.hpp"
#include "tests/support/temporary_folder.hpp"

/// report.html of a session of so many frames, from reading its files to the page on the disk. The
/// limit for 33 000 frames is 3 s and 3 MB.
namespace vergence {
namespace {

void report_of_a_session(benchmark::State& state, bool torn) {
  const test::TemporaryFolder folder;
  test::SessionWriter writer;
  writer.frames = static_cast<std::size_t>(state.range(0));
  writer.write(folder.path());
  if (torn) std::filesystem::remove(folder / "summary.json");
  for (auto _ : state) benchmark::DoNotOptimize(app::write_report(folder.path()));
  state.counters["page_MB"] =
      static_cast<double>(std::filesystem::file_size(folder / "report.html")) * 1e-6;
}

void whole(benchmark::State& state) { report_of_a_session(state, false); }
void torn(benchmark::State& state) { report_of_a_session(state, true); }

BENCHMARK(whole)->Arg(1000)->Arg(33'000)->Unit(benchmark::kMillisecond);
BENCHMARK(torn)->Arg(33'000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace vergence
