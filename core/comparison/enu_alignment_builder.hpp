#pragma once
#include <optional>

#include "core/comparison/enu_alignment.hpp"
#include "core/memory/arena.hpp"
#include "core/memory/fixed_vector.hpp"

namespace vergence {

struct ComparisonOptions;

/// Collects pairs of poses and fixes over the first metres and fits the alignment of `world` on the
/// earth to them. The alignment then stays until restart().
///
/// Not thread-safe. Memory from the arena at construction; if full, the newest pair replaces the
/// previous one.
class EnuAlignmentBuilder {
 public:
  static constexpr std::size_t kPairs = 1024;

  /// `options` must outlive this object.
  EnuAlignmentBuilder(const ComparisonOptions& options, Arena& arena);

  /// Adds a pose with a fix, in order; fits the alignment after the distance.
  void add(const EnuAlignmentPair& pair) noexcept;
  /// Call without a fix or pose: the distance to the next pair does not count.
  void interrupt() noexcept { last_world_.reset(); }
  /// Drops all pairs, because later ones do not fit them.
  void restart() noexcept;
  [[nodiscard]] bool collecting() const noexcept { return collecting_; }
  /// Call at the end: fits the available pairs if there is no alignment yet.
  void finish() noexcept;

  /// The alignment; revision 0 if there is none yet.
  [[nodiscard]] const EnuAlignment& alignment() const noexcept { return alignment_; }

 private:
  void fit() noexcept;

  const ComparisonOptions& options_;
  BoundedVector<EnuAlignmentPair> pairs_;
  bool collecting_ = true;
  // Position of the last pose with a fix, for the distance.
  std::optional<Vec3> last_world_;
  // Distance in m since collecting began.
  double driven_ = 0;
  double next_pair_at_ = 0;
  EnuAlignment alignment_{};
  EnuAlignmentStatus status_ = EnuAlignmentStatus::too_few;
};

}  // namespace vergence
