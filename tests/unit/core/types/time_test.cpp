#include "core/types/time.hpp"

#include <gtest/gtest.h>

#include <concepts>
#include <limits>

namespace vergence {
namespace {

template <class A, class B>
concept Subtractable = requires(A a, B b) {
  a - b;
};
static_assert(Subtractable<Stamp, Stamp>);
static_assert(Subtractable<Stamp, Duration>);
static_assert(!Subtractable<Stamp, HostStamp>, "two clocks have no difference");
static_assert(!std::convertible_to<std::int64_t, Stamp>);
static_assert(!std::convertible_to<std::int64_t, Duration>);

TEST(Duration, unitsAreExact) {
  EXPECT_EQ(Duration::milliseconds(3).ns(), 3'000'000);
  EXPECT_EQ(Duration::microseconds(-7).ns(), -7'000);
  EXPECT_EQ((Duration::milliseconds(1) + Duration::nanoseconds(1)).ns(), 1'000'001);
  EXPECT_EQ((-Duration::milliseconds(1) * 4 / 2).ns(), -2'000'000);
  EXPECT_LT(Duration::nanoseconds(-1), Duration{});
}

TEST(Duration, secondsRoundToTheNearestNanosecondOnBothSidesOfZero) {
  EXPECT_EQ(Duration::seconds(0.049999872).ns(), 49'999'872);
  EXPECT_EQ(Duration::seconds(-0.049999872).ns(), -49'999'872);
  EXPECT_EQ(Duration::seconds(1.6e-9).ns(), 2);
  EXPECT_EQ(Duration::seconds(-1.6e-9).ns(), -2);
  EXPECT_EQ(Duration::seconds(0).ns(), 0);
  EXPECT_DOUBLE_EQ(Duration::nanoseconds(1'500'000'000).to_seconds(), 1.5);
}

TEST(Instant, arithmeticStaysExactAtTodaysStamps) {
  const Stamp stamp(1'403'636'584'763'555'584);
  EXPECT_EQ((stamp + Duration::nanoseconds(1)).ns(), 1'403'636'584'763'555'585);
  EXPECT_EQ(((stamp + Duration::nanoseconds(1)) - stamp).ns(), 1);
  EXPECT_EQ((stamp - Duration::milliseconds(1)).ns(), 1'403'636'584'762'555'584);
  EXPECT_LT(stamp, stamp + Duration::nanoseconds(1));
  EXPECT_EQ(Stamp{}.ns(), 0);
}

}  // namespace
}  // namespace vergence
