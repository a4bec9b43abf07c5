#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace vergence::app {

/// The points of the live page's map, farther apart as the drive grows longer. A place has the
/// worst status of all that was driven up to the next one.
///
/// Threads  One.
/// Full     After kMost places those that are near others go; where the drive goes round and round,
///          the oldest do.
class LiveTrail {
 public:
  static constexpr std::size_t kMost = 4000;

  struct Place {
    std::array<float, 3> world{};               // m, of the left camera
    std::optional<std::array<float, 2>> ins{};  // m: east, north
    std::uint8_t status = 0;                    // PoseStatus
  };

  void add(const Place& place);
  [[nodiscard]] const std::vector<Place>& places() const noexcept { return places_; }
  /// Where the places begin that the last call has not had, or not as they are.
  [[nodiscard]] std::size_t take_new() noexcept { return std::exchange(shown_, places_.size()); }

 private:
  void thin();
  void drop_near();
  [[nodiscard]] float extent() const;

  std::vector<Place> places_{};
  float least_step_m_ = 0.5F;
  std::size_t shown_ = 0;  // places that a viewer has as they are
};

}  // namespace vergence::app
