#include "drivers/sync/open_sets.hpp"

#include <gtest/gtest.h>

namespace vergence {
namespace {

/// Opens a set with one camera's image.
OpenSet& open(OpenSets* sets, std::uint64_t number, std::size_t camera = 0) {
  OpenSet& set = sets->open(number, HostStamp(0));
  set.set.present[camera] = true;
  set.images[camera].time = static_cast<std::int64_t>(number) * 1000;
  return set;
}

TEST(OpenSets, theOldestIsTheOneWithTheLeastNumberWhateverTheOrderTheyCameIn) {
  OpenSets sets;
  EXPECT_EQ(sets.oldest(), nullptr);
  for (const std::uint64_t number : {5U, 3U, 4U}) open(&sets, number);
  ASSERT_NE(sets.oldest(), nullptr);
  EXPECT_EQ(sets.oldest()->set.number, 3U);
  sets.close(sets.oldest());
  EXPECT_EQ(sets.oldest()->set.number, 4U);
  EXPECT_EQ(sets.find(3), nullptr);
  EXPECT_EQ(sets.first_free(), 6U);
}

TEST(OpenSets, oneMoreThanMayWaitIsACrowd) {
  OpenSets sets;
  for (std::uint64_t n = 0; n < OpenSets::kOpen; ++n) open(&sets, n);
  EXPECT_FALSE(sets.crowded());
  open(&sets, OpenSets::kOpen);
  EXPECT_TRUE(sets.crowded());
  sets.close(sets.oldest());
  EXPECT_FALSE(sets.crowded());
}

TEST(OpenSets, whatHasGoneOutIsRememberedWithItsCameras) {
  OpenSets sets;
  EXPECT_FALSE(sets.is_out(0));
  sets.close(&open(&sets, 7, 1));
  EXPECT_TRUE(sets.is_out(7));
  EXPECT_TRUE(sets.is_out(2)) << "in the order of numbers";
  EXPECT_FALSE(sets.is_out(8));
  EXPECT_TRUE(sets.went_out_with(7, 1));
  EXPECT_FALSE(sets.went_out_with(7, 0));
  EXPECT_EQ(sets.last_time(), 7000) << "of the first camera that is there";
  sets.close(&open(&sets, 7 + OpenSets::kHistory, 0));
  EXPECT_FALSE(sets.went_out_with(7, 1)) << "too long ago";
}

TEST(OpenSets, aFlushConcernsWhatIsOpenAndNothingLater) {
  OpenSets sets;
  open(&sets, 1);
  open(&sets, 2);
  EXPECT_EQ(sets.flushed_below(), 0U);
  sets.flush();
  EXPECT_EQ(sets.flushed_below(), 3U);
}

TEST(OpenSets, onlySetsWithADoubtfulImageOfThatCameraAreContradicted) {
  OpenSets sets;
  OpenSet &doubtful = open(&sets, 1), &other = open(&sets, 2, 1), &sure = open(&sets, 3);
  doubtful.images[0].doubtful = other.images[1].doubtful = true;
  sets.contradict_doubtful(0);
  EXPECT_TRUE(doubtful.contradicted);
  EXPECT_FALSE(other.contradicted);
  EXPECT_FALSE(sure.contradicted);
}

}  // namespace
}  // namespace vergence
