#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "app/report/analysis.hpp"
#include "app/report/session.hpp"

namespace vergence::app::report {

enum class Grade : std::uint8_t { good, care, bad };
[[nodiscard]] const char* to_words(Grade) noexcept;  // "Good", "Usable with care", "Do not use"

/// What a field engineer reads first. Every reason that moved the grade is there, the worst first;
/// a session without any is good.
struct Verdict {
  Grade grade = Grade::good;
  std::string sentence{};              // why, in one sentence
  std::vector<std::string> reasons{};  // half sentences
  std::vector<std::string> advice{};   // what to do next, whole sentences
  bool usable = true;                  // false: no pose can be relied on, exit code 1
  std::string main_reason{};           // then: why, with counts, and what to do
};

[[nodiscard]] Verdict judge(const Session& session, const Analysis& analysis);

}  // namespace vergence::app::report
