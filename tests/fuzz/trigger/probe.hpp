#pragma once
#include <cstddef>
#include <cstdint>

namespace vergence {

/// Takes bytes as a stream from the line, then as a script of what may happen to a trigger board:
/// bytes, time, edges, pulses made, refused and taken back. Aborts with a sentence when the
/// protocol's decoder or the board breaks a promise.
void probe_trigger(const std::uint8_t* data, std::size_t size);

}  // namespace vergence
