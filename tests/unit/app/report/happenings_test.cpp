#include "app/report/happenings.hpp"

#include <gtest/gtest.h>

namespace vergence::app::report {
namespace {

Session drive() {
  Session s;
  s.reasons = {"", "few_inliers", "no_pose"};
  for (int i = 0; i < 100; ++i) {
    Frame f;
    f.stamp = Stamp(i * std::int64_t{100'000'000});
    f.status = PoseStatus::ok;
    f.posed = true;
    s.frames.push_back(f);
  }
  return s;
}

TEST(Happenings, nothingHappenedOnAGoodDrive) {
  const Session s = drive();
  EXPECT_EQ(happenings_table(s, analyse(s)), "");
}

TEST(Happenings, saysWhatHowOftenAndWhenTheMostFrequentFirst) {
  Session s = drive();
  for (std::size_t i = 20; i < 50; ++i)
    s.frames[i].status = PoseStatus::degraded, s.frames[i].reason = 1;
  s.frames[70].status = PoseStatus::lost, s.frames[70].reason = 2, s.frames[70].posed = false;
  s.events = {
      {s.frames[60].stamp, "rig_changed", "the rig has changed: a <b>camera</b> was knocked"},
      {s.frames[80].stamp, "image_torn", "frame skipped"},
      {s.frames[90].stamp, "state", "of no interest"}};
  const std::string table = happenings_table(s, analyse(s));
  const auto few = table.find("the pose rested on few points"),
             lost = table.find("tracking failed");
  ASSERT_NE(few, std::string::npos) << table;
  EXPECT_LT(few, lost);
  for (const char* part : {"30 frames", "2.0 … 4.9 s", "1 frame<", "7.0 s",
                           "skipped: an image file is torn", "&lt;b&gt;camera", "once", "6.0 s"})
    EXPECT_NE(table.find(part), std::string::npos) << part << "\n" << table;
  EXPECT_EQ(table.find("of no interest"), std::string::npos);
}

TEST(Happenings, everyReasonIsSaidInWords) {
  for (int i = 1; i <= static_cast<int>(Reason::unproven_pairing); ++i) {
    Session s = drive();
    const std::string word(to_string(static_cast<Reason>(i)));
    s.reasons = {"", word};
    s.frames[5].status = PoseStatus::degraded, s.frames[5].reason = 1;
    const std::string table = happenings_table(s, analyse(s));
    EXPECT_NE(table.find("1 frame"), std::string::npos) << word;
    EXPECT_EQ(table.find("<td>" + word), std::string::npos) << word;
  }
}

}  // namespace
}  // namespace vergence::app::report
