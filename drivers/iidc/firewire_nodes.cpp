#include "drivers/iidc/firewire_nodes.hpp"

#include <algorithm>
#include <fstream>
#include <system_error>

namespace vergence::iidc {
namespace fs = std::filesystem;
namespace {

constexpr const char* kDevices = "bus/firewire/devices";

std::vector<std::uint32_t> read_rom_file(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  // Quadlets in host byte order, as the kernel provides them.
  std::vector<std::uint32_t> quadlets(kMaxRomQuadlets);
  in.read(reinterpret_cast<char*>(quadlets.data()),
          static_cast<std::streamsize>(4 * quadlets.size()));
  quadlets.resize(static_cast<std::size_t>(in.gcount()) / 4);
  return quadlets;
}

}  // namespace

bool has_firewire(const fs::path& root) {
  std::error_code error;
  return fs::is_directory(root / kDevices, error);
}

std::vector<FirewireNode> list_firewire_cameras(const fs::path& root) {
  std::vector<FirewireNode> out;
  std::error_code error;
  for (fs::directory_iterator it(root / kDevices, error), end; !error && it != end;
       it.increment(error)) {
    const std::string name = it->path().filename().string();
    // Skips units: fw1.0 is a unit of fw1.
    if (!name.starts_with("fw") || name.find('.') != std::string::npos) continue;
    FirewireNode node;
    node.device = "/dev/" + name;
    if (parse_config_rom(read_rom_file(it->path() / "config_rom"), &node.rom) != RomStatus::ok)
      continue;
    std::error_code none;
    node.bus = fs::canonical(it->path(), none).parent_path().string();
    out.push_back(node);
  }
  std::sort(out.begin(), out.end(),
            [](const FirewireNode& a, const FirewireNode& b) { return a.rom.guid < b.rom.guid; });
  return out;
}

}  // namespace vergence::iidc
