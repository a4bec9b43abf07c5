// A first drive of which nothing is known but focal length and baseline, on recorded images.
#include "app/config/calibration_file.hpp"

#include <sys/resource.h>

#include <fmt/format.h>

#include "tests/support/refusal.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/system/replay/quick_start.hpp"
#include "tests/system/run/session.hpp"

namespace vergence::test {
namespace {

TEST_F(QuickStart, focalLengthAndBaselineCalibrateEuroc) {
  const auto folder = shared_data("data/euroc_mh01");
  if (!folder) GTEST_SKIP() << shared_data_missing("data/euroc_mh01");
  const Outcome o = replay(*folder, "--focal 460 --baseline 0.11");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_GT(summary()["frames"]["ok"], 50);
  EXPECT_LT(summary()["metrics"]["ate_m"], 0.006) << "4 mm with the data set's own calibration";
  const app::CalibrationFile found = app::read_calibration(session() / "calibration.yaml");
  EXPECT_NEAR(found.rig.intrinsics[0].distortion[0], -0.283, 0.02) << "without an initial value";
}

// A drive far longer than any excerpt: one of the mock's, to and fro by links to its files until
// there are ten thousand frames.

namespace fs = std::filesystem;

/// Place `i` of a drive of `count` frames that is driven to and fro.
int to_and_fro(int i, int count) {
  const int lap = 2 * (count - 1), at = i % lap;
  return at < count ? at : lap - at;
}

/// Frame k of `from` is frame i of `to` wherever the way there is; both at 10 Hz.
void write_to_and_fro(const fs::path& from, int frames, const fs::path& to) {
  const int count = static_cast<int>(
      std::distance(fs::directory_iterator(from / "left"), fs::directory_iterator{}));
  fs::create_directories(to);
  fs::copy(from / "calibration.yaml", to);
  std::ofstream times(to / "times.txt");
  for (int i = 0; i < frames; ++i) times << fmt::format("{:.1f}\n", 0.1 * i);
  for (const char* side : {"left", "right"}) {
    fs::create_directories(to / side);
    for (int i = 0; i < frames; ++i)
      fs::create_symlink(from / side / fmt::format("{:06d}.png", to_and_fro(i, count)),
                         to / side / fmt::format("{:06d}.png", i));
  }
}

/// Most memory that a child of this process ever held, MB; only grows.
double children_peak_mb() {
  rusage usage{};
  (void)::getrusage(RUSAGE_CHILDREN, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

TEST(LongReplay, memoryOfTenThousandFramesIsThatOfTheirLists) {
  const TemporaryFolder work;
  const std::string recorded = (work / "recorded").string(), once = (work / "once").string();
  ASSERT_LE(run_vergence("run '" VERGENCE_SOURCE_DIR "/app/config/mock.yaml' --fast --duration 25 "
                         "--record images --set trigger.rate=10 --out '" +
                         recorded + "'" + kSmall)
                .code,
            1);
  const Outcome exported =
      run_vergence("export '" + recorded + "' --format folder --out '" + once + "'");
  ASSERT_EQ(exported.code, 0) << exported.err;
  const fs::path drive = work / "long";
  constexpr int kFrames = 10'000;
  write_to_and_fro(once, kFrames, drive);

  const auto replay = [&](const char* name, int frames) {
    return run_vergence(fmt::format("replay '{}' --format folder --frames {} --out '{}'",
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
  EXPECT_EQ(summary["runtime_allocations"], 0);
  EXPECT_GE(summary["frames"]["posed"].get<int>(), kFrames * 99 / 100);
  // Lists of files, stamps and poses, the report's tables: some 2.5 kB a frame. An image is 77 kB.
  EXPECT_LT(after - before, 2.5e-3 * (kFrames - 1000) + 2);
  EXPECT_LT(fs::file_size(work / "whole/report.html"), 3'000'000U);
  EXPECT_TRUE(test::mentions(whole.err, " left")) << "the progress tells what is left of minutes\n";
}

}  // namespace
}  // namespace vergence::test
