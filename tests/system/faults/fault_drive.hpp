#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/integrity.hpp"

/// Drives of the mock with faults, by the built program, judged against the truth.
namespace vergence::test {

/// Faults of a drive.
struct FaultCase {
  std::string name;
  std::vector<std::string> faults{};  // as --fault takes them
  double from_s = 0, until_s = 0;     // of the drive: first fault's start, last one's end
  /// Expected evidence of the faults: kinds of events, reasons of frames, counters of summary.json
  /// ("/devices/clock_resets") that are not 0, or lines on the terminal. None: poses that are not
  /// those of the untouched drive.
  std::vector<std::string> said{};
  /// Kinds of events that must not occur.
  std::vector<std::string> unsaid{};
  std::string more{};    // further arguments
  std::string system{};  // what goes wrong below the program, in real time (faulty_system.c)
  double duration_s = 20;
  double recovers_within_s = 0;
};

/// A drive as its session has it.
struct FaultDrive {
  int code = -1;  // the program's
  std::string err{};
  /// summary.json and report.html are there, and poses to the end of the drive with the truth
  /// beside them.
  bool whole = false;
  std::vector<EvaluatedPose> poses{};
  std::vector<double> at_s{};  // of each pose, since the drive's start
  app::Trajectory truth{};
  std::map<std::string, int> events{};   // by kind
  std::map<std::string, int> reasons{};  // frames from the fault's start on that are not `ok`
  std::string summary{};                 // summary.json
};

struct FaultResult {
  Integrity integrity{};
  /// From the last fault's end to the first of kIntegrityFrames `ok` poses in a row; none: there
  /// were none.
  std::optional<double> recovery_s{};
  /// Greatest error over kIntegrityFrames `ok` poses after recovery, times the normal one.
  double error_after = 0;
};

/// mock_board.yaml with a quarter of the pixels: every pair verified, or not used.
[[nodiscard]] FaultDrive drive_with_faults(const FaultCase& c);

/// The drive without any fault, as long as the longest of the others, and what is normal by it.
struct Untouched {
  FaultDrive drive{};
  NormalError normal{};
  /// Why nothing can be judged by it: it is not as good as it was when this was written. Empty: it
  /// is.
  std::string unfit{};
};
[[nodiscard]] Untouched untouched_drive();
/// Returns expected evidence that is missing; empty if none.
[[nodiscard]] std::string unsaid(const FaultCase& c, const FaultDrive& drive,
                                 const FaultDrive& untouched);
/// Nothing of it may be: a wrong `ok`, one at a time at which there is no truth, a session that is
/// not whole, a program that failed.
[[nodiscard]] bool is_bad(const FaultDrive& drive, const FaultResult& result);

[[nodiscard]] FaultResult evaluate(const FaultCase& c, const FaultDrive& drive,
                                   const NormalError& normal);
struct EvaluatedDrive {
  FaultDrive drive{};
  FaultResult result{};
};
/// The case's drive; where that is not bad and ends before the last fault is over with, one of a
/// minute.
[[nodiscard]] EvaluatedDrive drive_until_recovered(FaultCase c, const NormalError& normal);

/// The faults of docs/simulated_rig.md, one at a time; begin at 9 s, when the calibration is
/// confirmed.
[[nodiscard]] const std::vector<FaultCase>& single_faults();
/// Every two of them at once, the second a second later.
[[nodiscard]] std::vector<FaultCase> fault_pairs();
/// One to four of them at random times between 1 and 14 s; the same for the same seed.
[[nodiscard]] FaultCase random_faults(std::uint64_t seed);
/// A stand of ten minutes in virtual time; a disk that stalls and a host's clock that is set, in
/// real time: of `system` the times are the process's, some seconds ahead of the drive's.
[[nodiscard]] const std::vector<FaultCase>& long_faults();

/// Head and line of the table of docs/benchmarks.md.
[[nodiscard]] std::string fault_table_head();
[[nodiscard]] std::string fault_table_line(const FaultCase& c, const FaultDrive& drive,
                                           const FaultResult& result);

}  // namespace vergence::test
