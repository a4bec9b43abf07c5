#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

namespace vergence::app {

enum class ImageFileStatus : std::uint8_t {
  ok,
  /// The file does not exist.
  missing,
  /// The system refuses to read it.
  unreadable,
  /// The program has reached its limit of open files.
  too_many_files,
  /// Not a PNG, JPEG or BMP, or more pixels than any camera has.
  not_an_image,
  /// Begins as an image but is incomplete, or a checksum is wrong.
  truncated,
  /// Complete, but the decoder refuses it.
  undecodable,
  /// Width or height differ from the expected ones.
  wrong_size,
};

/// Rest of a message that begins with the file's name: "is missing", "ends before the image is
/// complete".
[[nodiscard]] const char* to_phrase(ImageFileStatus status) noexcept;

struct ImageSize {
  /// In px.
  int width = 0, height = 0;
  bool operator==(const ImageSize&) const = default;
};

/// True by the ending, except for hidden files, which systems create next to images.
[[nodiscard]] bool is_image_name(std::string_view file);

/// Reads a whole file into *bytes, reusing its capacity. → ok, missing, unreadable
[[nodiscard]] ImageFileStatus read_image_file(const std::filesystem::path& file,
                                              std::vector<std::uint8_t>* bytes);

/// Reads the size from the header of a PNG, JPEG or BMP file. → ok, missing, unreadable,
/// not_an_image, truncated
[[nodiscard]] ImageFileStatus read_image_size(const std::filesystem::path& file, ImageSize* size);

/// Reads the size from the first bytes of a file. → ok, not_an_image, truncated
[[nodiscard]] ImageFileStatus read_image_size(std::span<const std::uint8_t> head,
                                              ImageSize* size) noexcept;

/// Decodes PNG of any depth and colour, JPEG of grey or three colours, BMP of 8, 24 or 32 bits, PGM
/// or PPM to 8-bit grey, into size.height rows of `stride` bytes at `out`, without another copy.
/// Thread-safe. Incomplete and damaged files are refused, because decoders silently fill missing
/// parts with grey, which would be tracked. `deep_bits` is the number of used bits of 16-bit
/// samples (8 to 16). If not `ok`, the content of `out` is undefined. → ok, not_an_image,
/// truncated, undecodable, wrong_size
[[nodiscard]] ImageFileStatus decode_grey(std::span<const std::uint8_t> bytes, ImageSize size,
                                          std::uint8_t* out, std::size_t stride,
                                          int deep_bits = 16) noexcept;

}  // namespace vergence::app
