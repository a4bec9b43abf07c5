#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/report/analysis.hpp"
#include "app/report/session.hpp"

namespace vergence::app::report {

/// Advice for a pose's reason or the kind of a skipped frame's event, addressed to
/// the user.
struct Advice {
  std::string_view word;  // of poses.csv or events.jsonl
  const char* message;
};

/// Reasons of poses.csv.
[[nodiscard]] std::span<const Advice> pose_advice() noexcept;
/// Kinds of events.jsonl: frames of a recording that were not read.
[[nodiscard]] std::span<const Advice> skip_advice() noexcept;
/// Empty: nothing is known of that word.
[[nodiscard]] std::string_view advice_for(std::string_view word) noexcept;

enum class Grade : std::uint8_t { good, care, bad };
[[nodiscard]] const char* spaced(Grade) noexcept;  // "Good", "Usable with care", "Do not use"

/// Result shown first in the report. Every reason that moved the grade is there, the worst first;
/// a session without any is good.
struct Assessment {
  Grade grade = Grade::good;
  std::string message{};               // why, in one message
  std::vector<std::string> reasons{};  // half messages
  std::vector<std::string> advice{};   // what to do next, whole messages
  bool usable = true;                  // false: no pose can be relied on, exit code 1
  std::string main_reason{};           // then: why, with counts, and what to do
};

[[nodiscard]] Assessment assess(const Session& session, const Analysis& analysis);

}  // namespace vergence::app::report
