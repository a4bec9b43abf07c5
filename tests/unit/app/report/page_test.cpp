#include "app/report/report.hpp"
#include "tests/support/mentions.hpp"
#include "tests/support/session_writer.hpp"
#include "tests/unit/app/report/xml_check.hpp"

namespace vergence::app {
namespace {

using test::contains;

/// Nothing that a browser would load or run.
testing::AssertionResult self_contained(const std::string& html) {
  for (const char* word : {"<script", "src=", "@import", "url(",
                           "http:", "https:", "javascript:", "onload", "<iframe", "<object"})
    if (contains(html, word)) return testing::AssertionFailure() << "has " << word;
  return testing::AssertionSuccess();
}

std::string page_of(const std::filesystem::path& folder) {
  const ReportOutcome outcome = write_report(folder);
  return test::read_file(outcome.page);
}

test::SessionWriter writer_of(std::size_t frames) {
  test::SessionWriter writer;
  writer.frames = frames;
  return writer;
}

TEST(Page, completeSessionShowsEverySection) {
  const test::TemporaryFolder folder;
  writer_of(2000).write(folder.path());
  const std::string html = page_of(folder.path());
  EXPECT_TRUE(self_contained(html));
  EXPECT_EQ(test::xml_problem({html}), "");
  for (const char* part : {"0.74 %", "rotation x, degrees", "translation z, mm", ">verified</text>",
                           "20 m, at the end", "(20 times)"})
    EXPECT_TRUE(contains(html, part)) << part;
  EXPECT_FALSE(contains(html, "What is missing"));
  EXPECT_FALSE(contains(html, ">nan")) << "a number that is not there has no row";
}

TEST(Page, acceptsEveryTruncatedSession) {
  const test::TemporaryFolder whole;
  writer_of(300).write(whole.path());
  std::vector<std::string> pages;
  for (const char* missing :
       {"summary.json", "poses.csv", "reference.tum", "calibrations.csv", "events.jsonl"})
    // Share of the file that is kept; a negative share removes the file.
    for (const double kept : {-1.0, 0.0, 0.37, 0.99}) {
      const test::TemporaryFolder folder;
      std::filesystem::copy(whole.path(), folder.path(), std::filesystem::copy_options::recursive);
      const std::string text = test::read_file(folder / missing);
      std::filesystem::remove(folder / missing);
      if (kept >= 0)
        folder.write(
            missing,
            text.substr(0, static_cast<std::size_t>(kept * static_cast<double>(text.size()))));
      const std::string html = page_of(folder.path());
      EXPECT_TRUE(self_contained(html)) << missing << " " << kept;
      pages.push_back(html);
      if (kept < 0 || kept == 0.37) {
        EXPECT_TRUE(contains(html, "What is missing")) << missing << " " << kept;
      }
    }
  EXPECT_EQ(test::xml_problem(pages), "");
}

TEST(Page, escapesMarkupInText) {
  const test::TemporaryFolder folder;
  writer_of(200).write(folder.path());
  const std::string evil = "</svg><script>alert(1)</script><img src=x onerror=alert(2)>";
  std::ofstream(folder / "events.jsonl", std::ios::app)
      << R"({"stamp_ns":1,"kind":")" << evil << R"(","message":")" << evil << std::string(5000, 'x')
      << "\"}\n";
  std::ofstream(folder / "calibrations.csv", std::ios::app)
      << "1,accepted," << evil << ',' << evil << ",1,7,0,1,1,1,0,1,0,0,0,0,0,0"
      << std::string(20, ',') << '\n';
  folder.write("summary.json", R"({"version":")" + evil + R"(","configuration_hash":")" + evil +
                                   R"(","calibration":{"source":")" + evil + R"(","rating":")" +
                                   evil + R"("},"truth":{")" + evil + R"(":1}})");
  const std::string html = page_of(folder.path());
  EXPECT_EQ(test::xml_problem({html}), "");
  for (const char* word : {"<script", "<img"}) EXPECT_FALSE(contains(html, word)) << word;
  EXPECT_TRUE(contains(html, "&lt;script&gt;alert(1)"));
  EXPECT_FALSE(contains(html, std::string(400, 'x')));
}

TEST(WriteReport, replacesOldPageWithoutLeftovers) {
  const test::TemporaryFolder folder;
  writer_of(100).write(folder.path());
  folder.write("report.html", "old");
  const std::string html = page_of(folder.path());
  EXPECT_TRUE(html.starts_with("<!DOCTYPE html>"));
  EXPECT_EQ(html, page_of(folder.path())) << "the same session gives the same bytes";
  EXPECT_FALSE(std::filesystem::exists(folder / "report.html.new"));
}

}  // namespace
}  // namespace vergence::app
