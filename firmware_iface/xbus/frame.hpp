#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

/// Xbus frames: FA, bus id, message id, length (FF: two more bytes of length follow, big endian),
/// payload, checksum. With the checksum, the sum of all bytes after FA is a multiple of 256.
namespace vergence::xbus {

inline constexpr std::uint8_t kPreamble = 0xFA;
/// Bus id of unsolicited messages of a sensor, and its usual address.
inline constexpr std::uint8_t kBusMaster = 0xFF;
/// Alternative address of a single sensor.
inline constexpr std::uint8_t kBusFirst = 0x01;
inline constexpr std::uint8_t kLengthExtended = 0xFF;
/// In bytes; longer lengths are treated as false frames.
inline constexpr std::size_t kMaxPayload = 2048;
/// Adds FA, bus, id, FF, two bytes of length and the checksum.
inline constexpr std::size_t kMaxFrame = kMaxPayload + 7;

/// Message ids. The id of an answer is that of the request plus one. The message that sets a value
/// requests it if the payload is empty.
/// L: MTi-G (MTData), 4: MTi-G-700/710 (MTData2).
enum class MessageId : std::uint8_t {
  device_id_request = 0x00,
  /// L.
  init_bus = 0x02,
  /// L: period in ticks of 1/115200 s.
  period = 0x04,
  /// L.
  data_length_request = 0x0A,
  configuration_request = 0x0C,
  configuration = 0x0D,
  restore_factory_settings = 0x0E,
  go_to_measurement = 0x10,
  firmware_request = 0x12,
  /// Takes effect at the next reset.
  baudrate = 0x18,
  product_code_request = 0x1C,
  /// 4: the whole list.
  sync_settings = 0x2C,
  go_to_config = 0x30,
  /// L.
  mtdata = 0x32,
  /// 4.
  mtdata2 = 0x36,
  wake_up = 0x3E,
  wake_up_answer = 0x3F,
  reset = 0x40,
  error = 0x42,
  scenario = 0x64,
  /// L.
  lever_arm = 0x68,
  declination = 0x6A,
  /// 4.
  string_output = 0x8E,
  /// 4.
  output_configuration = 0xC0,
  /// L.
  output_mode = 0xD0,
  /// L.
  output_settings = 0xD2,
  /// L.
  output_skip = 0xD4,
  /// L. On a 4 this id sets the heading, so it is sent only once the generation is known.
  legacy_sync_in = 0xD6,
  /// L.
  legacy_sync_out = 0xD8,
};

struct Message {
  std::uint8_t bus = kBusMaster;
  /// MessageId, or an id not listed there.
  std::uint8_t id = 0;
  std::span<const std::uint8_t> payload{};

  [[nodiscard]] bool is(MessageId what) const noexcept {
    return id == static_cast<std::uint8_t>(what);
  }
};

enum class FrameStatus : std::uint8_t {
  ok,
  /// More bytes are needed to decide whether a frame begins here.
  incomplete,
  /// The first byte is not FA.
  no_preamble,
  /// No sensor uses this address.
  bus_refused,
  /// The length exceeds kMaxPayload.
  length_refused,
  checksum_wrong,
};

struct ParsedFrame {
  FrameStatus status = FrameStatus::incomplete;
  /// Size of the whole frame; 0 unless ok.
  std::size_t size = 0;
  /// The payload is a part of the parsed bytes.
  Message message{};
};

/// Parses the frame at bytes[0]. If it is refused, the caller continues one byte later.
[[nodiscard]] ParsedFrame parse_frame(std::span<const std::uint8_t> bytes) noexcept;

enum class WriteStatus : std::uint8_t { ok, payload_too_long, no_room };

struct WrittenFrame {
  WriteStatus status = WriteStatus::ok;
  /// Number of bytes written; 0 unless ok.
  std::size_t size = 0;
};

/// Writes the message to the beginning of `out`, with extended length only if needed. If not ok,
/// `out` is unchanged.
[[nodiscard]] WrittenFrame write_frame(const Message& message,
                                       std::span<std::uint8_t> out) noexcept;

/// Counters of a stream; every byte is in a message, in `garbage_bytes`, or waiting.
struct StreamCounters {
  std::uint64_t messages = 0;
  /// Bytes of complete frames.
  std::uint64_t message_bytes = 0;
  /// Skipped bytes, including false preambles.
  std::uint64_t garbage_bytes = 0;
  std::uint64_t bus_refused = 0;
  std::uint64_t length_refused = 0;
  std::uint64_t checksum_wrong = 0;
  /// Frames discarded by abandon().
  std::uint64_t abandoned = 0;
};

/// Finds messages in a byte stream with arbitrary start, gaps and corruption.
/// Ownership  A message's payload is a part of the stream's buffer, valid until the next accept().
/// Memory     Fixed. accept() takes what fits, at least one byte once next() has returned false.
/// Errors     After a failed preamble the search continues one byte later; skipped bytes are
///            counted.
///
/// Not thread-safe.
class FrameStream {
 public:
  /// Takes bytes from the front of `bytes` and returns their number.
  [[nodiscard]] std::size_t accept(std::span<const std::uint8_t> bytes) noexcept;
  /// Returns the oldest complete message. If false, *message is unchanged.
  [[nodiscard]] bool next(Message* message) noexcept;
  /// Discards an incomplete frame and searches its bytes again. Call if the link was quiet longer
  /// than a frame takes (a false length of 2048 is 178 ms at 115200 baud).
  void abandon() noexcept;
  /// Discards waiting bytes as garbage, after the link was reopened.
  void reset() noexcept;

  [[nodiscard]] const StreamCounters& counters() const noexcept { return counters_; }
  /// Number of bytes of an incomplete frame.
  [[nodiscard]] std::size_t waiting() const noexcept { return end_ - begin_; }

 private:
  void skip(std::size_t n) noexcept;

  // Has room for reads that follow an incomplete frame.
  std::array<std::uint8_t, 4 * kMaxFrame> buffer_{};
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  StreamCounters counters_{};
};

}  // namespace vergence::xbus
