#pragma once
#include <cstdint>
#include <string>
#include <utility>
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

/// Collects what speaks against a drive, and what to do; the grade is that of the worst.
class Findings {
 public:
  void find(Grade grade, std::string reason);
  void advise(std::string sentence) { verdict_.advice.push_back(std::move(sentence)); }
  /// No pose can be relied on; the first reason stands.
  void give_up(const std::string& reason, const std::string& advice);
  /// The worst reasons first, equal ones as they were found. The sentence is still to be made.
  [[nodiscard]] Verdict verdict() const;

 private:
  struct Found {
    Grade grade;
    std::string reason;
  };
  std::vector<Found> found_;
  Verdict verdict_;
};

}  // namespace vergence::app::report
