#pragma once
#include <cstdint>
#include <memory>
#include <optional>

#include "core/math/types.hpp"

namespace vergence::mock {

struct Scene;

/// Options of the world. The same options give the same world on every machine.
struct WorldOptions {
  std::uint64_t seed = 1;
  int texture_detail = 1;  // 0: facades of 4.7 cm a texel, 1: 2.3 cm, 2: 1.2 cm (8, 32, 128 MB)
  double built_fraction = 0.8;  // of the 12 m lots along a street that carry a house
  double car_fraction = 0.35;   // of the lots with a parked car in front
  double tree_fraction = 0.3;   // of the lots with a street tree
  double hill_deg = 3.0;        // steepest slope, 0..5; slopes run along the east-west streets
};

/// A suburb: three by three streets between lots with houses, kerbs, parked cars, poles, trees,
/// taller blocks 60–100 m away, hills on the horizon and a sky with faint clouds.
///
/// Frame      `enu`, metres: x east, y north, z up; the crossing of the first two streets on the
///            ground is the origin. Streets run along x at y = 0, 100, 200 and along y at x = 0,
///            150, 300.
/// Threads    Const after construction.
/// Memory     Textures as WorldOptions::texture_detail says, about 10 000 polygons.
/// Errors     The constructor throws std::invalid_argument naming the option out of range.
class World {
 public:
  explicit World(const WorldOptions& options);
  /// A scene made by hand instead of the town; of the options only hill_deg counts, for ground().
  World(const WorldOptions& options, std::unique_ptr<Scene> scene);
  ~World();

  /// Height of the smooth ground the streets follow, m. Pavements and gardens lie kKerb above it.
  [[nodiscard]] double ground(double x, double y) const noexcept;
  /// Derivative of ground() towards x; it does not depend on y.
  [[nodiscard]] double ground_slope(double x) const noexcept;

  struct Hit {
    double distance = 0;  // in units of |direction|, to the first solid surface
    bool veiled = false;  // leaves or another surface with holes may be in front of it
  };
  /// Returns the surface hit by a ray from `origin` (m); nullopt where there is only sky. Plain and
  /// slow: the measure for tests.
  [[nodiscard]] std::optional<Hit> cast(const Vec3& origin, const Vec3& direction) const noexcept;

  [[nodiscard]] const WorldOptions& options() const noexcept { return options_; }
  [[nodiscard]] const Scene& scene() const noexcept { return *scene_; }

 private:
  WorldOptions options_;
  std::unique_ptr<Scene> scene_;
};

inline constexpr double kKerb = 0.12;                                          // m
inline constexpr double kBusLength = 12.0, kBusWidth = 2.5, kBusHeight = 3.2;  // m
inline constexpr double kStreetSpacingX = 150.0, kStreetSpacingY = 100.0;  // m between centrelines

}  // namespace vergence::mock
