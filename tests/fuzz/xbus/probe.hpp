#pragma once
#include <cstdint>
#include <span>

namespace vergence::xbus {

/// Gives hostile bytes to everything that reads Xbus: frames, both data messages, every
/// configuration payload. Each property that must hold whatever the bytes are is checked; a breach
/// aborts with a sentence on stderr.
void probe(std::span<const std::uint8_t> bytes);

}  // namespace vergence::xbus
