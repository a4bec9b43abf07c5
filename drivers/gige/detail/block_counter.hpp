#pragma once
#include <cstdint>
#include <optional>

namespace vergence::gige {

/// Block ids of a stream, 16 or 64 bit, into exposures since its first frame.
///
/// 16-bit ids are never 0: after 65535 comes 1. A 64-bit id shows itself by its size; until then
/// both count alike.
/// Threads  One caller. Memory: fixed.
class BlockCounter {
 public:
  struct Step {
    std::uint64_t counter = 0;
    std::uint64_t missing = 0;  // exposures between the newest before and this one
  };
  /// Nothing: an id of 0, or one that is not newer than the newest (late or sent twice).
  [[nodiscard]] std::optional<Step> next(std::uint64_t id) noexcept {
    constexpr std::int64_t kIds = 65535;
    if (id == 0) return std::nullopt;
    if (!any_) {
      any_ = true;
      wide_ = id > static_cast<std::uint64_t>(kIds);
      newest_ = id;
      return Step{0, 0};
    }
    wide_ = wide_ || id > static_cast<std::uint64_t>(kIds);
    auto ahead = static_cast<std::int64_t>(id - newest_);
    if (!wide_) {  // the nearest of the ids that look like this one
      ahead %= kIds;
      if (ahead > kIds / 2) ahead -= kIds;
      if (ahead < -(kIds / 2)) ahead += kIds;
    }
    if (ahead <= 0) return std::nullopt;
    newest_ = id;
    counter_ += static_cast<std::uint64_t>(ahead);
    return Step{counter_, static_cast<std::uint64_t>(ahead) - 1};
  }
  void restart() noexcept { *this = BlockCounter{}; }

 private:
  bool any_ = false, wide_ = false;
  std::uint64_t newest_ = 0, counter_ = 0;
};

}  // namespace vergence::gige
