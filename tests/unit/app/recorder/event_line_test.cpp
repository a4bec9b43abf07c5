#include "app/recorder/record_lines.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

#include <nlohmann/json.hpp>

namespace vergence::app {
namespace {

nlohmann::json parsed(const EventRecord& event) {
  std::string line;
  format_event(event, &line);
  EXPECT_EQ(line.back(), '\n');
  EXPECT_EQ(line.find('\n'), line.size() - 1) << "one line";
  return nlohmann::json::parse(line);
}

TEST(EventLine, isAJsonObjectWithItsFieldsInTheirTypes) {
  EventRecord event;
  event.stamp = Stamp(1'577'836'800'000'000'001);
  event.kind = "drop";
  event.set_sentence("a \"word\" with a \\ and\ttwo\nlines");
  event.fields[0] = {"count", std::int64_t{-3}};
  event.fields[1] = {"percent", 0.1};
  event.fields[2] = {"whole", 2.0};
  event.fields[3] = {"why", "late"};
  const nlohmann::json json = parsed(event);
  EXPECT_EQ(json["stamp_ns"], 1'577'836'800'000'000'001);
  EXPECT_EQ(json["kind"], "drop");
  EXPECT_EQ(json["sentence"], "a \"word\" with a \\ and\ttwo\nlines");
  EXPECT_EQ(json["fields"]["count"], -3);
  EXPECT_EQ(json["fields"]["percent"], 0.1);
  EXPECT_TRUE(json["fields"]["whole"].is_number_float()) << json.dump();
  EXPECT_EQ(json["fields"]["why"], "late");
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
