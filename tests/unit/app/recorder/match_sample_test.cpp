#include "app/recorder/match_sample.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "core/memory/arena.hpp"

namespace vergence::app {
namespace {

/// A log whose every frame has so many observations; the left pixel counts them all.
class Drive {
 public:
  explicit Drive(std::size_t observations)
      : observations_(observations),
        arena_(calibration::TrackLog::memory_needed(3, observations) + 64),
        log_(3, observations, arena_) {}

  void frame(std::uint64_t number, unsigned cameras) {
    calibration::LoggedFrame f;
    f.number = number;
    log_.begin(f);
    for (std::size_t i = 0; i < observations_; ++i) {
      calibration::LoggedObservation s;
      s.cameras = static_cast<std::uint8_t>(cameras);
      s.raw[0] = {static_cast<float>(count_++), 0};
      log_.push(s);
    }
  }
  [[nodiscard]] const calibration::TrackLog& log() const { return log_; }

 private:
  std::size_t observations_, count_ = 0;
  Arena arena_;
  calibration::TrackLog log_;
};

std::vector<double> lefts(const MatchSample& sample) {
  std::vector<double> values;
  for (const RawMatch& m : sample.matches()) values.push_back(m.left[0]);
  return values;
}

TEST(MatchSample, takesEveryNewFrameOnce) {
  const auto sample = std::make_unique<MatchSample>();
  Drive drive(2);
  sample->take(drive.log());
  EXPECT_TRUE(sample->matches().empty());
  drive.frame(4, 3);
  sample->take(drive.log());
  sample->take(drive.log());
  drive.frame(9, 3);
  sample->take(drive.log());
  EXPECT_EQ(lefts(*sample), (std::vector<double>{0, 1, 2, 3}));
  EXPECT_EQ(sample->matches()[1].frame, 4U);
  EXPECT_EQ(sample->matches()[2].frame, 9U);
}

TEST(MatchSample, onlyWhatBothCamerasSeeIsAMatch) {
  const auto sample = std::make_unique<MatchSample>();
  Drive drive(1);
  for (const unsigned cameras : {1U, 2U, 6U}) {
    drive.frame(cameras, cameras);
    sample->take(drive.log());
  }
  EXPECT_TRUE(sample->matches().empty());
  drive.frame(7, 1U | 4U | 8U);
  sample->take(drive.log());
  ASSERT_EQ(sample->matches().size(), 2U);
  EXPECT_EQ(sample->matches()[0].camera, 2);
  EXPECT_EQ(sample->matches()[1].camera, 3);
}

TEST(MatchSample, aLongDriveIsSampledThinnerAndEvenly) {
  const auto sample = std::make_unique<MatchSample>();
  Drive drive(777);
  for (std::uint64_t i = 0; i < 130; ++i) {  // 101 010 matches: every eighth
    drive.frame(i, 3);
    sample->take(drive.log());
  }
  const std::vector<double> values = lefts(*sample);
  ASSERT_EQ(values.size(), 12'627U);
  for (std::size_t i = 0; i < values.size(); ++i)
    ASSERT_EQ(values[i], 8.0 * static_cast<double>(i));
}

}  // namespace
}  // namespace vergence::app
