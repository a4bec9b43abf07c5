#pragma once
#include <string_view>

#include <opencv2/core.hpp>

#include "tests/support/recorded_sequence.hpp"

namespace vergence::bench {

/// Perturbation of a recorded drive. `image` changes the images of pair `at` (of `count`) in place;
/// `pairs` chooses the pairs of the drive, or which right image goes with which left one. Either
/// may be null. Deterministic: what looks random is drawn from a generator seeded with `at`.
struct IntegrityVariant {
  std::string_view name;
  void (*image)(cv::Mat* left, cv::Mat* right, std::size_t at, std::size_t count) = nullptr;
  void (*pairs)(std::vector<app::StereoPair>* pairs) = nullptr;
};

[[nodiscard]] std::span<const IntegrityVariant> integrity_variants();
/// Faults of time: images and pairs that come late, twice as late, or not at all.
[[nodiscard]] std::span<const IntegrityVariant> time_variants();
/// Scenes that are harder than the one recorded, and none of which is a fault of the rig.
[[nodiscard]] std::span<const IntegrityVariant> scene_variants();

/// The drive so spoilt, its changed images in `folder`.
[[nodiscard]] app::StereoSequence spoil(const test::RecordedSequence& drive,
                                        const IntegrityVariant& variant,
                                        const std::filesystem::path& folder);

}  // namespace vergence::bench
