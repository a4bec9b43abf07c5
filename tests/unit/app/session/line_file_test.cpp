#include "app/session/line_file.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

#include <nlohmann/json.hpp>

#include "app/session/record_lines.hpp"
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

nlohmann::json parsed(const EventRecord& event) {
  std::string line;
  format_event(event, &line);
  EXPECT_EQ(line.back(), '\n');
  EXPECT_EQ(line.find('\n'), line.size() - 1) << "one line";
  return nlohmann::json::parse(line);
}

TEST(EventLine, numbersThatJsonDoesNotHaveAreNull) {
  EventRecord event;
  event.kind = "k";
  event.fields[0] = {"nan", std::numeric_limits<double>::quiet_NaN()};
  event.fields[1] = {"infinite", -std::numeric_limits<double>::infinity()};
  const nlohmann::json json = parsed(event);
  EXPECT_TRUE(json["fields"]["nan"].is_null());
  EXPECT_TRUE(json["fields"]["infinite"].is_null());
}

/// Valid as they are: two, three and four bytes. Replaced: a lone continuation, a cut sequence, a
/// form that is too long, a surrogate, beyond the last code point.
TEST(EventLine, bytesThatAreNoUtf8AreReplaced) {
  const std::string good = "\xc3\xa9 \xe2\x82\xac \xf0\x9f\x9a\x97";
  EventRecord event;
  event.kind = "k";
  event.set_sentence(good);
  EXPECT_EQ(parsed(event)["sentence"], good);
  for (const char* bad :
       {"\x80", "a\xe2\x82z", "\xc0\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xff"}) {
    std::size_t i = 0;
    for (; bad[i] != 0; ++i) event.sentence[i] = bad[i];
    event.sentence[i] = 0;
    const std::string sentence = parsed(event)["sentence"];
    EXPECT_NE(sentence.find("\xef\xbf\xbd"), std::string::npos) << sentence;
  }
}

}  // namespace
}  // namespace vergence::app
