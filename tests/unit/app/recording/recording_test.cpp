#include "app/recording/recording.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>

#include "app/runtime/errors.hpp"
#include "core/memory/allocation_guard.hpp"
#include "tests/support/mentions.hpp"
#include "tests/support/recording_reader.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

/// The system's disk with faults on demand.
/// Threads  The settings: any.
class FaultyDisk final : public Disk {
 public:
  /// Maximum size of a file in bytes; beyond it, writing fails with ENOSPC.
  std::atomic<std::uint64_t> room{~std::uint64_t{0}};
  /// errno of every following call; 0 for none.
  std::atomic<int> error{0};
  /// Delay of the next write in ms.
  std::atomic<int> stall_ms{0};
  /// errno of the next writeback; 0 for none.
  std::atomic<int> writeback_error{0};

  [[nodiscard]] int create(const char* path) noexcept override {
    return error != 0 ? -error : Disk::create(path);
  }
  [[nodiscard]] std::int64_t write(int fd, const iovec* pieces, int count,
                                   std::uint64_t offset) noexcept override {
    if (const int ms = stall_ms.exchange(0); ms > 0)
      std::this_thread::sleep_for(std::chrono::milliseconds(ms));
    if (error != 0) return -error;
    if (offset >= room) return -ENOSPC;
    iovec first = pieces[0];
    if (room == ~std::uint64_t{0}) return Disk::write(fd, pieces, count, offset);
    first.iov_len = std::min<std::size_t>(first.iov_len, room - offset);
    return Disk::write(fd, &first, 1, offset);
  }
  [[nodiscard]] int finish_writeback(int, std::uint64_t, std::uint64_t) noexcept override {
    return -writeback_error.exchange(0);
  }
  [[nodiscard]] int synchronise(int fd) noexcept override {
    return error != 0 ? -error : Disk::synchronise(fd);
  }
};

using namespace std::chrono_literals;
using test::read_mcap;
using test::TemporaryFolder;

constexpr std::size_t kText = 0, kImage = 1;

Recording::Options options() {
  return {.topics = {{"/text", RosType::text, false}, {"/left/image_raw", RosType::image, false}},
          .queues = {4U << 20U},
          .when_full = WhenFull::wait};
}

std::string text_of(int n) { return "message " + std::to_string(n); }

bool post(Recording* recording, int n, std::size_t padding = 0) {
  const std::string text = text_of(n) + std::string(padding, '.');
  const auto room = recording->begin(0, kText, Stamp(std::int64_t{n} * 1'000'000), 64 + padding);
  if (room.empty()) return false;
  CdrWriter out(room);
  write_text(&out, text);
  recording->commit(0, out.ok() ? out.size() : 0);
  return true;
}

/// Numbers of the text messages of a file, in its order.
std::vector<int> numbers(const std::filesystem::path& file) {
  std::vector<int> out;
  for (const auto& m : read_mcap(file).messages)
    if (m.type == "std_msgs/String") out.push_back(std::stoi(m.content.substr(16)));
  return out;
}

std::vector<int> sequence(int first, int end) {
  std::vector<int> out;
  for (int i = first; i < end; ++i) out.push_back(i);
  return out;
}

TEST(Recording, splitsBySizeWithRosbagNames) {
  const TemporaryFolder folder;
  Recording::Options o = options();
  o.queues = {64U << 10U};
  o.preamble = {{kText, {0, 1, 0, 0, 2, 0, 0, 0, 'p', 0}}};
  o.roll_bytes = 300'000;
  Recording recording(folder.path(), o);
  for (int i = 0; i < 3000; ++i) ASSERT_TRUE(post(&recording, i, 500));
  recording.close();
  EXPECT_FALSE(std::filesystem::exists(folder / "drive.mcap"));
  std::vector<int> all;
  const auto files = recording.counters().files;
  EXPECT_GE(files, 4U);
  for (std::uint64_t f = 0; f < files; ++f) {
    const auto file = read_mcap(folder / ("drive_" + std::to_string(f) + ".mcap"));
    EXPECT_TRUE(file.scan.finished);
    ASSERT_FALSE(file.messages.empty());
    EXPECT_EQ(file.messages[0].content.substr(8, 1), "p");
    for (std::size_t m = 1; m < file.messages.size(); ++m)
      all.push_back(std::stoi(file.messages[m].content.substr(16)));
  }
  EXPECT_EQ(all, sequence(0, 3000));
}

/// For a recording on a disk with faults.
class FaultyRecording : public ::testing::Test {
 protected:
  FaultyRecording() { o.disk = &disk; }

  const TemporaryFolder folder;
  FaultyDisk disk;
  Recording::Options o = options();
};

