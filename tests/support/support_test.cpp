#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence {
namespace {

Eigen::Vector2d curve(const Eigen::Vector3d& d) {
  return {std::sin(d.x()) + d.y() * d.y(), d.z() * (1.0 + d.x())};
}

TEST(NumericJacobian, acceptsTheRightDerivativeAndPrintsBothWhenOneIsWrong) {
  Eigen::Matrix<double, 2, 3> J;
  J << 1, 0, 0, 0, 0, 1;
  EXPECT_TRUE(test::jacobian_matches(J, curve, 1e-8));
  J(1, 2) = -1;
  const testing::AssertionResult wrong = test::jacobian_matches(J, curve, 1e-8);
  EXPECT_FALSE(wrong);
  EXPECT_NE(std::string(wrong.message()).find("column 2"), std::string::npos);
  EXPECT_NE(std::string(wrong.message()).find("numeric"), std::string::npos);
}

TEST(NumericJacobian, refusesWhatIsNotANumber) {
  Eigen::Matrix<double, 2, 3> J = Eigen::Matrix<double, 2, 3>::Constant(std::nan(""));
  EXPECT_FALSE(test::jacobian_matches(J, curve, 1e-8));
}

TEST(TemporaryFolder, isThereWhileTheObjectLivesAndGoneAfter) {
  std::filesystem::path was;
  {
    const test::TemporaryFolder folder;
    was = folder.path();
    const auto file = folder.write("a/b.txt", "two\nlines");
    EXPECT_EQ(test::read_file(file), "two\nlines");
    const test::TemporaryFolder other;
    EXPECT_NE(other.path(), was);
  }
  EXPECT_FALSE(std::filesystem::exists(was));
}

}  // namespace
}  // namespace vergence
