#include "core/memory/fixed_vector.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "core/math/random.hpp"

namespace vergence {
namespace {

/// Both containers promise the same; a std::vector with a limit is the model they are held against.
template <class Vector>
void walk_beside_a_model(Vector& vector, std::uint64_t seed) {
  Random random(seed);
  std::vector<int> model;
  for (int step = 0; step < 5000; ++step) {
    switch (random.below(8)) {
      // Five of eight operations push, so the vector is sometimes full.
      default: {
        const int value = static_cast<int>(random.below(1000));
        const bool room = model.size() < vector.capacity();
        ASSERT_EQ(vector.push(value), room) << "step " << step;
        if (room) model.push_back(value);
        break;
      }
      case 0:
      case 1:
        if (!model.empty()) {
          const std::size_t n = model.size() - random.below(2);
          vector.truncate(n);
          model.resize(n);
        }
        break;
      case 2:
        if (random.below(20) == 0) {
          vector.clear();
          model.clear();
        }
        break;
    }
    ASSERT_EQ(vector.size(), model.size()) << "step " << step;
    ASSERT_EQ(vector.empty(), model.empty());
    ASSERT_EQ(vector.full(), model.size() == vector.capacity());
    ASSERT_TRUE(std::equal(vector.begin(), vector.end(), model.begin(), model.end()))
        << "step " << step;
    if (!model.empty()) {
      ASSERT_EQ(vector.back(), model.back());
      ASSERT_EQ(vector.span().size(), model.size());
    }
  }
}

TEST(FixedVector, operationsMatchALimitedVector) {
  FixedVector<int, 13> vector;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) walk_beside_a_model(vector, seed), vector.clear();
}

TEST(BoundedVector, operationsMatchALimitedVector) {
  std::array<int, 13> storage{};
  BoundedVector<int> vector(storage);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) walk_beside_a_model(vector, seed), vector.clear();
}

}  // namespace
}  // namespace vergence
