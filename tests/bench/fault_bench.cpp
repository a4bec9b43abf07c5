// Drives of the mock with faults, as the table of docs/faults.md:
//   fault_bench [single | long | pairs | random [COUNT [FIRST SEED]]] [part of a name]
// Ends with 1 where an `ok` pose was wrong or a session is not whole.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "tests/system/faults/fault_drive.hpp"

int main(int argc, char** argv) {
  using namespace vergence::test;
  const std::string what = argc > 1 ? argv[1] : "single";
  std::string filter;
  std::vector<FaultCase> cases;
  if (what == "random") {
    const std::uint64_t count = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 20,
                        first = argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 1;
    for (std::uint64_t i = 0; i < count; ++i) cases.push_back(random_faults(first + i));
  } else {
    cases = what == "pairs" ? fault_pairs() : what == "long" ? long_faults() : single_faults();
    if (argc > 2) filter = argv[2];
  }
  const FaultDrive untouched = drive_with_faults(no_fault());
  const NormalError normal = normal_error_there(untouched.poses, untouched.truth);
  fmt::print("{}", fault_table_head());
  int bad = 0;
  for (const FaultCase& c : cases) {
    if (c.name.find(filter) == std::string::npos) continue;
    const FaultDrive drive = drive_with_faults(c);
    const FaultResult result = judge(c, drive, normal);
    fmt::print("{}", fault_table_line(c, drive, result));
    std::fflush(stdout);
    bad += result.honesty.wrong > 0 || !drive.whole ? 1 : 0;
  }
  fmt::print("\n{} of {} with a wrong `ok` or without a whole session\n", bad, cases.size());
  return bad > 0 ? 1 : 0;
}
