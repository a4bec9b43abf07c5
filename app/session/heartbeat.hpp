#pragma once
#include <cstdint>

namespace vergence::app {

/// Tells a loop that has nothing to do from one that hangs. It is alive when it handles items, and
/// also when it waits for the next one while the devices' thread goes round: the cameras may be
/// gone and the drive go on. A thread that a device holds up does not go round.
///
/// Threads  One, which looks now and then.
class Heartbeat {
 public:
  /// → a number that is another than at the last look if the loop has been alive since.
  /// `rounds`: of the devices' thread; always the same: nobody knows, and only items count.
  [[nodiscard]] std::uint64_t beats(std::uint64_t items, bool waiting,
                                    std::uint64_t rounds) noexcept {
    if (waiting && rounds != rounds_) ++idle_;
    rounds_ = rounds;
    return items + idle_;
  }

 private:
  std::uint64_t rounds_ = 0, idle_ = 0;
};

}  // namespace vergence::app
