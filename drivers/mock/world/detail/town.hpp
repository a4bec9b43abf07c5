#pragma once
#include <span>

#include "core/math/random.hpp"
#include "drivers/mock/world/detail/materials.hpp"
#include "drivers/mock/world/detail/scene.hpp"
#include "drivers/mock/world/world.hpp"

namespace vergence::mock {

/// Distance in m from the centreline to the kerb: a lane and parked cars.
inline constexpr double kRoadHalf = 5.5;
/// In m.
inline constexpr double kPavementWidth = 2.0;
/// Length in m by which kerbs are cut at crossings for turning cars.
inline constexpr double kCornerCut = 4.0;
/// Length in m along x of the flat pieces of ground.
inline constexpr double kGroundStep = 10.0;
/// Limits in m; outside is open country.
inline constexpr double kWorldX0 = -150, kWorldX1 = 450, kWorldY0 = -150, kWorldY1 = 350;

/// Smooth height of the ground in m, and the drawn flat pieces; equal at multiples of kGroundStep.
[[nodiscard]] double smooth_ground(double hill_deg, double x) noexcept;
[[nodiscard]] double smooth_ground_slope(double hill_deg, double x) noexcept;
[[nodiscard]] double drawn_ground(double hill_deg, double x) noexcept;

/// Adds polygons to a scene; those between begin() and end() form an object.
class SceneBuilder {
 public:
  SceneBuilder(const WorldOptions& options, Scene* scene) : options_(options), scene_(scene) {}

  void begin();
  void end();

  [[nodiscard]] double ground(double x) const noexcept {
    return drawn_ground(options_.hill_deg, x);
  }

  /// Adds a convex polygon on the ground, corners counter-clockwise from above. It is cut where the
  /// ground bends; each piece is an object.
  void ground_polygon(std::span<const Vec2> outline, double lift_m, int material,
                      float light = 1.0F);
  /// Adds a kerb's vertical face from a to b; its front is on the right of that direction.
  void kerb(const Vec2& a, const Vec2& b);

  struct Face {
    int material = 0;
    float light = 1.0F;
    /// Texture position of the face's lower left corner.
    double u_offset_m = 0, v_offset_m = 0;
  };
  /// Adds a quad or triangle; (u, v) start at corner 0, u along corner 0 → 1, v perpendicular.
  void flat(std::span<const Vec3> corners, const Face& face, bool two_sided = false);
  /// Adds a polygon with the whole texture (its metres over `span_u` x `span_v` of the polygon).
  void textured_quad(std::span<const Vec3> corners, int material, float light, double span_u,
                     double span_v);
  /// Upright box by the centre of its base, the unit direction of its length, half length, half
  /// width and height.
  struct Box {
    Vec3 base = Vec3::Zero();
    Vec2 along = Vec2::UnitX();
    double half_length = 1, half_width = 1, height = 1;
  };
  void box(const Box& b, const Face& front_back, const Face& sides, const Face* top);

 private:
  void push(const Polygon& polygon);

  const WorldOptions& options_;
  Scene* scene_;
  std::size_t first_ = 0;
};

/// Fills scene->bus, without a place in the world.
void build_bus(const WorldOptions& options, Scene* scene);

/// Builds the whole suburb (town.cpp) of small objects (props.cpp).
void build_town(const WorldOptions& options, Scene* scene);

/// Lot along a street: position, direction of the street and direction of the house.
struct Lot {
  /// Foot on the street's centreline, in m.
  Vec2 on_centreline;
  /// Unit vector; to the right when looking at the house from the street.
  Vec2 along;
  /// Unit vector from the street to the house.
  Vec2 outward;
  [[nodiscard]] Vec2 at(double along_m, double from_centreline_m) const {
    return on_centreline + along_m * along + from_centreline_m * outward;
  }
};

void add_house(SceneBuilder* builder, const Lot& lot, Random* random);
void add_garden(SceneBuilder* builder, const Lot& lot, Random* random);
void add_car(SceneBuilder* builder, const Lot& lot, double along_m, Random* random);
void add_tree(SceneBuilder* builder, const Vec2& foot, double size_m, double lift_m,
              Random* random);
void add_power_pole(SceneBuilder* builder, const Lot& lot);
void add_sign(SceneBuilder* builder, const Vec2& foot, const Vec2& facing, int board);
void add_flats(SceneBuilder* builder, const Vec2& centre, double half_length, double half_width,
               int storeys, Random* random);
/// Opaque below, ragged on top; visible from both sides.
void add_tree_line(SceneBuilder* builder, const Vec2& a, const Vec2& b, double height_m,
                   Random* random);

}  // namespace vergence::mock
