#pragma once
#include <cstdint>
#include <string>

namespace vergence::app {

/// What is likely to be at a serial port, by the USB ids of what carries it. Asked is nobody:
/// opening a port resets many a board.
enum class SerialKind : std::uint8_t {
  ins,        // XSens' own converter, or an MTi with USB
  ftdi,       // an FTDI converter: whatever is wired to it, an MTi often
  converter,  // another maker's converter
  board,      // a microcontroller board: a trigger board?
  built_in,   // not on USB
  unknown,
};
/// In words, for lists.
[[nodiscard]] const char* to_phrase(SerialKind) noexcept;
/// The key of `devices --json`.
[[nodiscard]] const char* to_key(SerialKind) noexcept;

/// vendor 0: not on USB.
[[nodiscard]] SerialKind serial_kind(std::uint16_t vendor, std::uint16_t product) noexcept;

/// An FTDI chip, under whatever vendor id: it has a latency timer.
[[nodiscard]] bool is_ftdi(std::uint16_t vendor, std::uint16_t product) noexcept;

}  // namespace vergence::app
