#pragma once
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "app/config/configuration.hpp"
#include "app/devices/drive_devices.hpp"
#include "app/runtime/signals.hpp"
#include "core/types/image.hpp"

namespace vergence::app {

struct ImageStatistics {
  /// Mean grey level.
  double mean = 0;
  /// Standard deviation of the grey levels.
  double contrast = 0;
  /// Share of pixels at 254 and above.
  double saturated = 0;
  /// Share of pixels at 4 and below.
  double dark = 0;
  /// Mean squared gradient (central differences), in (grey levels / px)²; it decreases with blur
  /// and increases with noise.
  double sharpness = 0;
};
/// Precondition: not empty. Images of one row or column have no sharpness.
[[nodiscard]] ImageStatistics image_statistics(const ImageView& image) noexcept;

/// Visible defect of an image.
struct ImageIssue {
  /// True if the images are unusable, false if they could be better.
  bool unusable = false;
  std::string message;
};

/// Evaluates the exposure of each image, and its sharpness relative to the sharpest.
[[nodiscard]] std::vector<ImageIssue> evaluate_images(std::span<const std::string> names,
                                                      std::span<const ImageStatistics> statistics);

/// True if all pixels of two images are equal, as from one camera that was opened twice. Flat
/// images (a lens cap) do not count.
[[nodiscard]] bool are_identical(const ImageView& a, const ImageView& b) noexcept;

/// Configuration for capturing images, which needs only the cameras and their trigger. The INS may
/// be absent, so it is removed unless its SyncOut makes the pulses.
[[nodiscard]] Configuration capture_configuration(const Configuration& configuration);

/// Names of the cameras for files and messages: those of the configuration (letters, digits, `_`
/// and `-`, everything else becomes `_`), or `camera0` …; each is unique.
[[nodiscard]] std::vector<std::string> camera_names(const Configuration& configuration,
                                                    int cameras);

/// Synchronised set, valid while its images are.
struct CapturedSet {
  /// Counts from 0.
  int index = 0;
  Stamp stamp{};
  Duration stamp_error{}, spread{};
  SyncProof proof = SyncProof::counted;
  /// Images by camera.
  std::vector<ImageView> images;
};

/// Result of waiting for synchronised image sets.
struct CaptureResult {
  enum class End : std::uint8_t { done, timeout, interrupted } end = End::timeout;
  /// Complete sets that were delivered.
  int sets = 0;
  /// Images by camera, also those of incomplete sets.
  std::vector<std::uint64_t> delivered;
  /// Disconnected cameras at the end.
  std::vector<bool> disconnected;
};

struct CaptureOptions {
  int count = 1;
  /// Complete sets to skip first, because the first exposures after a start may have old settings.
  int skip = 0;
  /// Time limit for the first set, and between two sets.
  Duration limit = Duration::seconds(5);
};

/// Starts the devices, passes complete sets to `use` on the caller's thread, and stops the devices.
/// Uses only the pulses of the INS, if it makes them. Takes `limit` per set, plus starting and
/// stopping. Throws as start_acquisition() does (InputError), and what `use` throws.
[[nodiscard]] CaptureResult capture_sets(DriveDevices& devices, const CaptureOptions& options,
                                         const SignalGuard& signals,
                                         const std::function<void(const CapturedSet&)>& use);

}  // namespace vergence::app
