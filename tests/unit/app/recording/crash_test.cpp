#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <thread>

#include <gtest/gtest.h>

#include "app/recording/recording.hpp"
#include "tests/support/quantile.hpp"
#include "tests/support/recording_reader.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

/// When each message was posted: shared with the process that is killed.
struct PostTimes {
  static constexpr std::uint32_t kMax = 1U << 16U;
  std::atomic<std::uint32_t> posted{0};
  /// Times of the steady clock.
  std::array<std::int64_t, kMax> at_ns{};
};

std::int64_t steady_ns() {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

struct Killed {
  /// Number of messages posted.
  std::uint32_t posted = 0;
  /// Time just before the signal.
  std::int64_t killed_ns = 0;
  /// Time of each message.
  std::vector<std::int64_t> at;
};

/// A process of its own records a text of 100 bytes every millisecond and an image every 33, and is
/// killed after so long.
Killed record_and_kill(const std::filesystem::path& folder, std::chrono::microseconds after) {
  void* shared =
      ::mmap(nullptr, sizeof(PostTimes), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (shared == MAP_FAILED) return {};
  auto* times = new (shared) PostTimes;
  const pid_t child = ::fork();
  if (child == 0) {
    Recording::Options o;
    o.topics = {{"/text", RosType::text, false}, {"/image", RosType::image, false}};
    o.queues = {8U << 20U};
    Recording recording(folder, o);
    for (std::uint32_t n = 0; n < PostTimes::kMax; ++n) {
      const Stamp stamp(std::int64_t{n} * 1'000'000);
      if (n % 33 == 0 && !recording.begin(0, 1, stamp, 100'000, true).empty())
        recording.commit(0, 100'000);
      const auto room = recording.begin(0, 0, stamp, 128);
      if (room.empty()) ::_exit(2);
      CdrWriter out(room);
      write_text(&out, std::to_string(n) + std::string(100, '.'));
      recording.commit(0, out.size());
      times->at_ns[n] = steady_ns();
      times->posted.store(n + 1, std::memory_order_release);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    ::_exit(1);
  }
  while (times->posted.load(std::memory_order_acquire) == 0)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  std::this_thread::sleep_for(after);
  Killed killed;
  killed.killed_ns = steady_ns();
  killed.posted = times->posted.load(std::memory_order_acquire);
  ::kill(child, SIGKILL);
  (void)::waitpid(child, nullptr, 0);
  killed.at.assign(times->at_ns.begin(), times->at_ns.begin() + killed.posted);
  ::munmap(shared, sizeof(PostTimes));
  return killed;
}

/// Kills a recording `kills` times; every message up to the last one that is there reads back.
/// → ms before each kill from which on messages are lost
std::vector<double> lost_before_kills(int kills) {
  std::vector<double> lost_ms;
  for (int i = 0; i < kills; ++i) {
    const test::TemporaryFolder folder;
    // 7919 is prime: moments all over the rhythm of the chunks
    const Killed killed =
        record_and_kill(folder.path(), std::chrono::microseconds(50'000 + 7919 * i % 400'000));
    const test::ReadFile file = test::read_mcap(folder / "drive.mcap");
    EXPECT_EQ(file.scan.skipped + file.scan.orphans, 0U);
    std::size_t texts = 0, images = 0;
    for (const test::ReadMessage& m : file.messages) {
      if (m.topic == "/image") {
        ++images;
        continue;
      }
      EXPECT_EQ(std::stoul(m.content.substr(8)), texts);
      EXPECT_EQ(m.content.size(), 8 + std::to_string(texts).size() + 101);
      ++texts;
    }
    EXPECT_EQ(images, (texts + 32) / 33);
    lost_ms.push_back(texts >= killed.at.size()
                          ? 0.0
                          : static_cast<double>(killed.killed_ns - killed.at[texts]) * 1e-6);
  }
  return lost_ms;
}

// At most 100 ms are lost where the writer gets the processor when it asks; a machine that runs
// other tests beside it may let it wait, which the median does not see.
TEST(CrashedRecording, readsBackUpToLast100msAfterKill) {
  const auto lost_ms = lost_before_kills(5);
  EXPECT_LE(test::quantile(lost_ms, 0.5), 100);
  EXPECT_LE(test::quantile(lost_ms, 1), 1000);
}

}  // namespace
}  // namespace vergence::app
