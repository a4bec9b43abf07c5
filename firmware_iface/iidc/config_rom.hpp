#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

/// The configuration ROM of a camera (IEEE 1212): who it is and where its registers are.
namespace vergence::iidc {

inline constexpr std::uint64_t kRegisterSpace =
    0xFFFF'F000'0000;  // the last 256 MB of a node's 48-bit addresses
inline constexpr std::uint64_t kRomAddress = kRegisterSpace + 0x400;
inline constexpr std::size_t kMaxRomQuadlets = 256;  // the ROM's window ends at 0x800

enum class RomStatus : std::uint8_t {
  ok,
  too_short,        // not even a bus information block
  not_1394,         // the block does not say "1394"
  broken_root,      // the root directory leaves the ROM
  no_camera,        // no unit of the specifiers of IIDC or Point Grey
  no_command_base,  // the unit does not say where its registers are
};
[[nodiscard]] std::string_view to_string(RomStatus) noexcept;

struct ConfigRom {
  std::uint64_t guid = 0;
  std::uint64_t command_base = 0;  // address of the command registers
  std::array<char, 64> model{};    // zero-terminated, printable ASCII; empty: the ROM has none
};

/// Parses quadlets read from kRomAddress on; more than kMaxRomQuadlets are not looked at.
///
/// Time    Linear in the quadlets: directories are followed to depth three and never back.
/// Errors  A status; *rom is written only when ok. No offset or length in the ROM is believed
///         before it is checked. Checksums are not looked at: cameras in the field get them wrong.
[[nodiscard]] RomStatus parse_config_rom(std::span<const std::uint32_t> quadlets,
                                         ConfigRom* rom) noexcept;

}  // namespace vergence::iidc
