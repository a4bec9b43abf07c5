#include "drivers/v4l2/stamps.hpp"

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <vector>

namespace vergence::v4l2 {
namespace {

constexpr std::uint32_t kMonotonic = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
constexpr Duration kExposure = Duration::milliseconds(8), kReadout = Duration::milliseconds(12);
constexpr HostStamp kArrival{5'000'000'000};

TEST(V4l2Stamps, flagsGiveTheKind) {
  EXPECT_EQ(stamp_kind(kMonotonic | V4L2_BUF_FLAG_TSTAMP_SRC_SOE, 1), StampKind::exposure_start);
  EXPECT_EQ(stamp_kind(kMonotonic | V4L2_BUF_FLAG_TSTAMP_SRC_EOF, 1), StampKind::frame_end);
  EXPECT_EQ(stamp_kind(kMonotonic | V4L2_BUF_FLAG_ERROR | V4L2_BUF_FLAG_KEYFRAME, 1),
            StampKind::frame_end)
      << "other flags say nothing";
  EXPECT_EQ(stamp_kind(V4L2_BUF_FLAG_TIMESTAMP_COPY, 1), StampKind::none)
      << "somebody else's clock";
  EXPECT_EQ(stamp_kind(V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN, 1), StampKind::none);
  EXPECT_EQ(stamp_kind(kMonotonic, 0), StampKind::none) << "a zero is no stamp";
}

TEST(V4l2Stamps, exposureStartIsComputedByKindOfStamp) {
  const std::int64_t stamp = 4'900'000'000;
  EXPECT_EQ(exposure_start(StampKind::exposure_start, stamp, kArrival, kExposure, kReadout),
            DeviceStamp(stamp));
  EXPECT_EQ(exposure_start(StampKind::frame_end, stamp, kArrival, kExposure, kReadout),
            DeviceStamp(stamp - 20'000'000));
  EXPECT_EQ(exposure_start(StampKind::none, stamp, kArrival, kExposure, kReadout),
            DeviceStamp(kArrival.ns() - 20'000'000));
}

TEST(V4l2Sequence, countsFromZeroAndReportsGaps) {
  struct Row {
    std::uint32_t sequence;
    // Time of the stamp, used if the buffers have no numbers.
    int ms;
    std::uint64_t counter, missing;
  };
  const auto expect = [](Duration period, const std::vector<Row>& rows) {
    SequenceCounter counter(period);
    for (const Row& row : rows) {
      const auto step =
          counter.next(row.sequence, DeviceStamp(1'000'000'000) + Duration::milliseconds(row.ms));
      EXPECT_EQ(step.counter, row.counter) << row.sequence << " at " << row.ms;
      EXPECT_EQ(step.missing, row.missing) << row.sequence << " at " << row.ms;
    }
  };
  expect({}, {{17, 0, 0, 0}, {18, 0, 1, 0}, {22, 0, 5, 3}, {23, 0, 6, 0}});
  // The sequence wraps, and then goes back.
  expect({}, {{0xFFFFFFFE, 0, 0, 0}, {0xFFFFFFFF, 0, 1, 0}, {1, 0, 3, 1}});
  expect({}, {{100, 0, 0, 0}, {3, 0, 1, 0}, {4, 0, 2, 0}});
  // Without numbers: by time, with jitter; two at once are two.
  expect(Duration::milliseconds(40), {{0, 0, 0, 0}, {0, 43, 1, 0}, {0, 157, 4, 2}, {0, 158, 5, 0}});
}

TEST(V4l2Raster, keepsTheFirstFrameOfEachInterval) {
  // The frame rate is 59.94 Hz.
  const Duration interval = Duration::milliseconds(100), frame = Duration::nanoseconds(16'683'333);
  // Two cameras at one rate, started at different times: what they keep lies within one frame of
  // each other.
  Raster left(interval), right(interval);
  std::vector<DeviceStamp> kept[2];
  std::uint64_t first[2] = {}, counters[2] = {};
  for (int camera = 0; camera < 2; ++camera)
    for (int i = 0; i < 590; ++i) {
      const DeviceStamp t = DeviceStamp(7'003'000'000 + camera * 5'000'000) + frame * i;
      SequenceCounter::Step step;
      if (!(camera == 0 ? left : right).keep(t, &step)) continue;
      EXPECT_EQ(step.missing, 0U);
      if (kept[camera].empty()) first[camera] = step.counter;
      counters[camera] = step.counter;
      kept[camera].push_back(t);
    }
  EXPECT_EQ(first[0], 0U);
  ASSERT_EQ(kept[0].size(), kept[1].size());
  EXPECT_EQ(counters[0], kept[0].size() - 1);
  for (std::size_t i = 1; i < kept[0].size(); ++i) {
    EXPECT_LT((kept[0][i] - kept[1][i]).ns(), frame.ns());
    EXPECT_LT((kept[1][i] - kept[0][i]).ns(), frame.ns());
  }
}

TEST(V4l2Raster, intervalWithoutAFrameIsMissing) {
  Raster raster(Duration::milliseconds(100));
  SequenceCounter::Step step;
  EXPECT_TRUE(raster.keep(DeviceStamp(1'050'000'000), &step));
  EXPECT_FALSE(raster.keep(DeviceStamp(1'099'000'000), &step));
  EXPECT_TRUE(raster.keep(DeviceStamp(1'450'000'000), &step));
  EXPECT_EQ(step.counter, 4U);
  EXPECT_EQ(step.missing, 3U);
  EXPECT_FALSE(raster.keep(DeviceStamp(1'150'000'000), &step)) << "late";
}

}  // namespace
}  // namespace vergence::v4l2
