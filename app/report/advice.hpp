#pragma once
#include <span>
#include <string_view>

namespace vergence::app::report {

/// What the word of a pose's reason, or the kind of an event of a frame that was skipped, asks of
/// the user.
struct Advice {
  std::string_view word;  // of poses.csv or events.jsonl
  const char* sentence;
};

/// Reasons of poses.csv.
[[nodiscard]] std::span<const Advice> pose_advice() noexcept;
/// Kinds of events.jsonl: frames of a recording that were not read.
[[nodiscard]] std::span<const Advice> skip_advice() noexcept;
/// Empty: nothing is known of that word.
[[nodiscard]] std::string_view advice_for(std::string_view word) noexcept;

}  // namespace vergence::app::report
