#pragma once
#include <optional>

#include "core/comparison/enu_alignment.hpp"
#include "core/memory/arena.hpp"
#include "core/memory/fixed_vector.hpp"

namespace vergence {

struct ComparisonOptions;

/// Collects pairs of poses and fixes along the first metres driven, and fits the alignment of
/// `world` on the earth to them (DESIGN §6). The alignment then stays until restart().
///
/// Threads one. Memory from the arena at construction; full: the newest pair takes the place of the
/// one before.
class EnuAlignmentBuilder {
 public:
  static constexpr std::size_t kPairs = 1024;

  /// `options` outlive this.
  EnuAlignmentBuilder(const ComparisonOptions& options, Arena& arena);
  [[nodiscard]] static std::size_t bytes_needed() noexcept;

  /// A pose with a fix, in order; fits once the distance is driven.
  void add(const EnuAlignmentPair& pair) noexcept;
  /// No fix or no pose: what is driven until the next pair does not count.
  void interrupt() noexcept { last_world_.reset(); }
  /// Pairs until now and those to come do not fit together.
  void restart() noexcept;
  [[nodiscard]] bool collecting() const noexcept { return collecting_; }
  /// The drive is over: fits to what there is, if there is no alignment yet.
  void finish() noexcept;

  /// revision 0: none yet.
  [[nodiscard]] const EnuAlignment& alignment() const noexcept { return alignment_; }
  /// Why the last attempt gave none.

 private:
  void fit() noexcept;

  const ComparisonOptions& options_;
  BoundedVector<EnuAlignmentPair> pairs_;
  bool collecting_ = true;
  std::optional<Vec3> last_world_;  // of a pose with a fix, for the distance driven
  double driven_ = 0;               // m, since collecting began
  double next_pair_at_ = 0;
  EnuAlignment alignment_{};
  EnuAlignmentStatus status_ = EnuAlignmentStatus::too_few;
};

}  // namespace vergence
