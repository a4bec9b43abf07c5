#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/sync/counter_numbering.hpp"
#include "drivers/sync/master_pulses.hpp"
#include "drivers/sync/open_sets.hpp"
#include "drivers/sync/pulse_matcher.hpp"
#include "drivers/sync/pulse_train.hpp"
#include "drivers/sync/sync_types.hpp"
#include "drivers/sync/time_numbering.hpp"
#include "drivers/trigger.hpp"

namespace vergence {

/// Pairs the frames of a rig by their pulses, counters or stamps (SyncMode).
///
/// A set is output as soon as every connected camera has given its image or a later one (its image
/// is lost) and, with pulses, their report has arrived; at the latest `hold` after the set's first
/// image, by the arrivals of other frames. Sets are output in order of their numbers, each once.
/// The result depends only on the input and its order; no clock is read.
///
///     RigSynchronizer synchronizer({.cameras = 2, .interval = Duration::milliseconds(50)});
///     if (synchronizer.offer(frame) != SyncResult::accepted) camera.release(frame.slot);
///     for (SyncedSet set; synchronizer.next(&set);)
///       if (set.complete) use(set.slots, set.stamp);  // its slots are the caller's again
///
/// Pulses     A camera is `acquiring` until its intervals fit the pulses' at exactly one place;
///            arrival never decides. Meanwhile its frames are returned and counted, and sets are
///            output without them. Then a frame's pulse follows from its stamp (the camera's clock
///            tied to the trigger board's), and the counter must agree: extra pulses are missed
///            triggers, extra counts are lost frames, anything else is a contradiction and a new
///            acquisition. After a missed trigger sets wait up to `hold` for the intervals to
///            exclude a step of the clock, else they are `ambiguous`. A number that runs back or
///            another `boot` makes all cameras acquire again. A frame before its pulse's report
///            gets the number too; the report then verifies it, or the set is `ambiguous`.
/// One clock  A set paired by stamps of one bus or PTP clock is `ambiguous` if the host's stamps
///            disagree by more than half an interval, or while a connected camera's clock is far
///            from the others'.
/// Limits     A camera that delivers the image of one exposure with the stamp of the next is not
///            detected here.
/// Ownership  An `accepted` slot is returned by next() in exactly one set and then belongs to the
///            caller.
/// Cost       Not thread-safe. Fixed memory, kOpen pulses. Constant time per call.
/// Errors     No call throws. Frames that cannot be paired are reported by SyncResult and counted.
class RigSynchronizer {
 public:
  static constexpr std::size_t kOpen = OpenSets::kOpen;
  static constexpr int kAmbiguous = CounterNumbering::kAmbiguous;
  /// Pulses omitted by a pause: more than a camera misses on its own.
  static constexpr std::uint32_t kPause = 4;

  /// Precondition: options.validate() == nullptr.
  explicit RigSynchronizer(const SyncOptions& options) noexcept;

  /// Offers a frame. Precondition: next() was called until false since the last offer().
  [[nodiscard]] SyncResult offer(const SyncFrame& frame) noexcept;
  /// Returns the next set. Call until false.
  [[nodiscard]] bool next(SyncedSet* set) noexcept;

  /// Adds a pulse's report, in order of arrival. Does nothing in modes other than board and
  /// ins_syncout. Call next() as after offer(). Precondition: pulse.mapped.
  void pulse(const Pulse& pulse) noexcept;
  /// Number of pulses to omit because the intervals do not identify them; mostly 0. Returned once,
  /// and again if the pause had no effect. board: call TriggerDevice::pause() with exactly that
  /// number, because another could hide a lost report. ins_syncout, master_strobe: stop the source
  /// and start it again.
  [[nodiscard]] std::uint32_t wants_pause() noexcept;
  /// Returns true if that camera's pairing is verified; always true in modes that cannot verify it.
  [[nodiscard]] bool verified(int camera) const noexcept;

  /// Call for an exposure without a usable image, so that its set does not wait. Same preconditions
  /// as offer(). Not in modes that pair by stamps.
  void lost(int camera, std::uint64_t counter) noexcept;
  /// Call when a camera was disconnected, so that sets do not wait for it.
  void absent(int camera) noexcept;
  /// Call when a camera has reconnected and counts from zero. By counter its first frame joins the
  /// pulse nearest in time. With pulses it acquires while the others continue; a master's count
  /// continues by its clock.
  void restarted(int camera) noexcept;
  /// Call after the last frame: next() then returns all open sets.
  void finish() noexcept { finishing_ = true; }

  [[nodiscard]] SyncCounters counters() const noexcept;

 private:
  struct Source {
    bool here = true;
    bool any = false;
    // Newest number.
    std::uint64_t newest = 0;
    // Sets below this number did not wait for the camera, because it was acquiring.
    std::uint64_t from = 0;
  };
  enum class Step : std::uint8_t { numbered, again, acquiring, late };

  // Each returns the number of a frame's set: by counter or time, by pulses, by the master.
  [[nodiscard]] Step number_of(const SyncFrame& frame, std::uint64_t* number,
                               SetImage* image) noexcept;
  [[nodiscard]] Step number_by_pulse(const SyncFrame& frame, std::uint64_t* number,
                                     SetImage* image) noexcept;
  [[nodiscard]] Step number_by_master(const SyncFrame& frame, std::uint64_t* number,
                                      SetImage* image) noexcept;
  [[nodiscard]] SyncResult verdict_on_late(std::size_t camera, std::uint64_t number, Step step,
                                           const SetImage& image) noexcept;
  void add_pulse(const Pulse& pulse) noexcept;
  void acquired(std::size_t camera) noexcept;
  void begin_again() noexcept;
  [[nodiscard]] Duration noise_of(std::size_t camera) const noexcept;

  void prove(OpenSet* open, SyncedSet* set) noexcept;
  [[nodiscard]] bool host_stamps_agree(const SyncedSet& set) const noexcept;
  [[nodiscard]] bool a_clock_is_apart() const noexcept;
  void mark_ambiguous(SyncedSet* set) noexcept;
  [[nodiscard]] bool ready(const OpenSet& open) const noexcept;
  [[nodiscard]] bool waited_for(std::size_t camera) const noexcept;
  void emit(OpenSet* open, SyncedSet* set) noexcept;
  void stamp(const OpenSet& open, SyncedSet* set) const noexcept;
  void stamp_by_pulse(const OpenSet& open, SyncedSet* set) const noexcept;

  SyncOptions options_;
  std::array<Source, kMaxCameras> sources_{};
  OpenSets sets_;
  CounterNumbering by_counter_;
  TimeNumbering by_time_;
  PulseTrain train_;
  std::array<PulseMatcher, kMaxCameras> matchers_{};
  // Pulses in the mode in which camera 0 makes them.
  MasterPulses master_;
  // From this number on, every pulse without an image is a missed one.
  std::uint64_t steady_from_ = 0;
  std::uint64_t pulses_ = 0, asked_at_ = 0;
  bool asked_ = false;
  // Newest arrival.
  HostStamp now_{};
  bool finishing_ = false;
  SyncCounters counters_{};
};

}  // namespace vergence
