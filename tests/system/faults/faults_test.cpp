// Every fault of the mock, one at a time, and random schedules of them: the drive goes on, says
// what it meets, is usable again, and calls no wrong pose `ok`.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>

#include "tests/system/faults/fault_drive.hpp"

namespace vergence::test {
namespace {

const Untouched& untouched() {
  static const Untouched drive = untouched_drive();
  return drive;
}

std::string described(const FaultCase& c, const FaultDrive& drive, const FaultResult& result) {
  return fault_table_line(c, drive, result) + drive.err;
}

struct Driven {
  FaultDrive drive;
  FaultResult result{};
};

Driven expect_honest(const FaultCase& c) {
  EXPECT_EQ(untouched().unfit, "");
  Driven d{.drive = drive_with_faults(c)};
  d.result = evaluate(c, d.drive, untouched().normal);
  SCOPED_TRACE(described(c, d.drive, d.result));
  EXPECT_EQ(d.drive.code, 0);
  EXPECT_TRUE(d.drive.whole);
  EXPECT_EQ(d.result.integrity.wrong, 0) << "from line " << d.result.integrity.first_wrong;
  EXPECT_EQ(d.result.integrity.not_evaluated, 0);
  return d;
}

class Faults : public ::testing::TestWithParam<FaultCase> {};

TEST_P(Faults, faultIsReportedAndRecoveredWithoutFalseOk) {
  const FaultCase& c = GetParam();
  const Driven d = expect_honest(c);
  SCOPED_TRACE(described(c, d.drive, d.result));
  EXPECT_EQ(d.drive.events.count("fault"), 1U);
  EXPECT_EQ(unsaid(c, d.drive, untouched().drive), "");
  for (const std::string& kind : c.unsaid) EXPECT_EQ(d.drive.events.count(kind), 0U) << kind;
  ASSERT_TRUE(d.result.recovery_s);
  EXPECT_LT(*d.result.recovery_s, c.recovers_within_s);
}

INSTANTIATE_TEST_SUITE_P(Alone, Faults, ::testing::ValuesIn(single_faults()), [](const auto& i) {
  std::string name;
  for (const char c : i.param.name)
    name += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return name;
});

// Where the image that would come twice is lost, only how uncertain the motions become tells at
// once that a camera is an exposure behind.
TEST(FaultPairs, imageLateAfterALostOneIsNotOk) {
  const auto pairs = fault_pairs();
  const auto pair = std::find_if(pairs.begin(), pairs.end(), [](const FaultCase& c) {
    return c.name == "30 % of the frames lost; one camera a frame late";
  });
  ASSERT_NE(pair, pairs.end());
  (void)expect_honest(*pair);
}

class RandomFaults : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(RandomFaults, sessionIsCompleteWithoutFalseOk) {
  (void)expect_honest(random_faults(GetParam()));
}

// In the 22nd a camera falls behind while a calibration is sought.
INSTANTIATE_TEST_SUITE_P(Seeds, RandomFaults, ::testing::Range<std::uint64_t>(1, 23));
// After frames of one image the window takes back 10 cm in one frame, 15 cm in two.
INSTANTIATE_TEST_SUITE_P(DriftTakenBack, RandomFaults, ::testing::Values(301, 359));

}  // namespace
}  // namespace vergence::test
