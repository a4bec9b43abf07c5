#include "app/recorder/line_file.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cerrno>
#include <csignal>

#include "app/runtime/errors.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

/// Files of this process can grow to `bytes` and no further: a disk that is full, without needing
/// one.
class SmallDisk {
 public:
  explicit SmallDisk(rlim_t bytes) : former_handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &former_);
    const rlimit small{bytes, former_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
  }
  ~SmallDisk() {
    make_room();
    std::signal(SIGXFSZ, former_handler_);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  void make_room() { setrlimit(RLIMIT_FSIZE, &former_); }

 private:
  rlimit former_{};
  void (*former_handler_)(int);
};

TEST(LineFile, moreThanMayWaitIsHandedOverWhileTheDiskTakesIt) {
  const test::TemporaryFolder folder;
  LineFile file(folder / "a.txt", 16);
  std::string all;
  for (int i = 10; i < 50; ++i) {
    const std::string line = "line " + std::to_string(i) + '\n';
    EXPECT_TRUE(file.append(line)) << i;
    all += line;
  }
  EXPECT_TRUE(file.close());
  EXPECT_EQ(file.lost_lines(), 0U);
  EXPECT_EQ(test::read_file(folder / "a.txt"), all);
}

TEST(LineFile, goesOnWhereItStoppedWhenRoomComesBack) {
  const test::TemporaryFolder folder;
  SmallDisk disk(10);
  LineFile file(folder / "a.txt");
  EXPECT_TRUE(file.append("0123456\n"));
  EXPECT_TRUE(file.flush());
  EXPECT_TRUE(file.append("89abcdef\n"));
  EXPECT_FALSE(file.flush());
  EXPECT_EQ(file.fault(), EFBIG);
  disk.make_room();
  EXPECT_TRUE(file.flush());
  EXPECT_EQ(file.fault(), 0);
  EXPECT_TRUE(file.close());
  EXPECT_EQ(test::read_file(folder / "a.txt"), "0123456\n89abcdef\n");
}

TEST(LineFile, whatWaitsIsBoundedAndWhatIsLostIsWholeLinesThatAreCounted) {
  const test::TemporaryFolder folder;
  const std::string line = std::string(999, 'x') + "\n";
  std::uint64_t refused = 0;
  std::uint64_t taken = 0;
  {
    SmallDisk disk(0);
    LineFile file(folder / "a.txt");
    for (int i = 0; i < 2000; ++i) {
      ++(file.append(line) ? taken : refused);
      EXPECT_FALSE(file.flush());
    }
    EXPECT_EQ(taken, LineFile::kPending / line.size());
    EXPECT_EQ(file.lost_lines(), refused);
    disk.make_room();
    EXPECT_TRUE(file.close());
  }
  EXPECT_EQ(test::read_file(folder / "a.txt").size(), taken * line.size());
}

}  // namespace
}  // namespace vergence::app
