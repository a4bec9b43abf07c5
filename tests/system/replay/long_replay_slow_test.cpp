// A drive far longer than any excerpt: one of the mock's, to and fro by links to its files until
// there are ten thousand frames.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tests/support/kitti_raw_writer.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/system/run/session.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence::test {
namespace {

namespace fs = std::filesystem;

/// Place `i` of a drive of `count` frames that is driven to and fro.
int to_and_fro(int i, int count) {
  const int lap = 2 * (count - 1), at = i % lap;
  return at < count ? at : lap - at;
}

std::string stamp_line(std::int64_t ns) {
  return fmt::format("{:%Y-%m-%d %H:%M:%S}.{:09d}\n",
                     fmt::gmtime(static_cast<std::time_t>(ns / 1'000'000'000)), ns % 1'000'000'000);
}

int files_in(const fs::path& folder) {
  return static_cast<int>(std::distance(fs::directory_iterator(folder), fs::directory_iterator{}));
}

/// Frame k of `from` is frame i of `to` wherever the way there is; both at 10 Hz.
void write_to_and_fro(const fs::path& from, int frames, const fs::path& to) {
  const int count = std::min(files_in(from / "image_00/data"), files_in(from / "oxts/data"));
  constexpr std::int64_t kStart = 1'577'836'800'000'000'000, kStep = 100'000'000;  // ns
  for (const std::string below : {"image_00", "image_01", "oxts"}) {
    fs::create_directories(to / below / "data");
    std::ofstream times(to / below / "timestamps.txt");
    const std::string end = below == "oxts" ? ".txt" : ".png";
    for (int i = 0; i < frames; ++i) {
      fs::create_symlink(
          from / below / "data" / fmt::format("{:010d}{}", to_and_fro(i, count), end),
          to / below / "data" / fmt::format("{:010d}{}", i, end));
      times << stamp_line(kStart + i * kStep);
    }
  }
}

/// Most memory that a child of this process ever held, MB; only grows.
double children_peak_mb() {
  rusage usage{};
  (void)::getrusage(RUSAGE_CHILDREN, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

TEST(LongReplay, tenThousandFramesTakeNoMoreMemoryThanTheirListsAndGiveOnePage) {
  const TemporaryFolder work;
  const app::Configuration c = app::load_configuration(
      std::string(VERGENCE_SOURCE_DIR) + "/app/config/mock.yaml",
      {"cameras.0.size=[320, 240]", "cameras.1.size=[320, 240]", "mock.texture_detail=0",
       "mock.ins=ideal", "trigger.rate=10", "ins.rate=10"});
  const fs::path once = write_kitti_raw(c, 25, {}, work / "once");
  const fs::path drive = work / "long" / once.parent_path().filename() / once.filename();
  constexpr int kFrames = 10'000;
  write_to_and_fro(once, kFrames, drive);
  for (const auto& file : fs::directory_iterator(once.parent_path()))
    if (file.is_regular_file()) fs::copy(file.path(), drive.parent_path());

  const auto replay = [&](const char* name, int frames) {
    return run_vergence(fmt::format("replay '{}' --format kitti-raw --frames {} --out '{}'",
                                    drive.string(), frames, (work / name).string()));
  };
  const Outcome brief = replay("brief", 1000);
  ASSERT_EQ(brief.code, 0) << brief.err;
  const double before = children_peak_mb();
  const Outcome whole = replay("whole", kFrames);
  ASSERT_EQ(whole.code, 0) << whole.err;
  const double after = children_peak_mb();

  const auto summary = summary_of(work / "whole");
  EXPECT_EQ(summary["frames"]["posed"].get<int>() + summary["frames"]["lost"].get<int>(), kFrames);
  EXPECT_EQ(summary["allocations_after_seal"], 0);
  const auto page = static_cast<double>(fs::file_size(work / "whole/report.html"));
  std::printf(
      "posed %d of %d, %d ok; way %.0f m, %.2f %% off at the end; %.1f ms a frame; peak memory "
      "%.1f MB after 1000 frames, %.1f after %d; "
      "page %.2f MB\n",
      summary["frames"]["posed"].get<int>(), kFrames, summary["frames"]["ok"].get<int>(),
      summary["earth"]["way_m"].get<double>(),
      summary["earth"]["errors"]["horizontal_end_percent"].get<double>(),
      summary["timing_ms"]["mean"].get<double>(), before, after, kFrames, page * 1e-6);
  EXPECT_GE(summary["frames"]["posed"].get<int>(), kFrames * 99 / 100);
  // Lists of files, stamps and poses, the report's tables: some 2.5 kB a frame. An image is 77 kB.
  EXPECT_LT(after - before, 2.5e-3 * (kFrames - 1000) + 2);
  EXPECT_LT(page, 3e6);
  EXPECT_NE(whole.err.find(" left"), std::string::npos)
      << "the progress tells what is left of minutes\n"
      << whole.err;
}

}  // namespace
}  // namespace vergence::test
