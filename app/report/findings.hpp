#pragma once
#include <string>
#include <utility>
#include <vector>

#include "app/report/verdict.hpp"

namespace vergence::app::report {

/// Collects what speaks against a drive, and what to do; the grade is that of the worst.
///
/// Threads  One caller. Memory: that of the sentences. Errors: none.
///
///     Findings findings;
///     findings.find(Grade::care, "the drive is too short to measure its drift");
///     const Verdict verdict = findings.verdict();
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
