// Drives of the mock with faults, as the table of docs/benchmarks.md:
//   fault_injection_bench [single | long | pairs | random] [COUNT [FIRST] | part of a name]
// The first 20 of `random`, all of the others, unless COUNT says how many, from FIRST (1) on.
// Ends with 1 where an `ok` pose was wrong, a session is not whole, the program failed, did not say
// it or is not usable any more, and with 2 where there is nothing to drive or to judge by.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include <fmt/format.h>

#include "tests/system/faults/fault_drive.hpp"

int main(int argc, char** argv) {
  using namespace vergence::test;
  const std::string what = argc > 1 ? argv[1] : "single";
  const bool counted =
      argc > 2 && std::string_view(argv[2]).find_first_not_of("0123456789") == std::string::npos;
  const std::string filter = argc > 2 && !counted ? argv[2] : "";
  const auto number = [&](int at, std::size_t otherwise) -> std::size_t {
    return counted && argc > at ? std::strtoull(argv[at], nullptr, 10) : otherwise;
  };
  const std::size_t first = std::max<std::size_t>(1, number(3, 1));
  std::vector<FaultCase> cases;
  if (what == "random") {
    for (std::size_t i = 0; i < number(2, 20); ++i) cases.push_back(random_faults(first + i));
  } else {
    cases = what == "pairs" ? fault_pairs() : what == "long" ? long_faults() : single_faults();
    cases.erase(cases.begin(), cases.begin() + std::ptrdiff_t(std::min(first - 1, cases.size())));
    cases.resize(std::min(number(2, cases.size()), cases.size()));
    std::erase_if(cases, [&](const FaultCase& c) { return c.name.find(filter) == c.name.npos; });
  }
  if (cases.empty() ||
      (what != "single" && what != "long" && what != "pairs" && what != "random")) {
    fmt::print(stderr, "fault_injection_bench: no such drives\n");
    return 2;
  }
  const Untouched untouched = untouched_drive();
  if (!untouched.unfit.empty()) {
    fmt::print(stderr, "fault_injection_bench: nothing can be judged by {}\n", untouched.unfit);
    return 2;
  }
  fmt::print("{}", fault_table_head());
  int bad = 0, unusable = 0;
  for (const FaultCase& c : cases) {
    const auto [drive, result] = drive_until_recovered(c, untouched.normal);
    fmt::print("{}", fault_table_line(c, drive, result));
    std::fflush(stdout);
    const std::string missing = unsaid(c, drive, untouched.drive);
    if (!missing.empty()) fmt::print("not said: {}\n", missing);
    bad += is_bad(drive, result) || !missing.empty() ? 1 : 0;
    unusable += result.recovery_s ? 0 : 1;
  }
  fmt::print(
      "\n{} of {} with a wrong `ok`, an `ok` at a time without truth, an exit that is not 0 or "
      "without a whole session, or not said, {} not usable any more within a minute\n",
      bad, cases.size(), unusable);
  return bad + unusable > 0 ? 1 : 0;
}
