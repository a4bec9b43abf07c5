#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/sync/sync_types.hpp"

namespace vergence {

/// Pairing data of an image, without its slot.
struct SetImage {
  MappedStamp middle{};
  /// Middle of the exposure in ns on the pairing clock, in modes that pair by stamps.
  std::int64_t time = 0;
  /// Edge of the pulse on its source's clock, according to this camera's stamp.
  DeviceStamp edge{};
  /// Upper bound of
  /// true edge − edge
  /// .
  Duration gate{};
  Duration exposure{};
  /// True if the image may belong to an earlier pulse.
  bool suspect = false;
};

/// Set that waits for images.
struct OpenSet {
  bool used = false;
  /// True if its pulse's report disagrees with an image's stamp.
  bool contradicted = false;
  SyncedSet set{};
  std::array<SetImage, kMaxCameras> images{};
  /// Arrival of its first image.
  HostStamp first{};

  /// First camera that is present. Precondition: at least one is.
  [[nodiscard]] std::size_t base() const noexcept {
    std::size_t first_camera = 0;
    while (first_camera + 1 < set.present.size() && !set.present[first_camera]) ++first_camera;
    return first_camera;
  }
};

/// Sets that wait for images, and a history of the sets that were output.
///
/// Sets are output in order of their numbers, each once; an image at or below the last number is
/// too late. Slots are only numbers here; RigSynchronizer defines their owner. Not thread-safe.
/// Fixed memory. Constant time per call.
class OpenSets {
 public:
  /// Maximum number of waiting sets; it bounds the latency and the slots held.
  static constexpr std::size_t kOpen = 4;
  /// Number of sets remembered to distinguish a duplicate from a late frame.
  static constexpr std::size_t kHistory = 64;
  /// One more than kOpen for the frame that pushes the oldest out.
  using Slots = std::array<OpenSet, kOpen + 1>;

  [[nodiscard]] OpenSet* find(std::uint64_t number) noexcept;
  [[nodiscard]] const OpenSet* find(std::uint64_t number) const noexcept;
  /// Set with the smallest number; null if none is open.
  [[nodiscard]] OpenSet* oldest() noexcept;
  /// All slots in no order; those with `used` are open.
  [[nodiscard]] const Slots& slots() const noexcept { return slots_; }
  [[nodiscard]] bool empty() const noexcept { return count_ == 0; }
  /// True if more sets are open than may wait, so that the oldest must be output.
  [[nodiscard]] bool crowded() const noexcept { return count_ > kOpen; }

  /// Opens a new set. Precondition: find(number) == nullptr, !is_out(number), !crowded().
  OpenSet& open(std::uint64_t number, HostStamp first) noexcept;
  /// Closes the set that is output. Precondition: it is oldest() and has an image.
  void close(OpenSet* open) noexcept;

  /// True once a set was output.
  [[nodiscard]] bool any_out() const noexcept { return any_out_; }
  /// Number of the newest output set, and SetImage::time of its base. Precondition: any_out().
  [[nodiscard]] std::uint64_t last_out() const noexcept { return last_out_; }
  [[nodiscard]] std::int64_t last_time() const noexcept { return last_time_; }
  /// True if a set of this or a greater number was output.
  [[nodiscard]] bool is_out(std::uint64_t number) const noexcept {
    return any_out_ && number <= last_out_;
  }
  /// True if one of the last kHistory output sets has this number and an image of this camera.
  [[nodiscard]] bool went_out_with(std::uint64_t number, std::size_t camera) const noexcept;

  /// Smallest number above all open and output sets.
  [[nodiscard]] std::uint64_t first_free() const noexcept;
  /// Ends the waiting of all sets opened so far.
  void flush() noexcept { flushed_ = first_free(); }
  /// Sets below this number do not wait for images.
  [[nodiscard]] std::uint64_t flushed_below() const noexcept { return flushed_; }

  /// Marks the sets of this camera's suspect images as contradicted.
  void contradict_suspect(std::size_t camera) noexcept;

 private:
  struct OutputSet {
    std::uint64_t number = 0;
    std::array<bool, kMaxCameras> present{};
    bool used = false;
  };

  Slots slots_{};
  std::size_t count_ = 0;
  std::array<OutputSet, kHistory> history_{};
  bool any_out_ = false;
  std::uint64_t last_out_ = 0;
  std::int64_t last_time_ = 0;
  std::uint64_t flushed_ = 0;
};

}  // namespace vergence
