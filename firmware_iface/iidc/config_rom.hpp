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

enum class IidcVersion : std::uint8_t {
  v1_04,
  v1_20,
  v1_30,
  v1_31,
  v1_32
};  // 1_30: or later, and the ROM does not say which
[[nodiscard]] std::string_view to_string(IidcVersion) noexcept;

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
  std::uint32_t vendor_id = 0;  // IEEE company id
  std::uint32_t specifier = 0;  // 0x00A02D: 1394 TA, 0x00B09D: Point Grey
  IidcVersion version = IidcVersion::v1_30;
  std::uint64_t command_base = 0;  // address of the command registers
  std::array<char, 64> vendor{};   // zero-terminated, printable ASCII; empty: the ROM has none
  std::array<char, 64> model{};    // the same
  bool checksum_wrong = false;     // cameras in the field get it wrong: told, not refused
};

/// Parses quadlets read from kRomAddress on; more than kMaxRomQuadlets are not looked at.
///
/// Time    Linear in the quadlets: directories are followed to depth three and never back.
/// Errors  A status; *rom is written only when ok. No offset or length in the ROM is believed
///         before it is checked.
[[nodiscard]] RomStatus parse_config_rom(std::span<const std::uint32_t> quadlets,
                                         ConfigRom* rom) noexcept;

/// The checksum of IEEE 1212 over a block of quadlets.
[[nodiscard]] std::uint16_t rom_checksum(std::span<const std::uint32_t> block) noexcept;

}  // namespace vergence::iidc
