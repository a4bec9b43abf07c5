/// Any bytes as what follows the pixels of a GigE Vision frame; the first eight say which chunk is
/// looked for. Entry point of libFuzzer.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "drivers/gige/detail/chunks.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace vergence;
  if (size < 8) return 0;
  gige::ChunkField field;
  for (std::size_t i = 0; i < 4; ++i) field.id = field.id << 8U | data[i];
  field.offset = data[4] | static_cast<std::uint32_t>(data[5]) << 24U;  // small, or beyond anything
  field.length = data[6];
  field.real = (data[7] & 1U) != 0;
  field.big_endian = (data[7] & 2U) != 0;
  // Exactly so many: a read behind the last one is found by ASan.
  const std::vector<std::uint8_t> tail(data + 8, data + size);
  const auto exposure = gige::exposure_in_chunks(tail, field);
  if (exposure && (exposure->ns() < 1 || exposure->to_seconds() > 60)) std::abort();
  return 0;
}
