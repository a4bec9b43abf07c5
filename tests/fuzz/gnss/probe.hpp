#pragma once
#include <cstdint>
#include <span>

namespace vergence::test {

/// Gives hostile bytes to the decoders of NMEA and UBX. A breach of what must hold for any bytes
/// aborts with a sentence on stderr.
void probe_gnss(std::span<const std::uint8_t> bytes);

}  // namespace vergence::test
