#include "app/runtime/durable_file.hpp"

#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

std::string refusal(const std::filesystem::path& file) {
  return test::refusal_of([&] { replace_durably(file, "new"); });
}

std::ptrdiff_t files_in(const std::filesystem::path& folder) {
  return std::distance(std::filesystem::directory_iterator(folder),
                       std::filesystem::directory_iterator{});
}

TEST(DurableFile, replacesWithoutTemporaryFiles) {
  const test::TemporaryFolder folder;
  const std::string large(300'000, 'x');
  replace_durably(folder / "a.yaml", "old");
  EXPECT_EQ(test::read_file(folder / "a.yaml"), "old");
  replace_durably(folder / "a.yaml", large);
  EXPECT_EQ(test::read_file(folder / "a.yaml"), large);
  EXPECT_EQ(files_in(folder.path()), 1);
}

TEST(DurableFile, failureNamesFileAndKeepsOldOne) {
  const test::TemporaryFolder folder;
  replace_durably(folder / "a.yaml", "old");
  // A folder cannot be opened as a file.
  std::filesystem::create_directory(folder / "a.yaml.new");
  EXPECT_NE(refusal(folder / "a.yaml").find("a.yaml: cannot be written"), std::string::npos);
  EXPECT_EQ(test::read_file(folder / "a.yaml"), "old");
  EXPECT_TRUE(test::mentions(refusal(folder / "none" / "b.yaml"), "b.yaml: cannot be written"));
  std::filesystem::create_directory(folder / "c.yaml");
  EXPECT_NE(refusal(folder / "c.yaml").find("c.yaml: cannot be replaced"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder / "c.yaml.new"));
}

TEST(DurableFile, fullDiskIsAnErrorAndKeepsOldFile) {
  const test::TemporaryFolder folder;
  replace_durably(folder / "a.yaml", "old");
  std::filesystem::create_symlink("/dev/full", folder / "a.yaml.new");
  EXPECT_NE(refusal(folder / "a.yaml").find("No space left"), std::string::npos);
  EXPECT_EQ(test::read_file(folder / "a.yaml"), "old");
}

}  // namespace
}  // namespace vergence::app
