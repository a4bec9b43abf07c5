#pragma once
#include <chrono>
#include <thread>

namespace vergence::test {

/// Looks every 10 ms whether it has become true. False: not within so many seconds.
template <class Condition>
[[nodiscard]] bool within(int seconds, const Condition& condition) {
  for (int i = 0; i < 100 * seconds; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

}  // namespace vergence::test
