#pragma once

#include "app/report/analysis.hpp"

namespace vergence::app::report {

/// Returns the advice about frames with that reason; empty for Reason::none.
[[nodiscard]] const char* advice_for(Reason reason) noexcept;

enum class Grade : std::uint8_t { good, care, bad };
/// Text such as "Good", "Usable with care" or "Do not use".
[[nodiscard]] const char* spaced(Grade) noexcept;

/// Result shown first in the report, with all reasons for the grade, the worst first. A session
/// without a reason is good.
struct Assessment {
  Grade grade = Grade::good;
  /// Summary of the reasons.
  std::string message{};
  /// Message fragments.
  std::vector<std::string> reasons{};
  /// Complete messages about what to do next.
  std::vector<std::string> advice{};
  /// False if no pose is reliable (exit code 1).
  bool usable = true;
  /// If not usable, the reason with counts, and what to do.
  std::string main_reason{};
};

[[nodiscard]] Assessment assess(const Session& session, const Analysis& analysis);

}  // namespace vergence::app::report
