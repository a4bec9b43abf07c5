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

/// Pairs the frames of a rig: by the pulses that made them, by their counters, or by their stamps
/// (SyncMode).
///
/// A set goes out as soon as every camera that is there has given its image, or has given a later
/// one (its image is lost), and its pulse's report is here where there are pulses; or `hold` after
/// the set's first image, by the arrivals of others. Sets go out in order of their numbers, each
/// once. Deterministic: the result depends on the input and its order only; no clock is read.
///
///     RigSynchronizer synchronizer({.cameras = 2, .interval = Duration::milliseconds(50)});
///     if (synchronizer.offer(frame) != SyncResult::taken) camera.release(frame.slot);
///     for (SyncedSet set; synchronizer.next(&set);)
///       if (set.complete) use(set.slots, set.stamp);  // its slots are ours again
///
/// Pulses     A camera is `acquiring` until its own intervals fit the pulses' at exactly one place;
///            arrival never decides. Its frames are given back and counted meanwhile, those of the
///            others go out without them. From then on every frame's pulse follows from its stamp
///            (the camera's clock tied to the board's), and its counter must agree: more pulses
///            than counts are missed triggers, counts without images are lost frames, anything else
///            is a contradiction and it acquires again. After a missed trigger sets wait up to
///            `hold` for the intervals to show that it was none of the clock's, else they are
///            `ambiguous`. A pulse that runs back in number or has another `boot` makes all acquire
///            again. A frame that comes before its pulse's report is given the pulse's number all
///            the same; the report then confirms it, or the set is `ambiguous`.
/// One clock  Of a set paired by stamps of one bus or PTP clock the host's stamps must agree within
///            half an interval, else it is `ambiguous`; so is every set while a camera that is
///            there has a clock far from the others'.
/// Limits     A camera that hands out the image of one exposure under the stamp of the next is not
///            detected here.
/// Ownership  A slot that is `taken` comes out of next() in exactly one set; then it is the
///            caller's again.
/// Not thread-safe. Memory: fixed, kOpen pulses. Constant time per call.
/// Errors     Nothing throws. Frames that cannot be paired are reported by SyncResult and counted.
class RigSynchronizer {
 public:
  static constexpr std::size_t kOpen = OpenSets::kOpen;
  static constexpr int kAmbiguous = CounterNumbering::kAmbiguous;
  static constexpr std::uint32_t kPause =
      4;  // pulses left out: more than what a camera misses by itself

  /// Precondition: options.validate() == nullptr.
  explicit RigSynchronizer(const SyncOptions& options) noexcept;

  /// Precondition: next() was called until false since the last offer().
  [[nodiscard]] SyncResult offer(const SyncFrame& frame) noexcept;
  /// The next set that is ready. Call until false.
  [[nodiscard]] bool next(SyncedSet* set) noexcept;

  /// A pulse's report, in the order of arrival; in the modes board and ins_syncout (elsewhere it
  /// does nothing). next() as after offer().
  /// Precondition: pulse.mapped.
  void pulse(const Pulse& pulse) noexcept;
  /// Number of pulses to leave out because the intervals do not identify them; mostly 0. Returned
  /// once, and again if the pause did not help. board: TriggerDevice::pause() with just that
  /// number, another could hide a report that was lost. ins_syncout, master_strobe: stop the source
  /// and start it again.
  [[nodiscard]] std::uint32_t wants_pause() noexcept;
  /// Returns true if that camera's pairing is verified; always true in modes that cannot verify it.
  [[nodiscard]] bool verified(int camera) const noexcept;

  /// Call for an exposure without a usable image: its set does not wait for it. Preconditions as
  /// offer(). Not in modes that pair by stamps.
  void lost(int camera, std::uint64_t counter) noexcept;
  /// Call when a camera was disconnected: sets no longer wait for it.
  void absent(int camera) noexcept;
  /// Call when it has come back and counts from zero. By counter: its first frame joins the pulse
  /// nearest in time, the others follow. With pulses: it acquires, the others go on; a master's
  /// count goes on by its clock.
  void restarted(int camera) noexcept;
  /// Call after the last frame: next() then returns all open sets.
  void finish() noexcept { finishing_ = true; }

  [[nodiscard]] SyncCounters counters() const noexcept;

 private:
  struct Source {
    bool here = true;
    bool any = false;
    std::uint64_t newest = 0;  // number
    std::uint64_t from = 0;    // number; sets below did not wait for it, as it was acquiring
  };
  enum class Step : std::uint8_t { numbered, again, acquiring, late };

  // By counter, by time, by pulses: the number of a frame's set.
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
  MasterPulses master_;            // camera 0 where its exposures are the pulses
  std::uint64_t steady_from_ = 0;  // number from which on every pulse without image is a missed one
  std::uint64_t pulses_ = 0, asked_at_ = 0;
  bool asked_ = false;
  HostStamp now_{};  // newest arrival
  bool finishing_ = false;
  SyncCounters counters_{};
};

}  // namespace vergence
