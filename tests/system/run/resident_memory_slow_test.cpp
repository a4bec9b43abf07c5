// That the resident memory of a drive does not grow.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <thread>

#include "tests/support/temporary_folder.hpp"

namespace vergence {
namespace {

using test::TemporaryFolder;

constexpr std::int64_t kKiB = 1024;

/// VmRSS of a process in bytes; nothing: it has ended.
std::optional<std::int64_t> resident_bytes(pid_t process) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmRSS:")) return std::strtoll(line.c_str() + 6, nullptr, 10) * kKiB;
  return std::nullopt;
}

/// Frames that a session has written the poses of.
int frames_written(const std::filesystem::path& session) {
  std::ifstream file(session / "poses.csv");
  return static_cast<int>(std::count(std::istreambuf_iterator<char>(file), {}, '\n')) - 1;
}

/// `vergence run` of mock.yaml at walking pace with small images, for so many simulated seconds.
pid_t start_drive(const std::filesystem::path& session, int seconds) {
  const std::string file = std::string(VERGENCE_SOURCE_DIR) + "/app/config/mock.yaml",
                    out = session.string(), duration = std::to_string(seconds);
  const pid_t process = ::fork();
  if (process != 0) return process;
  ::execl(VERGENCE_PROGRAM, "vergence", "run", file.c_str(), "--fast", "--quiet", "--duration",
          duration.c_str(), "--out", out.c_str(), "--set", "mock.speed=1", "--set",
          "mock.texture_detail=0", "--set", "cameras.0.size=[320,240]", "--set",
          "cameras.1.size=[320,240]", nullptr);
  ::_exit(127);
}

/// Resident bytes after one simulated minute, and the last before the drive's end or `wall`.
struct Growth {
  std::optional<std::int64_t> after_a_minute{};
  std::int64_t at_the_end = 0;
  int frames = 0;
};

Growth drive(int seconds, std::chrono::seconds wall) {
  constexpr int kMinute = 60 * 20;  // frames
  constexpr std::chrono::milliseconds kLook{200};
  const TemporaryFolder folder;
  const pid_t process = start_drive(folder / "s", seconds);
  const auto until = std::chrono::steady_clock::now() + wall;
  Growth growth;
  while (::waitpid(process, nullptr, WNOHANG) == 0) {
    const int frames = frames_written(folder / "s");
    const auto now = resident_bytes(process);
    const bool over = std::chrono::steady_clock::now() > until;
    // Short of the end: the report that is written then takes memory of its own.
    const bool under_way = frames >= kMinute && frames < (seconds - 5) * 20;
    if (now && under_way) {
      if (!growth.after_a_minute) growth.after_a_minute = now;
      growth.at_the_end = *now;
      growth.frames = frames;
    }
    if (over) {
      (void)::kill(process, SIGKILL);
      (void)::waitpid(process, nullptr, 0);
      break;
    }
    std::this_thread::sleep_for(kLook);
  }
  return growth;
}

void expect_flat(const Growth& growth) {
  constexpr std::int64_t kMiB = 1024 * kKiB;
  constexpr int kTwoMinutes = 2 * 60 * 20;  // frames
  if (growth.frames < kTwoMinutes)
    GTEST_SKIP() << "this machine is too slow: " << growth.frames << " frames";
  EXPECT_LE(growth.at_the_end - *growth.after_a_minute, kMiB)
      << "after " << growth.frames << " frames";
  testing::Test::RecordProperty("frames", growth.frames);
  testing::Test::RecordProperty("growth_bytes",
                                static_cast<int>(growth.at_the_end - *growth.after_a_minute));
}

TEST(ResidentMemory, isFlatForAsManyMinutesAsFitTwoOfTheClock) {
  expect_flat(drive(900, std::chrono::seconds(120)));
}

}  // namespace
}  // namespace vergence
