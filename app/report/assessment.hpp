#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
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
[[nodiscard]] const char* to_words(Grade) noexcept;  // "Good", "Usable with care", "Do not use"

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

/// Collects what speaks against a drive, and what to do; the grade is that of the worst.
class Findings {
 public:
  void find(Grade grade, std::string reason);
  void advise(std::string message) { assessment_.advice.push_back(std::move(message)); }
  /// No pose can be relied on; the first reason stands.
  void give_up(const std::string& reason, const std::string& advice);
  /// The worst reasons first, equal ones as they were found. The message is still to be made.
  [[nodiscard]] Assessment assessment() const;

 private:
  struct Found {
    Grade grade;
    std::string reason;
  };
  std::vector<Found> found_;
  Assessment assessment_;
};

}  // namespace vergence::app::report
