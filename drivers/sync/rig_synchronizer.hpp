#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/sync/pulse_matcher.hpp"
#include "drivers/sync/pulse_train.hpp"
#include "drivers/sync/sync_types.hpp"
#include "drivers/trigger.hpp"

namespace vergence {

/// Pairs the frames of a rig: by the pulses that made them, by their counters, or by their stamps
/// (SyncMode).
///
/// A set goes out as soon as every camera that is there has given its image, or has given a later
/// one (its image is lost), and its pulse's report is here where there are pulses; or `hold` after
/// the set's first image, by the arrivals of others. Sets go out in order of their numbers, each
/// once. Determined by what is offered and in which order; no clock is read.
///
/// Pulses     A camera is `acquiring` until its own intervals fit the pulses' at exactly one place;
///            arrival never decides. Its frames are given back and counted meanwhile, those of the
///            others go out without them. From then on every frame's pulse follows from its stamp
///            (the camera's clock tied to the board's), and its counter must agree: more pulses
///            than counts are missed triggers, counts without images are lost frames, anything else
///            is a contradiction and it acquires again. After a missed trigger sets wait up to
///            `hold` for the intervals to show that it was none of the clock's, else they are
///            `unproven`. A pulse that runs back in number or has another `boot` makes all acquire
///            again. A frame that comes before its pulse's report is given the pulse's number all
///            the same; the report then confirms it, or the set is `unproven`.
/// A limit    A camera that hands out the image of one exposure under the stamp of the next cannot
///            be told here.
/// Ownership  A slot that is `taken` comes out of next() in exactly one set; then it is the
///            caller's again.
/// Threads    One caller. Memory: fixed, kOpen pulses. Time: constant a call.
/// Errors     Nothing throws. What cannot be paired is told by the verdict and counted.
class RigSynchronizer {
 public:
  static constexpr std::size_t kOpen =
      4;  // pulses waiting at most: bounds the latency and the slots held
  static constexpr std::size_t kHistory =
      64;                               // sets remembered, to tell a duplicate from a late frame
  static constexpr int kUnproven = 10;  // in a row: the pulses were not found rightly
  static constexpr std::uint32_t kPause =
      4;  // pulses left out: more than what a camera misses by itself

  /// Precondition: options.validate() == nullptr.
  explicit RigSynchronizer(const SyncOptions& options) noexcept;

  /// Precondition: next() was called until false since the last offer().
  [[nodiscard]] SyncVerdict offer(const SyncFrame& frame) noexcept;
  /// The next set that is ready. Call until false.
  [[nodiscard]] bool next(SyncedSet* set) noexcept;

  /// A pulse's report, in the order of arrival; in the modes board and ins_syncout (elsewhere it
  /// does nothing). next() as after offer().
  /// Precondition: pulse.mapped.
  void pulse(const Pulse& pulse) noexcept;
  /// So many pulses should be left out, because the intervals prove nothing; mostly 0. Asked for
  /// once, and again when it did not help.
  /// board: TriggerDevice::pause() with just that number, another could hide a report that was
  /// lost. ins_syncout, master_strobe: stop the source and start it again.
  [[nodiscard]] std::uint32_t wants_pause() noexcept;
  /// Nothing is left to be proven of that camera's frames: always, where nothing can be.
  [[nodiscard]] bool proven(int camera) const noexcept;

  /// That exposure of a camera gave no image that could be used: nobody waits for it. Else as
  /// offer(); not where stamps pair.
  void lost(int camera, std::uint64_t counter) noexcept;
  /// A camera has gone: nobody waits for it.
  void absent(int camera) noexcept;
  /// It has come back and counts from zero. By counter: its first frame joins the pulse nearest in
  /// time, the others follow. With pulses: it acquires, the others go on; a master's count goes on
  /// by its clock.
  void restarted(int camera) noexcept;
  /// No more frames will come: everything open goes out by next().
  void finish() noexcept { finishing_ = true; }

  [[nodiscard]] SyncCounters counters() const noexcept;

