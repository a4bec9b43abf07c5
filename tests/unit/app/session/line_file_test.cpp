#include "app/session/records.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

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

}  // namespace
}  // namespace vergence::app
