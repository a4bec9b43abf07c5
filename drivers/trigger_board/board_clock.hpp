#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/sync/clock_mapper.hpp"
#include "firmware_iface/trigger/trigger.h"

namespace vergence::trigger_board {

/// What came of a PONG.
enum class PongWord : std::uint8_t {
  taken,
  unasked,   // no such question is open
  nonsense,  // it cannot be: sent before received, or longer in the board than under way
  backward,  // earlier than the one before
};

/// How well the board's time is known, and from what. Durations of the newest kRemembered pings.
struct TimeQuality {
  std::uint64_t asked = 0, answered = 0;
  std::uint64_t unanswered = 0;                    // for as long as kOpen questions took
  std::uint64_t refused = 0;                       // answers that made no sense
  std::uint64_t resets = 0;                        // times that the board's clock was found to have been set
  Duration rtt_least{}, rtt_median{}, rtt_most{};  // without the wire's and the board's own time
  Duration error{};                                // bound of a stamp now
  double drift_ppm = 0;                            // of the host's clock against the board's
  bool pps_locked = false;
  Duration pps_age = Duration::nanoseconds(-1);  // negative: never seen
};

/// The board's clock on the host's, from pings.
///
/// Method   Every PING and its PONG give four stamps: t1 when it was handed to the line, t2 and t3 the board's ticks, t4 when its answer
///          was here. The ClockMapper makes of them a line and a bound that no asymmetry can break: rtt / 2 at worst.
///          What bytes take on the wire at the baud rate is known, and not the same both ways: it is taken out of t1 and t4.
/// Threads  One caller. Memory: fixed.
/// Errors   PongWord. kBackward answers in a row from an earlier time than before are a clock that was set: the fit begins anew.
class BoardClock {
 public:
  static constexpr std::size_t kOpen = 64;  // questions that may be under way: more than half a second of them
  static constexpr std::size_t kRemembered = 1024;
  static constexpr int kBackward = 3;

  BoardClock() noexcept : mapper_(ClockMapperOptions{}) {}

  /// Another start of the board. `spread`: by how much the report of a stamp is late at worst, for stamps before the first answer.
  void restart(Duration spread) noexcept;
  /// The line was opened again: what was under way is not answered any more. The fit stays. `wire`: a byte's time on it, 0 where it has
  /// none.
  void reopen(Duration wire) noexcept;

  /// A PING is being sent now: its token.
  [[nodiscard]] std::uint32_t ask(HostStamp t1) noexcept;
  [[nodiscard]] PongWord answer(const TriggerPong& pong, HostStamp t4) noexcept;

  /// A ping has been answered since restart().
  [[nodiscard]] bool known() const noexcept { return known_; }
  /// Answers since restart() or reopen().
  [[nodiscard]] std::uint64_t answers() const noexcept { return answers_; }
  /// The host's time of a board's stamp, whose report was here at `arrival`. Before the first answer: from arrivals alone.
  [[nodiscard]] MappedStamp map(DeviceStamp stamp, HostStamp arrival) noexcept { return mapper_.map(stamp, arrival); }

  /// Times that answers showed a clock that was set back.
  [[nodiscard]] std::uint64_t resets_by_set_back() const noexcept { return totals_.resets; }
  /// All but the PPS. Takes a median: not for every event.
  [[nodiscard]] TimeQuality quality() const noexcept;

 private:
  struct Question {
    std::uint32_t token = 0;
    HostStamp sent{};
    bool open = false;
  };
  void forget() noexcept;

  ClockMapper mapper_;
  Duration wire_{};
  std::array<Question, kOpen> questions_{};
  std::uint32_t next_token_ = 1;
  bool known_ = false;
  std::uint64_t newest_tick_ = 0;
  int backward_ = 0;
  std::uint64_t answers_ = 0;
  std::array<std::int64_t, kRemembered> rtt_ns_{};
  std::size_t rtts_ = 0, rtt_at_ = 0;
  std::uint64_t resets_before_ = 0;  // of mappers before this one
  TimeQuality totals_{};             // the counters of it
};

}  // namespace vergence::trigger_board
