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

/// A visible defect of an image.
struct ImageIssue {
  /// True if the images are unusable, false if they could be better.
  bool unusable = false;
  std::string message;
};

/// Exposure of each image, and sharpness of each relative to the sharpest.
[[nodiscard]] std::vector<ImageIssue> evaluate_images(std::span<const std::string> names,
                                                      std::span<const ImageStatistics> statistics);

/// Returns true if two images are the same pixel for pixel, as one camera's would be if it were
/// opened twice. Flat ones (a lens cap) are not called that.
[[nodiscard]] bool are_identical(const ImageView& a, const ImageView& b) noexcept;

/// The configuration of a capture, for which of the devices only the cameras and what triggers them
/// are used: images need no position and the INS may be elsewhere, so it is left out, unless its
/// SyncOut makes the pulses.
[[nodiscard]] Configuration capture_configuration(const Configuration& configuration);

/// Names of the cameras for files and messages: those of the configuration (letters, digits, `_`
/// and `-`, everything else becomes `_`), `camera0` … where there is none, each once.
[[nodiscard]] std::vector<std::string> camera_names(const Configuration& configuration,
                                                    int cameras);

/// One synchronised set, while its images are there.
struct CapturedSet {
  int index = 0;  // 0, 1, …
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
  int skip = 0;  // complete sets passed over first: the first exposures after a start may be
                 // another's, or dark
  /// Time limit for the first set, and between two sets.
  Duration limit = Duration::seconds(5);
};

/// Starts the devices and hands on complete sets. The devices are stopped when it returns.
///
/// Uses only the pulses of the INS, if it makes them.
/// Threads  `use` on the caller's. Time: `limit` a set, and what starting and stopping take.
///          Errors: InputError as start_acquisition(), and
/// what `use` throws.
[[nodiscard]] CaptureResult capture_sets(DriveDevices& devices, const CaptureOptions& options,
                                         const SignalGuard& signals,
                                         const std::function<void(const CapturedSet&)>& use);

}  // namespace vergence::app
