// Measured scatter between stretches of a drive, from blocks drawn with a known scatter.
#include "core/calibration/detail/change_detector.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "core/math/random.hpp"

namespace vergence::calibration::detail {
namespace {

// Inflation of the noise, in px² per unit of information.
constexpr double kLambda = 3;
// Observations of a block, each with a sigma of 1 px.
constexpr double kObservations = 4e4;

/// Blocks of a drive, each with an offset of its own besides the noise of its tracks.
class Blocks {
 public:
  explicit Blocks(std::uint64_t seed) : random_(seed) {
    Mat5 root = Mat5::Identity();
    for (int i = 0; i < 5; ++i)
      for (int j = 0; j < i; ++j) root(i, j) = 0.3 * random_.normal();
    A_ = kObservations * root * root.transpose();
  }
  /// `rms_px`: of the offset over the image.
  [[nodiscard]] Evidence draw(double rms_px) {
    Vec5 noise, offset;
    for (int i = 0; i < 5; ++i) noise[i] = random_.normal();
    for (int i = 0; i < 5; ++i) offset[i] = random_.normal();
    // dᵀ A d / n is the mean square over the image: a fifth of it in each of A's own directions.
    const Eigen::LLT<Mat5> factor(A_);
    const Mat5 L = factor.matrixL();
    const Vec5 g =
        L * (std::sqrt(kLambda) * noise + std::sqrt(kObservations / 5) * rms_px * offset);
    Evidence e{.g = g, .A = A_, .n = kObservations};
    return e;
  }
  /// `count` blocks one after the other, each against those before it.
  void run(int count, double rms_px, BlockScatter* scatter) {
    for (int i = 0; i < count; ++i) {
      const Evidence block = draw(rms_px);
      scatter->add(block, past_, kLambda);
      past_.add(block);
    }
  }
  [[nodiscard]] const Evidence& past() const { return past_; }

 private:
  Random random_;
  Mat5 A_;
  Evidence past_;
};

// Noise alone is λ/n in each direction, 7.5e-5 px²; what is taken off for it leaves a mean over 60
// blocks of five that scatters by √(2/300) = 8 % of that, 6e-6. The expectation, 0.2² / 5 = 8e-3,
// weighs four blocks beside them.
TEST(BlockScatter, noiseAddsNoScatter) {
  BlockScatter s;
  s.expect(0.2);
  Blocks b(92);
  double before = s.variance();
  for (const int blocks : {5, 10, 45}) {
    b.run(blocks, 0, &s);
    EXPECT_LT(s.variance(), before);
    before = s.variance();
  }
  EXPECT_LT(s.variance(), 8e-3 * 4 / 63 + 3e-5);
  BlockScatter nothing_expected;
  nothing_expected.expect(0);
  Blocks c(93);
  c.run(100, 0, &nothing_expected);
  EXPECT_LT(nothing_expected.variance(), 3e-5);
}

// The mean of 60 blocks of five modes scatters by 8 %, and the expectation takes 4 of 64 shares.
TEST(BlockScatter, offsetsOfBlocksAreMeasured) {
  for (const double rms : {0.05, 0.2}) {
    BlockScatter s;
    s.expect(0.1);
    Blocks b(94);
    b.run(100, rms, &s);
    EXPECT_NEAR(5 * s.variance(), rms * rms, 0.4 * rms * rms) << rms;
  }
}

TEST(BlockScatter, blockOfAKnockOrASingularOrNonFiniteOneIsIgnored) {
  BlockScatter s;
  s.expect(0.1);
  Blocks b(96);
  b.run(20, 0.1, &s);
  const double before = s.variance();
  s.add(b.draw(3.0), b.past(), kLambda);
  s.add(Evidence{}, b.past(), kLambda);
  s.add(b.draw(0.1), Evidence{}, kLambda);
  Evidence flat = b.draw(0.1);
  flat.A.row(4).setZero();
  flat.A.col(4).setZero();
  s.add(flat, b.past(), kLambda);
  Evidence nan = b.draw(0.1);
  nan.g[2] = std::nan("");
  s.add(nan, b.past(), kLambda);
  EXPECT_EQ(s.variance(), before);
}

TEST(BlockScatter, oldScatterIsForgotten) {
  BlockScatter s;
  s.expect(0.1);
  Blocks b(97);
  b.run(60, 0.3, &s);
  const double before = s.variance();
  // Sixty blocks are remembered: after 180 quiet ones e⁻³ of it is left.
  b.run(180, 0, &s);
  EXPECT_LT(s.variance(), 0.15 * before);
}

}  // namespace
}  // namespace vergence::calibration::detail
