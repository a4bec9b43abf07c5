#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/types/time.hpp"
#include "drivers/gige/detail/glib.hpp"

namespace vergence::gige {

/// Where in a frame's chunk data a feature is, as the camera's description has it.
struct ChunkField {
  std::uint32_t id = 0;  // of the chunk
  std::uint32_t offset = 0,
                length = 0;  // bytes in the chunk; length 4 or 8 where `real`, else 1 to 8
  bool real = false, big_endian = false;  // IEEE 754, else an unsigned integer
};

/// The exposure in what follows the pixels of a frame: chunks, each with its number and its length
/// (two words of 32 bits, big endian) behind it, so that they are found from the end backwards. The
/// pixels are the first chunk: only their tag is in `tail`.
///
/// Nothing: there is no such chunk among the last 64, it is shorter than the field, or it holds no
/// time from 1 ns to a minute.
/// Input    From the wire: any bytes. Memory  None. Threads  Any.
/// Source   GigE Vision 2.0, payload types "chunk data" and "extended chunk data"; SFNC 2.0
///          ChunkExposureTime (µs).
[[nodiscard]] std::optional<Duration> exposure_in_chunks(std::span<const std::uint8_t> tail,
                                                         const ChunkField& field) noexcept;

/// Where the feature `name` of the camera's chunk data is. Nothing: it is no register of a chunk,
/// or one behind a formula.
[[nodiscard]] std::optional<ChunkField> find_chunk_field(ArvDevice* device, const char* name);

}  // namespace vergence::gige
