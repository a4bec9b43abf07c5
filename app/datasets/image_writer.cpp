#include "app/datasets/image_writer.hpp"

#include <cstdint>
#include <fstream>
#include <vector>

#include "app/recording/png_encoder.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {

void write_png(const std::filesystem::path& file, const ImageView& image) {
  std::vector<std::uint8_t> bytes;
  const bool encoded = encode_png(image, &bytes);
  std::ofstream out(file, std::ios::binary);
  out.write(reinterpret_cast<const char*>(bytes.data()),
            static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!encoded || !out) throw InputError(file.string() + ": cannot be written; is the disk full?");
}

}  // namespace vergence::app
