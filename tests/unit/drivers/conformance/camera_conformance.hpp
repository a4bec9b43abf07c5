#pragma once

#include "drivers/camera.hpp"

/// The one suite that every camera driver passes: drivers/camera.hpp as a shadow model, driven by
/// random rules with a seed.
///
/// A driver joins with a file that defines make_conformance_rig(), and vergence_conformance(NAME
/// SOURCES that_file DEPENDS …) in this folder's CMakeLists.txt, which makes the program
/// `conformance_NAME` and the ctest `conformance.NAME`.
/// Environment  VERGENCE_CONFORMANCE_SEEDS (how many, 3), VERGENCE_CONFORMANCE_STEPS (rules each,
///              60): more of them for a night's run.
namespace vergence::test {

/// One camera on its rig, as the suite sees it.
///
/// Threads  All calls from the suite's main thread; content_fits() from the consumer's.
class ConformanceRig {
 public:
  virtual ~ConformanceRig() = default;

  /// Opened, not configured. Lives as long as the rig.
  [[nodiscard]] virtual CameraDevice& camera() = 0;
  /// Supported configurations, at least one: small pictures at a high rate, so that the suite is
  /// short. With CameraTrigger::software the suite triggers. With CameraTrigger::hardware the rig
  /// pulses by itself while the camera streams.
  [[nodiscard]] virtual std::vector<CameraConfiguration> possible() = 0;
  /// Configurations to refuse in addition to the suite's own: a size, a format, an option
  /// that it does not have.
  [[nodiscard]] virtual std::vector<CameraConfiguration> impossible() { return {}; }
  /// After a start() that was ok.
  virtual void started() {}

  /// Cable out. False: this rig cannot.
  [[nodiscard]] virtual bool unplug() { return false; }
  virtual void replug() {}
  /// After unplug() the camera must be disconnected within this, after replug() a start() must
  /// succeed within it.
  [[nodiscard]] virtual Duration disconnected_within() const { return Duration::seconds(10); }

  /// The next exposures never arrive. False: this rig cannot.
  [[nodiscard]] virtual bool lose(int exposures) {
    (void)exposures;
    return false;
  }
  /// Returns true if these are the pixels of that frame.
  [[nodiscard]] virtual bool content_fits(const Frame& frame, ImageView image) {
    (void)frame, (void)image;
    return true;
  }
  /// Two exposures that the camera takes as they are while it streams in possible().front(). Empty:
  /// this camera cannot be asked.
  [[nodiscard]] virtual std::vector<ExposureSetting> exposures() { return {}; }
  /// False: counters go on over a stop (a rig whose pulses go on).
  [[nodiscard]] virtual bool counts_from_start() const { return true; }
};

/// Null: it is in the rig's kernel only, and the suite skips outside. Throws std::runtime_error
/// where the camera does not open.
[[nodiscard]] std::unique_ptr<ConformanceRig> make_conformance_rig(std::uint64_t seed);

}  // namespace vergence::test