 private:
  struct Source {
    bool here = true;
    bool align = false;     // the next frame's number is found by time
    std::int64_t base = 0;  // number − counter
    bool any = false;
    std::uint64_t newest = 0;  // number
    std::uint64_t from = 0;    // number; sets below did not wait for it, as it was acquiring
  };
  struct Image {
    MappedStamp middle{};
    std::int64_t time = 0;  // ns, of the clock that pairs, where stamps do: middle of the exposure
    DeviceStamp edge{};     // of the pulse by its source's clock, as this camera's stamp has it
    Duration gate{};        // |true edge − edge| is below this
    Duration exposure{};
    bool doubtful = false;  // perhaps of an earlier pulse
  };
  struct Open {
    bool used = false;
    bool contradicted = false;  // its pulse's report does not agree with an image's stamp
    SyncedSet set{};
    std::array<Image, kMaxCameras> images{};
    HostStamp first{};
  };
  struct Gone {
    std::uint64_t number = 0;
    std::array<bool, kMaxCameras> present{};
    bool used = false;
  };
  /// Camera 0 where its exposures are the pulses.
  struct Master {
    bool known = false;
    bool align = false;      // it was started again: its count is another, its clock may go on
    std::uint64_t base = 0;  // pulse number − counter, modulo 2^64
    std::uint64_t counter = 0;
    DeviceStamp stamp{};
    std::uint32_t boot = 0;
  };
  enum class Step : std::uint8_t { numbered, again, acquiring };

  // By counter, by time, by pulses: the number of a frame's set.
  [[nodiscard]] std::uint64_t number_of(const SyncFrame& frame) noexcept;
  [[nodiscard]] std::int64_t pairing_time(const SyncFrame& frame) const noexcept;
  [[nodiscard]] std::uint64_t number_by_time(const SyncFrame& frame, std::int64_t time) noexcept;
  [[nodiscard]] bool ran_back(std::int64_t time) noexcept;
  [[nodiscard]] Step number_by_pulse(const SyncFrame& frame, std::uint64_t* number,
                                     Image* image) noexcept;
  [[nodiscard]] Step number_by_master(const SyncFrame& frame, std::uint64_t* number,
                                      Image* image) noexcept;
  void take_pulse(const Pulse& pulse) noexcept;
  void distrust(std::size_t camera) noexcept;
  void acquired(std::size_t camera) noexcept;
  void begin_again() noexcept;
  [[nodiscard]] std::uint64_t first_free() const noexcept;
  [[nodiscard]] Duration noise_of(std::size_t camera) const noexcept;

  void prove(Open* open, SyncedSet* set) noexcept;
  [[nodiscard]] Open* oldest() noexcept;
  [[nodiscard]] Open* find(std::uint64_t number) noexcept;
  [[nodiscard]] bool ready(const Open& open) const noexcept;
  [[nodiscard]] bool waited_for(std::size_t camera) const noexcept;
  void emit(Open* open, SyncedSet* set) noexcept;
  void stamp(const Open& open, SyncedSet* set) const noexcept;
  void stamp_by_pulse(const Open& open, SyncedSet* set) const noexcept;

  SyncOptions options_;
  std::array<Source, kMaxCameras> sources_{};
  std::array<Open, kOpen + 1> open_{};  // one more: the frame that pushes the oldest out
  std::size_t open_count_ = 0;
  std::array<Gone, kHistory> history_{};
  bool any_out_ = false;
  std::uint64_t last_out_ = 0;
  std::int64_t last_time_ = 0;  // Image::time of the set that went out last
  int unproven_run_ = 0;
  bool timed_ = false;  // a number and its time, to find the pulse of a camera that came back
  std::uint64_t timed_number_ = 0;
  HostStamp timed_middle_{};
  int back_ = 0;               // frames in a row whose common clock has run back
  bool new_clock_ = false;     // … and was set: the next frame begins a new count of time
  std::uint64_t flushed_ = 0;  // sets below this number wait for nobody
  PulseTrain train_;
  std::array<PulseMatcher, kMaxCameras> matchers_{};
  Master master_{};
  std::uint64_t steady_from_ = 0;  // number from which on every pulse without image is a missed one
  std::uint64_t pulses_ = 0, asked_at_ = 0;
  bool asked_ = false;
  HostStamp now_{};  // newest arrival
  bool finishing_ = false;
  SyncCounters counters_{};
};

}  // namespace vergence