TEST_F(FaultyRecording, imagesNeverPushOutSmallMessages) {
  o.when_full = WhenFull::drop;
  Recording recording(folder.path(), o);
  // The first chunk stalls.
  disk.stall_ms = 1000;
  ASSERT_TRUE(post(&recording, 0));
  std::this_thread::sleep_for(150ms);
  int images = 0;
  while (!recording.begin(0, kImage, Stamp(1), 300'000, true).empty()) {
    recording.commit(0, 300'000);
    ++images;
  }
  EXPECT_GE(images, 8);
  const auto begun = std::chrono::steady_clock::now();
  for (int i = 1; i < 1000; ++i) ASSERT_TRUE(post(&recording, i));
  EXPECT_LT(std::chrono::steady_clock::now() - begun, 400ms) << "nobody waits for the disk";
  recording.close();
  EXPECT_EQ(recording.counters().dropped, 1U);
  EXPECT_EQ(recording.counters().dropped_images, 1U);
  EXPECT_EQ(numbers(folder / "drive.mcap"), sequence(0, 1000));
}

void await_chunks(const Recording& recording, std::uint64_t chunks) {
  while (recording.counters().chunks < chunks) std::this_thread::sleep_for(1ms);
}

TEST_F(FaultyRecording, retriesFailedWritesInSameFile) {
  Recording recording(folder.path(), o);
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(post(&recording, i));
  await_chunks(recording, 1);
  disk.error = EIO;
  for (int i = 100; i < 200; ++i) ASSERT_TRUE(post(&recording, i));
  std::this_thread::sleep_for(200ms);
  disk.error = 0;
  const auto chunks = recording.counters().chunks;
  // The recording retries within Recording::kRetry.
  await_chunks(recording, chunks + 1);
  recording.close();
  const auto errors = recording.pop_errors();
  ASSERT_EQ(errors.size(), 2U);
  EXPECT_NE(errors[0].find("Input/output error"), std::string::npos) << errors[0];
  EXPECT_EQ(numbers(folder / "drive.mcap"), sequence(0, 200));
  EXPECT_TRUE(read_mcap(folder / "drive.mcap").scan.finished);
}

TEST_F(FaultyRecording, fullDiskDropsAndCountsOldest) {
  o.queues = {64U << 10U};
  Recording recording(folder.path(), o);
  disk.room = 0;
  for (int i = 0; i < 2000; ++i) ASSERT_TRUE(post(&recording, i, 100));
  recording.close();
  const RecordingCounters c = recording.counters();
  EXPECT_EQ(c.lost, 2000U);
  EXPECT_EQ(c.messages, 0U);
  const auto errors = recording.pop_errors();
  ASSERT_EQ(errors.size(), 2U);
  EXPECT_NE(errors[1].find("no summary"), std::string::npos) << errors[1];
  EXPECT_TRUE(numbers(folder / "drive.mcap").empty());
}

// The system tells of it once, and the file's end finds nothing wrong.
TEST_F(FaultyRecording, countsDataLostByDisk) {
  Recording recording(folder.path(), o);
  ASSERT_TRUE(post(&recording, 0));
  await_chunks(recording, 1);
  ASSERT_TRUE(post(&recording, 1));
  await_chunks(recording, 2);
  EXPECT_EQ(recording.counters().lost, 0U);
  disk.writeback_error = EIO;
  ASSERT_TRUE(post(&recording, 2));
  recording.close();
  EXPECT_EQ(recording.counters().lost, 1U) << "of the chunk before";
  EXPECT_EQ(recording.counters().files, 1U);
  const auto errors = recording.pop_errors();
  ASSERT_EQ(errors.size(), 1U);
  EXPECT_TRUE(
      test::mentions(errors[0], "lost data that it had accepted (Input/output error): 1 messages"));
  EXPECT_TRUE(read_mcap(folder / "drive.mcap").scan.finished);
}

TEST(Recording, refusesUnwritableDiskAtStart) {
  const TemporaryFolder folder;
  for (const int error : {ENOSPC, EROFS, EIO, ENOENT, EACCES}) {
    FaultyDisk disk;
    disk.error = error;
    Recording::Options o = options();
    o.disk = &disk;
    EXPECT_THROW(Recording(folder.path(), o), InputError) << error;
  }
}

TEST_F(FaultyRecording, postingAndWritingDoNotAllocate) {
  o.queues = {64U << 10U};
  o.roll_bytes = 100'000;
  Recording recording(folder.path(), o);
  const auto before = AllocationGuard::runtime_allocations();
  {
    const SealedScope sealed;
    for (int i = 0; i < 2000; ++i) {
      const auto room = recording.begin(0, kText, Stamp(i), 64);
      CdrWriter out(room);
      write_text(&out, "message");
      recording.commit(0, out.size());
      if (i == 1000) disk.room = 0;
      if (i == 1200) disk.room = ~std::uint64_t{0};
    }
  }
  recording.close();
  EXPECT_EQ(AllocationGuard::runtime_allocations() - before, 0U);
}

}  // namespace
}  // namespace vergence::app
