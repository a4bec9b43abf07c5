/// Any bytes as a camera's configuration ROM. Entry point of libFuzzer; the unit tests call it with
/// seeded mutations.
#include <cstdlib>
#include <cstring>
#include <vector>

#include "firmware_iface/iidc/config_rom.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace vergence::iidc;
  // The exact size lets ASan find a read beyond the last byte.
  std::vector<std::uint32_t> quadlets(size / 4);
  if (!quadlets.empty()) std::memcpy(quadlets.data(), data, quadlets.size() * 4);
  ConfigRom rom{.guid = 77};
  const RomStatus status = parse_config_rom(quadlets, &rom);
  // A refused ROM must leave the result unchanged.
  if (status != RomStatus::ok && rom.guid != 77) std::abort();
  if (status == RomStatus::ok) {
    // The text must be terminated.
    if (rom.model.back() != 0) std::abort();
    if (rom.command_base < kRegisterSpace || rom.command_base >= 0x1'0000'0000'0000) std::abort();
  }
  return 0;
}
