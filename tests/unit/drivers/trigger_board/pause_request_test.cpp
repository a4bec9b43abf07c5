#include "drivers/trigger_board/board_line.hpp"

#include <gtest/gtest.h>

namespace vergence::trigger_board {
namespace {

constexpr HostStamp kStart(1'000'000'000);
constexpr HostStamp after_limits(int n) { return kStart + PauseRequest::kAnswerLimit * n; }

TEST(PauseRequest, isSentOnceWhereItIsAnswered) {
  PauseRequest request;
  EXPECT_EQ(request.due(kStart), 0U);
  request.add(4);
  ASSERT_EQ(request.due(kStart), 4U);
  request.sent(9, kStart);
  EXPECT_EQ(request.due(kStart + Duration::milliseconds(1)), 0U) << "its answer is on the way";
  request.answered(8);  // of another message
  ASSERT_EQ(request.due(after_limits(1)), 4U);
  request.sent(10, after_limits(1));
  request.answered(10);
  EXPECT_EQ(request.due(after_limits(5)), 0U);
}

TEST(PauseRequest, isGivenUpAfterThreeMessagesWithoutAnAnswer) {
  PauseRequest request;
  request.add(2);
  for (int i = 0; i < PauseRequest::kMostSent; ++i) {
    ASSERT_EQ(request.due(after_limits(i)), 2U);
    request.sent(static_cast<std::uint8_t>(i), after_limits(i));
  }
  EXPECT_EQ(request.due(after_limits(3)), 0U);
  EXPECT_EQ(request.due(after_limits(9)), 0U);
}

TEST(PauseRequest, oneThatComesWhileAnotherWaitsIsAddedToIt) {
  PauseRequest request;
  request.add(2);
  ASSERT_EQ(request.due(kStart), 2U);
  request.sent(1, kStart);
  request.add(3);
  EXPECT_EQ(request.due(kStart), 5U) << "at once, not after the answer's limit";
}

TEST(PauseRequest, whatWasSentOutlivesADroppedRequestButNotAnotherStartOfTheBoard) {
  PauseRequest request;
  request.add(2);
  ASSERT_EQ(request.due(kStart), 2U);
  request.sent(1, kStart);
  request.add(3);
  request.drop_new();
  EXPECT_EQ(request.due(after_limits(1)), 2U);
  request.restart();
  EXPECT_EQ(request.due(after_limits(2)), 0U);
}

TEST(PauseRequest, aRefusedOneIsNotSentAgain) {
  PauseRequest request;
  request.add(2);
  ASSERT_EQ(request.due(kStart), 2U);
  request.sent(1, kStart);
  request.refused();
  EXPECT_EQ(request.due(after_limits(1)), 0U);
}

}  // namespace
}  // namespace vergence::trigger_board
