#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

/// Xbus frames: FA, bus id, message id, length (FF: two more bytes of length follow, big endian),
/// payload, checksum. The checksum makes the sum of all bytes after FA, itself included, a multiple
/// of 256.
namespace vergence::xbus {

inline constexpr std::uint8_t kPreamble = 0xFA;
inline constexpr std::uint8_t kBusMaster =
    0xFF;  // what a sensor sends unasked, and the usual address
inline constexpr std::uint8_t kBusFirst = 0x01;  // the other address a single sensor answers to
inline constexpr std::uint8_t kLengthExtended = 0xFF;
inline constexpr std::size_t kMaxPayload = 2048;  // bytes; longer claims are false frames
inline constexpr std::size_t kMaxFrame =
    kMaxPayload + 7;  // FA, bus, id, FF, two of length, payload, checksum

/// Message ids; an answer's id is the request's plus one, and a request for a setting is the
/// message that sets it, without payload.
/// L: MTi-G (MTData), 4: MTi-G-700/710 (MTData2).
enum class MessageId : std::uint8_t {
  device_id_request = 0x00,
  init_bus = 0x02,             // L
  period = 0x04,               // L: ticks of 1/115200 s
  data_length_request = 0x0A,  // L
  configuration_request = 0x0C,
  configuration = 0x0D,
  restore_factory_settings = 0x0E,
  go_to_measurement = 0x10,
  firmware_request = 0x12,
  baudrate = 0x18,  // takes effect at the next reset
  product_code_request = 0x1C,
  sync_settings = 0x2C,  // 4: the whole list
  go_to_config = 0x30,
  mtdata = 0x32,   // L
  mtdata2 = 0x36,  // 4
  wake_up = 0x3E,
  wake_up_answer = 0x3F,
  reset = 0x40,
  error = 0x42,
  scenario = 0x64,
  lever_arm = 0x68,  // L
  declination = 0x6A,
  string_output = 0x8E,         // 4
  output_configuration = 0xC0,  // 4
  output_mode = 0xD0,           // L
  output_settings = 0xD2,       // L
  output_skip = 0xD4,           // L
  legacy_sync_in = 0xD6,        // L; the same number sets the heading of a 4: never sent before the
                                // generation is known
  legacy_sync_out = 0xD8,       // L
};

struct Message {
  std::uint8_t bus = kBusMaster;
  std::uint8_t id = 0;  // MessageId, or one this header does not name
  std::span<const std::uint8_t> payload{};

  [[nodiscard]] bool is(MessageId what) const noexcept {
    return id == static_cast<std::uint8_t>(what);
  }
};

enum class FrameStatus : std::uint8_t {
  ok,
  incomplete,      // a frame may begin here: more bytes are needed to tell
  no_preamble,     // the first byte is not FA
  bus_refused,     // an address no sensor uses
  length_refused,  // claims more than kMaxPayload
  checksum_wrong,
};

struct ParsedFrame {
  FrameStatus status = FrameStatus::incomplete;
  std::size_t size = 0;  // bytes of the whole frame; 0 unless ok
  Message message{};     // payload points into the bytes given
};

/// The frame that begins at bytes[0]. Pure: what follows a refused first byte is the caller's to
/// try, one byte on.
[[nodiscard]] ParsedFrame parse_frame(std::span<const std::uint8_t> bytes) noexcept;

enum class WriteStatus : std::uint8_t { ok, payload_too_long, no_room };

struct WrittenFrame {
  WriteStatus status = WriteStatus::ok;
  std::size_t size = 0;  // bytes written; 0 unless ok
};

/// Writes the message to the beginning of `out`, extended length only where needed. Not ok: `out`
/// untouched.
[[nodiscard]] WrittenFrame write_frame(const Message& message,
                                       std::span<std::uint8_t> out) noexcept;

/// Content of a stream; every byte is in a message or in `garbage_bytes`, or still waits.
struct StreamCounters {
  std::uint64_t messages = 0;
  std::uint64_t message_bytes = 0;  // of whole frames
  std::uint64_t garbage_bytes = 0;  // skipped one by one, false preambles included
  std::uint64_t bus_refused = 0;
  std::uint64_t length_refused = 0;
  std::uint64_t checksum_wrong = 0;
  std::uint64_t abandoned = 0;  // frames given up by abandon()
};

/// Finds messages in a byte stream that begins, tears and lies anywhere.
///
///     while (!bytes.empty()) {
///       bytes = bytes.subspan(stream.accept(bytes));
///       Message message;
///       while (stream.next(&message)) use(message);
///     }
///
/// Ownership  A message's payload points into the stream's buffer: valid until the next accept().
/// Threads    One.
/// Memory     In place, no heap. accept() takes what fits; once next() has said false it takes at
///            least one byte.
/// Errors     None: whatever is not a frame is skipped from the failed preamble one byte on, and
///            counted.
class FrameStream {
 public:
  /// Takes bytes from the front of `bytes`; returns how many.
  [[nodiscard]] std::size_t accept(std::span<const std::uint8_t> bytes) noexcept;
  /// The oldest whole message not yet handed out. False: none, *message untouched.
  [[nodiscard]] bool next(Message* message) noexcept;
  /// Gives up the frame that is being waited for, if any: for a line that has been quiet longer
  /// than the frame would take (a false length of 2048 is 178 ms at 115200 baud). The bytes behind
  /// it are looked at again.
  void abandon() noexcept;
  /// Forgets waiting bytes (they count as garbage): after the line was reopened.
  void reset() noexcept;

  [[nodiscard]] const StreamCounters& counters() const noexcept { return counters_; }
  /// Bytes that wait for the rest of their frame.
  [[nodiscard]] std::size_t waiting() const noexcept { return end_ - begin_; }

 private:
  void skip(std::size_t n) noexcept;

  std::array<std::uint8_t, 4 * kMaxFrame>
      buffer_{};  // room for reads to gather behind an incomplete frame
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  StreamCounters counters_{};
};

}  // namespace vergence::xbus
