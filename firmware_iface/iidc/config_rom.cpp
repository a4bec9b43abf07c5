#include "firmware_iface/iidc/config_rom.hpp"

#include <algorithm>
#include <optional>

namespace vergence::iidc {
namespace {

constexpr std::uint32_t kName1394 = 0x3133'3934;
constexpr std::uint32_t kSpecifierIidc = 0x00A02D, kSpecifierPointGrey = 0x00B09D;

enum Key : std::uint8_t {
  key_specifier = 0x12,
  key_command_base = 0x40,
  key_model_leaf = 0x82,
  key_unit_directory = 0xD1,
  key_unit_dependent = 0xD4,
};

struct Entry {
  std::uint8_t key = 0;
  std::uint32_t value = 0;
  // Quadlet index from which offsets count.
  std::size_t at = 0;
};

/// A directory whose entries all lie inside the ROM.
class Directory {
 public:
  static std::optional<Directory> at(std::span<const std::uint32_t> rom,
                                     std::size_t header) noexcept {
    if (header >= rom.size()) return std::nullopt;
    const std::size_t entries = rom[header] >> 16U;
    if (entries > rom.size() - header - 1) return std::nullopt;
    return Directory(rom, header, entries);
  }
  [[nodiscard]] std::size_t size() const noexcept { return entries_; }
  [[nodiscard]] Entry entry(std::size_t i) const noexcept {
    const std::size_t at = header_ + 1 + i;
    return {static_cast<std::uint8_t>(rom_[at] >> 24U), rom_[at] & 0x00FF'FFFFU, at};
  }
  [[nodiscard]] std::optional<Entry> find(Key key) const noexcept {
    for (std::size_t i = 0; i < entries_; ++i)
      if (entry(i).key == key) return entry(i);
    return std::nullopt;
  }

 private:
  Directory(std::span<const std::uint32_t> rom, std::size_t header, std::size_t entries) noexcept
      : rom_(rom), header_(header), entries_(entries) {}
  std::span<const std::uint32_t> rom_;
  std::size_t header_, entries_;
};

/// Where an entry's offset points to; 24 bits added to at most 255 cannot overflow.
std::size_t target(const Entry& e) noexcept { return e.at + e.value; }

void read_text(std::span<const std::uint32_t> rom, const std::optional<Entry>& leaf,
               std::array<char, 64>* text) noexcept {
  // Quadlets of character set and language.
  constexpr std::size_t kBefore = 2;
  if (!leaf || target(*leaf) >= rom.size()) return;
  const std::size_t header = target(*leaf), quadlets = rom[header] >> 16U;
  if (quadlets > rom.size() - header - 1) return;
  std::size_t n = 0;
  for (std::size_t i = kBefore; i < quadlets; ++i) {
    for (unsigned shift = 32; shift != 0;) {
      shift -= 8;
      const auto c = static_cast<unsigned char>(rom[header + 1 + i] >> shift);
      if (c == 0 || n + 1 == text->size()) return;
      (*text)[n++] = c >= 0x20 && c < 0x7F ? static_cast<char>(c) : '?';
    }
  }
}

}  // namespace

std::string_view to_string(RomStatus s) noexcept {
  switch (s) {
    case RomStatus::ok:
      return "ok";
    case RomStatus::too_short:
      return "the configuration ROM is too short";
    case RomStatus::not_1394:
      return "the configuration ROM has no valid IEEE 1394 header";
    case RomStatus::broken_root:
      return "the root directory leaves the configuration ROM";
    case RomStatus::no_camera:
      return "the configuration ROM names no IIDC camera";
    case RomStatus::no_command_base:
      return "the configuration ROM does not say where the camera's registers are";
  }
  return "unknown";
}

RomStatus parse_config_rom(std::span<const std::uint32_t> quadlets, ConfigRom* rom) noexcept {
  const auto all = quadlets.first(std::min(quadlets.size(), kMaxRomQuadlets));
  // Header, name, capabilities and two of the GUID.
  constexpr std::size_t kBusBlock = 5;
  if (all.size() < kBusBlock + 1) return RomStatus::too_short;
  if (all[1] != kName1394) return RomStatus::not_1394;
  const std::size_t root_at = 1 + (all[0] >> 24U);
  if (root_at < kBusBlock) return RomStatus::not_1394;
  const auto root = Directory::at(all, root_at);
  if (!root) return RomStatus::broken_root;

  ConfigRom out;
  out.guid = static_cast<std::uint64_t>(all[3]) << 32U | all[4];

  std::optional<Entry> dependent;
  bool camera = false;
  for (std::size_t i = 0; i < root->size() && !dependent; ++i) {
    const Entry e = root->entry(i);
    if (e.key != key_unit_directory) continue;
    const auto unit = Directory::at(all, target(e));
    if (!unit) continue;
    const auto specifier = unit->find(key_specifier);
    if (!specifier ||
        (specifier->value != kSpecifierIidc && specifier->value != kSpecifierPointGrey))
      continue;
    camera = true;
    dependent = unit->find(key_unit_dependent);
    if (!dependent) continue;
    const auto details = Directory::at(all, target(*dependent));
    if (!details) return RomStatus::no_command_base;
    const auto base = details->find(key_command_base);
    if (!base) return RomStatus::no_command_base;
    out.command_base = kRegisterSpace + 4 * static_cast<std::uint64_t>(base->value);
    read_text(all, details->find(key_model_leaf), &out.model);
  }
  if (!camera) return RomStatus::no_camera;
  if (!dependent) return RomStatus::no_command_base;
  *rom = out;
  return RomStatus::ok;
}

}  // namespace vergence::iidc
