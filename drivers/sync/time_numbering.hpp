#pragma once
#include <cstdint>

#include "drivers/sync/open_sets.hpp"
#include "drivers/sync/sync_types.hpp"

namespace vergence {

/// The numbers of sets from stamps of one clock: for the modes software, bus, ptp and one_picture.
///
/// What was exposed within the tolerance of an open set is of that set; anything else begins one,
/// so many intervals after the newest or before it. A clock that is set back by more than any frame
/// can be late, several frames in a row, begins a new count: what is open then waits for nobody.
///
/// Threads  One caller. Memory: in place. Time: constant a call.
/// Units    Times are ns of the clock that pairs: the host's, the bus's, PTP's.
/// Errors   None; a clock that was set back is told.
class TimeNumbering {
 public:
  struct Number {
    std::uint64_t number = 0;  // one that has gone out: too late
    bool clock_set_back = false;
  };

  explicit TimeNumbering(const SyncOptions& options) noexcept
      : mode_(options.mode), interval_(options.interval), tolerance_(options.tolerance) {}

  /// Middle of the exposure on the clock that pairs. The bus's wraps: of the two unwrapped by their
  /// cameras' drivers that nearest to the newest set's is meant.
  [[nodiscard]] std::int64_t time_of(const SyncFrame& frame, const OpenSets& sets) const noexcept;
  /// The number of the open set that it fits into, or a new one in the order of time. Flushes the
  /// sets where the clock was set back.
  [[nodiscard]] Number number_of(std::int64_t time, OpenSets* sets) noexcept;

 private:
  [[nodiscard]] bool ran_back(std::int64_t time, const OpenSets& sets) noexcept;
  [[nodiscard]] std::uint64_t place(std::int64_t time, const OpenSets& sets) noexcept;

  SyncMode mode_;
  Duration interval_, tolerance_;
  int back_ = 0;            // frames in a row whose common clock has run back
  bool new_clock_ = false;  // … and was set: the next frame begins a new count of time
};

}  // namespace vergence
