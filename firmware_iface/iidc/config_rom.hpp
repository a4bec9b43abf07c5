#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

/// Configuration ROM of a camera (IEEE 1212): identity and address of the registers.
namespace vergence::iidc {

/// Last 256 MB of a node's 48-bit address space.
inline constexpr std::uint64_t kRegisterSpace = 0xFFFF'F000'0000;
inline constexpr std::uint64_t kRomAddress = kRegisterSpace + 0x400;
/// The ROM's window ends at 0x800.
inline constexpr std::size_t kMaxRomQuadlets = 256;

enum class RomStatus : std::uint8_t {
  ok,
  /// There is no complete bus information block.
  too_short,
  /// The block does not contain "1394".
  not_1394,
  /// The root directory exceeds the ROM.
  broken_root,
  /// There is no unit with a specifier of IIDC or Point Grey.
  no_camera,
  /// The unit lacks the address of its registers.
  no_command_base,
};
[[nodiscard]] std::string_view to_string(RomStatus) noexcept;

struct ConfigRom {
  std::uint64_t guid = 0;
  /// Address of the command registers.
  std::uint64_t command_base = 0;
  /// Zero-terminated, printable ASCII; empty if the ROM has none.
  std::array<char, 64> model{};
};

/// Parses quadlets read from kRomAddress on, at most kMaxRomQuadlets.
///
/// Takes linear time: directories are followed to depth three and never back. *rom is written only
/// when ok. Every offset and length is checked before use. Checksums are ignored, because many
/// cameras have wrong ones.
[[nodiscard]] RomStatus parse_config_rom(std::span<const std::uint32_t> quadlets,
                                         ConfigRom* rom) noexcept;

}  // namespace vergence::iidc
