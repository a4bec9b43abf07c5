#pragma once
#include <cstdint>
#include <memory>
#include <optional>

#include "core/math/types.hpp"

namespace vergence::mock {

struct Scene;

/// Options of the world. Equal options give the same world on every machine.
struct WorldOptions {
  std::uint64_t seed = 1;
  /// Texel size of facades: 0: 4.7 cm, 1: 2.3 cm, 2: 1.2 cm (8, 32, 128 MB).
  int texture_detail = 1;
  /// Share of the 12 m lots along a street that have a house.
  double built_fraction = 0.8;
  /// Share of the lots with a parked car in front.
  double car_fraction = 0.35;
  /// Share of the lots with a street tree.
  double tree_fraction = 0.3;
  /// Steepest slope, 0 to 5; slopes run along the east-west streets.
  double hill_deg = 3.0;
};

/// Suburb of three by three streets between lots with houses, kerbs, parked cars, poles, trees,
/// taller blocks 60–100 m away, hills on the horizon and a sky with faint clouds.
///
/// Frame      `enu` in metres: x east, y north, z up, origin on the ground at the crossing of the
///            first two streets. Streets run along x at y = 0, 100, 200 and along y at x = 0, 150,
///            300.
/// Threads    Constant after construction.
/// Memory     Textures by WorldOptions::texture_detail, about 10 000 polygons.
/// Errors     The constructor throws std::invalid_argument naming the option out of range.
class World {
 public:
  explicit World(const WorldOptions& options);
  /// Uses the given scene instead of the town; only hill_deg of the options applies, for ground().
  World(const WorldOptions& options, std::unique_ptr<Scene> scene);
  ~World();

  /// Height of the smooth ground under the streets, in m. Pavements and gardens are kKerb above it.
  [[nodiscard]] double ground(double x, double y) const noexcept;
  /// Derivative of ground() with respect to x; independent of y.
  [[nodiscard]] double ground_slope(double x) const noexcept;

  struct Hit {
    /// Distance to the first solid surface, in units of
    /// direction
    /// .
    double distance = 0;
    /// True if leaves or another perforated surface may be in front.
    bool veiled = false;
  };
  /// Surface hit by a ray from `origin` (m); nullopt for sky. Simple and slow; the reference for
  /// tests.
  [[nodiscard]] std::optional<Hit> cast(const Vec3& origin, const Vec3& direction) const noexcept;

  [[nodiscard]] const WorldOptions& options() const noexcept { return options_; }
  [[nodiscard]] const Scene& scene() const noexcept { return *scene_; }

 private:
  WorldOptions options_;
  std::unique_ptr<Scene> scene_;
};

/// In m.
inline constexpr double kKerb = 0.12;
/// In m.
inline constexpr double kBusLength = 12.0, kBusWidth = 2.5, kBusHeight = 3.2;
/// Distances of centrelines in m.
inline constexpr double kStreetSpacingX = 150.0, kStreetSpacingY = 100.0;

}  // namespace vergence::mock
