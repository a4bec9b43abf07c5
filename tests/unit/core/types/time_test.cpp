#include "core/types/time.hpp"

#include <gtest/gtest.h>

#include <concepts>

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

TEST(Duration, secondsRoundToTheNearestNanosecond) {
  EXPECT_EQ(Duration::seconds(0.049999872).ns(), 49'999'872);
  EXPECT_EQ(Duration::seconds(-0.049999872).ns(), -49'999'872);
  EXPECT_EQ(Duration::seconds(1.6e-9).ns(), 2);
  EXPECT_EQ(Duration::seconds(-1.6e-9).ns(), -2);
  EXPECT_EQ(Duration::seconds(0).ns(), 0);
  EXPECT_DOUBLE_EQ(Duration::nanoseconds(1'500'000'000).to_seconds(), 1.5);
}

}  // namespace
}  // namespace vergence
