#pragma once
#include <sys/types.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace vergence::test {

/// True inside the rig's kernel; there, a device that is missing is a failure and no reason to
/// skip.
[[nodiscard]] bool inside_rig();
inline constexpr const char* kNeedsRig = "needs the rig's kernel: run it by ctest -L rig";

/// One emulator of tests/rigs, running beside the test inside the rig's kernel.
///
/// Ownership  The process is ended by finish() or the destructor.
/// Threads    One.
/// Errors     The constructor throws std::runtime_error when the program is missing or its devices
///            are not ready in ten seconds.
class Emulator {
 public:
  /// `program`: sim_1394, sim_usb_iidc, sim_ftdi; looked for in the folder VERGENCE_RIGS names.
  /// Returns when its devices are there.
  explicit Emulator(const std::string& program, std::vector<std::string> arguments = {});
  ~Emulator();
  Emulator(const Emulator&) = delete;
  Emulator& operator=(const Emulator&) = delete;

  /// One line to its standard input: "drop 0 3". Takes effect within a millisecond or two of the
  /// emulator's time.
  void command(std::string_view line);
  /// Ends it. → all it printed: what each camera exposed and sent.
  [[nodiscard]] std::string finish();

 private:
  pid_t pid_ = -1;
  /// Standard input of the emulator.
  int commands_ = -1;
  /// Standard output of the emulator.
  int report_ = -1;
};

/// The number after `word` in the report's line about a camera: count_of(report, 1, "exposed"). −1:
/// not there.
[[nodiscard]] std::int64_t count_of(const std::string& report, int camera, std::string_view word);

}  // namespace vergence::test
