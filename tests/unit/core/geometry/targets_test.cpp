#include <gtest/gtest.h>

#include <functional>
#include <vector>

#include "core/geometry/detail/kernels.hpp"
#include "core/math/random.hpp"
#include "tests/support/simd_targets.hpp"

namespace vergence::detail {
namespace {

using test::Fingerprint;

constexpr std::size_t kPoints = 8 * kFloatBlock;

/// Points some metres ahead, a few of them behind the camera, and pixels near where they are seen.
/// Uniform numbers only: logarithms and cosines are not the same on every machine, these are.
template <class Number>
struct Scene {
  std::vector<Number> x, y, z, u, v, weight, cap;

  Scene() : x(kPoints), y(x), z(x), u(x), v(x), weight(x), cap(x) {
    Random random(41);
    for (std::size_t i = 0; i < kPoints; ++i) {
      const double depth = i % 13 == 5 ? -random.uniform(1, 5) : random.uniform(2, 60);
      const double a = random.uniform(-0.6, 0.6), b = random.uniform(-0.4, 0.4);
      x[i] = static_cast<Number>(a * depth);
      y[i] = static_cast<Number>(b * depth);
      z[i] = static_cast<Number>(depth);
      u[i] = static_cast<Number>(700 * a + random.uniform(-4, 4));
      v[i] = static_cast<Number>(690 * b + random.uniform(-4, 4));
      weight[i] = static_cast<Number>(random.uniform(0.2, 4));
      cap[i] = static_cast<Number>(9);
    }
  }
};

RefineCamera camera() {
  // A turn by atan(3/4) about the optical axis: entries that floats do not hold exactly.
  return {{0.8, -0.6, 0, 0.6, 0.8, 0, 0, 0, 1}, {0.02, -0.01, 0.03}, {-0.5, 0.01, 0.02}, 700, 690};
}

/// The sums run in virtual lanes and are closed in a fixed order, so that not one bit depends on
/// the target, nor on the machine: the fingerprints are the same on x86-64 and on arm64.
void expect_bits(std::uint64_t expected, const std::function<void(Fingerprint&)>& compute) {
  test::on_every_target([&](const char* target) {
    Fingerprint bits;
    compute(bits);
    EXPECT_EQ(bits.value(), expected) << target << std::hex << ": 0x" << bits.value();
  });
}

TEST(GeometryTargets, projectionCostIsBitIdentical) {
  const Scene<float> s;
  const ScoreColumns columns{s.x.data(), s.y.data(),      s.z.data(),  s.u.data(),
                             s.v.data(), s.weight.data(), s.cap.data()};
  const ProjectionRows rows{700,  0.25F,  -0.5F, 0.01F,  -0.25F, 690,
                            0.5F, -0.02F, 1e-4F, -2e-4F, 1,      5e-4F};
  expect_bits(0xafa58aa9dfab095dU, [&](Fingerprint& bits) {
    for (std::size_t first = 0; first < kPoints; first += kFloatBlock)
      bits.add(projection_cost(columns, first, kPoints, rows, 0.1F));
  });
}

TEST(GeometryTargets, sampsonCostIsBitIdentical) {
  Scene<float> s;
  std::vector<float> x1(kPoints), y1(kPoints), x2(kPoints), y2(kPoints);
  // The coordinates are normalised and belong to a step straight ahead.
  for (std::size_t i = 0; i < kPoints; ++i) {
    x1[i] = s.x[i] / s.z[i];
    y1[i] = s.y[i] / s.z[i];
    x2[i] = s.u[i] / 700;
    y2[i] = s.v[i] / 690;
    s.weight[i] *= 490000;
  }
  const MatchColumns columns{x1.data(), y1.data(),       x2.data(),
                             y2.data(), s.weight.data(), s.cap.data()};
  const std::array<float, 9> E{1e-3F, -1, 2e-3F, 1, 5e-4F, -1e-3F, -2e-3F, 1e-3F, 1e-5F};
  expect_bits(0x41e6fb3db8cfb4bdU, [&](Fingerprint& bits) {
    for (std::size_t first = 0; first < kPoints; first += kFloatBlock)
      bits.add(sampson_cost(columns, first, kPoints, E));
  });
}

TEST(GeometryTargets, normalSumsAreBitIdentical) {
  const Scene<double> s;
  const RefineColumns columns{s.x.data(), s.y.data(), s.z.data(),
                              s.u.data(), s.v.data(), s.weight.data()};
  expect_bits(0x46fd8a627de62969U, [&](Fingerprint& bits) {
    for (std::size_t n = kDoubleBlock; n <= kPoints; n += kDoubleBlock) {
      const NormalSums sums = normal_sums(columns, n, camera(), 0.75, 1.345, 0.1, 20);
      bits.add(std::span<const double>(sums.H));
      bits.add(std::span<const double>(sums.g));
      bits.add(sums.cost);
    }
  });
}

TEST(GeometryTargets, squaredErrorsAreBitIdentical) {
  const Scene<double> s;
  const RefineColumns columns{s.x.data(), s.y.data(), s.z.data(),
                              s.u.data(), s.v.data(), s.weight.data()};
  expect_bits(0x97a30e68df41235cU, [&](Fingerprint& bits) {
    std::vector<double> out(kPoints);
    squared_errors(columns, kPoints, camera(), 0.1, 1e6, out.data());
    bits.add(std::span<const double>(out));
  });
}

}  // namespace
}  // namespace vergence::detail
