#include "app/report/time_section.hpp"

#include <gtest/gtest.h>

#include <string>

#include "tests/unit/app/report/xml_check.hpp"

namespace vergence::app::report {
namespace {

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

Session session_of(const std::string& time) {
  Session s;
  s.summary = nlohmann::json::parse("{\"time\": " + time + "}");
  return s;
}

const std::string kWhole = R"({
"clocks": [{"device": "camera 0", "stamps": 900, "drift_ppm": 12.4, "error_us": 18.2, "worst_error_us": 2100},
           {"device": "board", "stamps": 900, "drift_ppm": -3, "error_us": 7.3, "worst_error_us": 40,
            "pings": {"rtt_median_us": 310, "pps_locked": true}}],
"clock_resets": 2, "worst_stamp_error_us": 54,
"pairing": {"mode": "board", "sentence": "pairs are proven by <numbers>", "can_be_proven": true, "proven": true, "worst_acquisition_s": 0.62,
  "sets": {"unproven": 3},
  "cameras": [{"losses": {"missed_trigger": 2, "late": 0}}, {"losses": {"missed_trigger": 0, "late": 0}}]},
"board": {"pulses": 900, "malformed": 4}, "ins": {"lost": 0},
"latency_ms": {"p50": 31, "p99": 48, "virtual": false, "edges": [10, 20, 50], "counts": [0, 5, 90, 5]},
"utc": {"host_ahead_s": -0.0123, "least_s": -0.02, "most_s": -0.01}})";

TEST(TimeSection, saysWhatProvesThePairsHowTheClocksWereAndWhatWasLost) {
  const TimeSection s = time_section(session_of(kWhole));
  for (const char* part :
       {"Pairs are proven by &lt;numbers&gt;.", "0.62 s at most", "3 sets contradicted",
        "+12.4 ppm", "7.3 µs", "2.1 ms", "310 µs", "locked", "54.0 µs at worst", "found set: 2",
        "missed trigger", "malformed 4", "The session's stamps were 0.0123 s behind the INS's UTC"})
    EXPECT_TRUE(contains(s.body, part)) << part << "\n" << s.body;
  EXPECT_FALSE(contains(s.body, "late")) << "what never happened has no row";
  EXPECT_EQ(test::XmlCheck::problem("<div>" + s.body + "</div>"), "");
}

TEST(TimeSection, theLatenciesAreAPictureOfTheBarsThatAreNotEmpty) {
  const TimeSection s = time_section(session_of(kWhole));
  EXPECT_EQ(test::XmlCheck::problem(s.latency), "");
  EXPECT_TRUE(contains(s.caption, "half within 31 ms, 99 % within 48 ms"));
  std::size_t bars = 0;
  for (std::size_t at = s.latency.find("<rect"); at != std::string::npos;
       at = s.latency.find("<rect", at + 1))
    ++bars;
  EXPECT_EQ(bars, 3U);
}

TEST(TimeSection, aDriveThatNothingProvesSaysThat) {
  const TimeSection s = time_section(
      session_of(R"({"pairing": {"sentence": "nothing proves that", "can_be_proven": false}})"));
  EXPECT_TRUE(contains(s.body, "Nothing proves that."));
  EXPECT_TRUE(s.latency.empty());
}

TEST(TimeSection, whatIsMissingOrNonsenseIsLeftOut) {
  EXPECT_TRUE(time_section(Session{}).body.empty());
  for (
      const char* text :
      {"null", "7", "[]", "{}",
       R"({"clocks": 3, "pairing": [1], "latency_ms": {"edges": ["a"], "counts": [1, 2]}})",
       R"({"clocks": [null, {"device": 5, "drift_ppm": "x"}], "pairing": {"cameras": [{"losses": 4}], "sentence": 3}})",
       R"({"latency_ms": {"edges": [1, 2], "counts": [1, 2]}, "board": {"lost": "many"}, "utc": {"host_ahead_s": []}})",
       R"({"latency_ms": {"edges": [1], "counts": [0, 0]}})"}) {
    const TimeSection s = time_section(session_of(text));
    EXPECT_EQ(test::XmlCheck::problem("<div>" + s.body + "</div>"), "") << text;
    EXPECT_TRUE(s.latency.empty()) << text;
  }
}

}  // namespace
}  // namespace vergence::app::report
