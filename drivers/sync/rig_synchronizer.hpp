#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/memory/frame_pool.hpp"
#include "core/types/calibration.hpp"
#include "core/types/rig_frame.hpp"
#include "drivers/sync/clock_mapper.hpp"

namespace vergence {

/// By what images are paired.
enum class SyncMode : std::uint8_t {
  counter,   // exposure n of every camera belongs to pulse n
  software,  // what was exposed within `tolerance` belongs together: nothing makes the cameras expose at once
};

struct SyncOptions {
  int cameras = 2;                              // 1 … kMaxCameras
  Duration interval{};                          // between two pulses, > 0
  Duration hold = Duration::milliseconds(100);  // an incomplete set waits so long, by the arrivals of others, for its missing images
  SyncMode mode = SyncMode::counter;
  Duration tolerance = Duration::milliseconds(2);  // software: between the middles of a set's exposures
  /// counter: the pulses may have begun before the cameras, so each camera's first exposure is given its pulse by its stamp; and again
  /// after kUnproven unproven sets in a row.
  bool align_start = false;
  /// Nothing wrong: nullptr; else a sentence.
  [[nodiscard]] const char* validate() const noexcept;
};

/// One camera's frame on its way into a set.
struct SyncFrame {
  int camera = 0;
  FrameSlot slot = 0;
  std::uint64_t counter = 0;  // of Frame
  MappedStamp middle{};       // of the exposure, host time
  HostStamp arrival{};
};

/// How sure it is that a set's images were exposed together.
enum class SyncProof : std::uint8_t {
  counted,   // paired by counter, and the stamps agree within half an interval (also: one image only)
  unproven,  // paired by counter, and the stamps do not agree: a pulse was missed, or a clock is wrong
  by_time,   // paired by stamp
};
[[nodiscard]] const char* to_string(SyncProof) noexcept;

/// The images of one pulse.
///
/// stamp   Camera 0's mid-exposure; without camera 0 the first one's that is there. `spread`: the largest distance of another's to it.
struct SyncedSet {
  std::uint64_t number = 0;  // of the pulse
  HostStamp stamp{};
  Duration error{};
  Duration spread{};
  HostStamp arrival{};  // of the last image
  std::array<bool, kMaxCameras> present{};
  std::array<FrameSlot, kMaxCameras> slots{};
  bool complete = false;
  SyncProof proof = SyncProof::counted;
};

enum class SyncVerdict : std::uint8_t {
  taken,      // the slot comes out with its set
  duplicate,  // that camera has given this pulse already; the slot stays the caller's
  late,       // its set has gone out without it; the slot stays the caller's
};

/// Counters; all only grow.
struct SyncCounters {
  std::uint64_t complete = 0, incomplete = 0;       // sets that went out
  std::uint64_t missed = 0;                         // pulses no camera gave an image of
  std::array<std::uint64_t, kMaxCameras> lost{};    // sets without that camera while it was there
  std::array<std::uint64_t, kMaxCameras> absent{};  // sets without that camera while it was gone
  std::array<std::uint64_t, kMaxCameras> duplicate{};
  std::array<std::uint64_t, kMaxCameras> late{};
  std::uint64_t pushed_out = 0;  // of the incomplete: before their time, because more pulses were open than kOpen
  std::uint64_t unproven = 0;    // sets whose stamps do not agree
  std::uint64_t realigned = 0;   // times that all cameras' pulses were found by their stamps again
};

/// Pairs the frames of a rig: by their counters, or by their stamps.
///
/// A set goes out as soon as every camera that is there has given its image, or has given a later one (its image is lost), or an
/// image of any camera has arrived `hold` after the set's first one. Sets go out in order of their numbers, each once.
/// Determined by what is offered and in which order; no clock is read.
/// Ownership  A slot that is `taken` comes out of next() in exactly one set; then it is the caller's again.
/// Threads    One caller. Memory: fixed, kOpen pulses. Time: constant a call.
/// Errors     Nothing throws. What cannot be paired is told by the verdict and counted.
class RigSynchronizer {
 public:
  static constexpr std::size_t kOpen = 4;      // pulses waiting at most: bounds the latency and the slots held
  static constexpr std::size_t kHistory = 64;  // sets remembered, to tell a duplicate from a late frame
  static constexpr int kUnproven = 10;         // in a row: the pulses were not found rightly

  /// Precondition: options.validate() == nullptr.
  explicit RigSynchronizer(const SyncOptions& options) noexcept;

  /// Precondition: next() was called until false since the last offer().
  [[nodiscard]] SyncVerdict offer(const SyncFrame& frame) noexcept;
  /// The next set that is ready. Call until false.
  [[nodiscard]] bool next(SyncedSet* set) noexcept;

  /// That exposure of a camera gave no image that could be used: nobody waits for it. Else as offer(); only where counters pair.
  void lost(int camera, std::uint64_t counter) noexcept;
  /// A camera has gone: nobody waits for it.
  void absent(int camera) noexcept;
  /// It has come back and counts from 0 again: its first frame joins the pulse nearest in time, the others follow by counter.
  void restarted(int camera) noexcept;
  /// No more frames will come: everything open goes out by next().
  void finish() noexcept { finishing_ = true; }

  [[nodiscard]] const SyncCounters& counters() const noexcept { return counters_; }

 private:
  struct Source {
    bool here = true;
    bool align = false;     // the next frame's number is found by time
    std::int64_t base = 0;  // number − counter
    bool any = false;
    std::uint64_t newest = 0;  // number
  };
  struct Open {
    bool used = false;
    SyncedSet set{};
    std::array<MappedStamp, kMaxCameras> middles{};
    HostStamp first{};
  };
  struct Gone {
    std::uint64_t number = 0;
    std::array<bool, kMaxCameras> present{};
    bool used = false;
  };

  [[nodiscard]] std::uint64_t number_of(const SyncFrame& frame) noexcept;
  [[nodiscard]] std::uint64_t number_by_time(const SyncFrame& frame) noexcept;
  void prove(SyncedSet* set) noexcept;
  [[nodiscard]] Open* oldest() noexcept;
  [[nodiscard]] Open* find(std::uint64_t number) noexcept;
  [[nodiscard]] bool ready(const Open& open) const noexcept;
  void emit(Open* open, SyncedSet* set) noexcept;

  SyncOptions options_;
  std::array<Source, kMaxCameras> sources_{};
  std::array<Open, kOpen + 1> open_{};  // one more: the frame that pushes the oldest out
  std::size_t open_count_ = 0;
  std::array<Gone, kHistory> history_{};
  bool any_out_ = false;
  std::uint64_t last_out_ = 0;
  HostStamp last_middle_{};  // of the set that went out last
  int unproven_run_ = 0;
  bool timed_ = false;  // a number and its time, to find the pulse of a camera that came back
  std::uint64_t timed_number_ = 0;
  HostStamp timed_middle_{};
  HostStamp now_{};  // newest arrival
  bool finishing_ = false;
  SyncCounters counters_{};
};

}  // namespace vergence
