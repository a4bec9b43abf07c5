#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/sync/sync_types.hpp"

namespace vergence {

/// Pairing data of an image besides its slot.
struct SetImage {
  MappedStamp middle{};
  std::int64_t time = 0;  // ns, of the clock that pairs, where stamps do: middle of the exposure
  DeviceStamp edge{};     // of the pulse by its source's clock, as this camera's stamp has it
  Duration gate{};        // |true edge − edge| is below this
  Duration exposure{};
  bool suspect = false;  // perhaps of an earlier pulse
};

/// A set that still waits for images.
struct OpenSet {
  bool used = false;
  bool contradicted = false;  // its pulse's report does not agree with an image's stamp
  SyncedSet set{};
  std::array<SetImage, kMaxCameras> images{};
  HostStamp first{};  // arrival of its first image

  /// The first camera that is there. Precondition: one is.
  [[nodiscard]] std::size_t base() const noexcept {
    std::size_t first_camera = 0;
    while (first_camera + 1 < set.present.size() && !set.present[first_camera]) ++first_camera;
    return first_camera;
  }
};

/// The sets of a rig that wait for images, and which images those had that have gone out.
///
/// Sets go out in the order of their numbers, each once: what is at or below the last number that
/// went out comes too late.
///
/// Ownership  Slots in a set are whoever's the RigSynchronizer says; here they are numbers.
/// Threads    One caller. Memory: fixed, kOpen sets and one more. Time: constant a call.
/// Errors     None.
class OpenSets {
 public:
  static constexpr std::size_t kOpen =
      4;  // pulses waiting at most: bounds the latency and the slots held
  static constexpr std::size_t kHistory =
      64;  // sets remembered, to tell a duplicate from a late frame
  /// One more than kOpen: the frame that pushes the oldest out.
  using Slots = std::array<OpenSet, kOpen + 1>;

  [[nodiscard]] OpenSet* find(std::uint64_t number) noexcept;
  [[nodiscard]] const OpenSet* find(std::uint64_t number) const noexcept;
  /// The one with the least number; null: none is open.
  [[nodiscard]] OpenSet* oldest() noexcept;
  /// Those with `used`, in no order.
  [[nodiscard]] const Slots& slots() const noexcept { return slots_; }
  [[nodiscard]] bool empty() const noexcept { return count_ == 0; }
  /// There is one more than may wait: the oldest has to go out.
  [[nodiscard]] bool crowded() const noexcept { return count_ > kOpen; }

  /// A new set. Precondition: find(number) == nullptr, !is_out(number), !crowded().
  OpenSet& open(std::uint64_t number, HostStamp first) noexcept;
  /// The set goes out. Precondition: it is oldest(), and an image is in it.
  void close(OpenSet* open) noexcept;

  /// A set has gone out.
  [[nodiscard]] bool any_out() const noexcept { return any_out_; }
  /// The number of the newest that went out, and SetImage::time of its base. Precondition:
  /// any_out().
  [[nodiscard]] std::uint64_t last_out() const noexcept { return last_out_; }
  [[nodiscard]] std::int64_t last_time() const noexcept { return last_time_; }
  /// A set of this number, or one after it, has gone out.
  [[nodiscard]] bool is_out(std::uint64_t number) const noexcept {
    return any_out_ && number <= last_out_;
  }
  /// The set of this number went out with this camera's image, no more than kHistory sets ago.
  [[nodiscard]] bool went_out_with(std::uint64_t number, std::size_t camera) const noexcept;

  /// The least number above all that are open or have gone out.
  [[nodiscard]] std::uint64_t first_free() const noexcept;
  /// From now on no set waits that has been open until now.
  void flush() noexcept { flushed_ = first_free(); }
  /// Every set below waits for nobody.
  [[nodiscard]] std::uint64_t flushed_below() const noexcept { return flushed_; }

  /// Suspect images of this camera stay suspect: their sets are contradicted.
  void contradict_suspect(std::size_t camera) noexcept;

 private:
  struct Gone {
    std::uint64_t number = 0;
    std::array<bool, kMaxCameras> present{};
    bool used = false;
  };

  Slots slots_{};
  std::size_t count_ = 0;
  std::array<Gone, kHistory> history_{};
  bool any_out_ = false;
  std::uint64_t last_out_ = 0;
  std::int64_t last_time_ = 0;
  std::uint64_t flushed_ = 0;
};

}  // namespace vergence
