#pragma once
#include <map>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "tests/support/integrity.hpp"

/// Drives of the mock with faults, by the built program, judged against the truth.
namespace vergence::test {

/// Faults of a drive.
struct FaultCase {
  std::string name;
  /// Faults as `--fault` takes them.
  std::vector<std::string> faults{};
  /// Start of the first fault and end of the last one, in s of the drive.
  double from_s = 0, until_s = 0;
  /// Expected evidence of the faults: kinds of events, reasons of frames, counters of summary.json
  /// ("/devices/clock_resets") that are not 0, or lines on the terminal. None: poses that are not
  /// those of the untouched drive.
  std::vector<std::string> said{};
  /// Kinds of events that must not occur.
  std::vector<std::string> unsaid{};
  /// Further arguments.
  std::string more{};
  /// Faults below the program, in real time (faulty_system.c).
  std::string system{};
  double duration_s = 20;
  double recovers_within_s = 0;
};

/// A drive as its session has it.
struct FaultDrive {
  /// Exit code of the program.
  int code = -1;
  std::string err{};
  /// Every file of the session is there and complete, and poses to the end of the drive with the
  /// truth beside them.
  bool whole = false;
  std::vector<EvaluatedPose> poses{};
  /// Time of each pose since the start.
  std::vector<double> at_s{};
  app::Trajectory truth{};
  /// Number of events by kind.
  std::map<std::string, int> events{};
  /// Number of frames that are not `ok` after the fault's start, by reason.
  std::map<std::string, int> reasons{};
  /// Content of summary.json; null if there is none.
  nlohmann::json summary{};
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
