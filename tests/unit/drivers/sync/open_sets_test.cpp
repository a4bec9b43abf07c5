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
