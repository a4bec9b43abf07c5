#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "drivers/serial/byte_line.hpp"

namespace vergence {

/// The conversation on a line on its way to an observer. What is said while a device is found and
/// set up comes before anybody can observe it: it is kept until then.
///
/// Threads  note(), opened(): of whoever uses the line. observe(), streaming(): the owner's, while
///          nobody does.
/// Memory   Grows until streaming(), to kMostBytes at most; none after it.
/// Full     What is said after kMostBytes of a set-up is not kept: whole() is false.
class LineLog {
 public:
  static constexpr std::size_t kMostBytes = 65536;

  void note(const LineEvent& event) noexcept;
  /// A line of that place was opened.
  void opened(const LinePlace& place, HostStamp now) noexcept;
  /// Who sees it from now on; what was kept is said first. Null: nobody.
  void observe(LineObserver* observer) noexcept;
  /// From now on nothing is kept.
  void streaming() noexcept;
  [[nodiscard]] bool whole() const noexcept { return whole_; }

 private:
  struct Kept {
    LineEvent event{};
    std::size_t from = 0, size = 0;  // in bytes_
  };
  void keep(const LineEvent& event) noexcept;

  std::atomic<LineObserver*> observer_{nullptr};
  bool keeps_ = true, whole_ = true;
  std::vector<Kept> kept_;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace vergence
