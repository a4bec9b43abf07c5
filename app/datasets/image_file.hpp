#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace vergence::app {

enum class ImageFileStatus : std::uint8_t {
  ok,
  missing,         // there is no such file
  unreadable,      // the system refuses to read it
  too_many_files,  // the program has as many files open as it may
  not_an_image,    // no PNG, JPEG or BMP, or one that claims more pixels than any camera has
  truncated,       // begins as an image and ends before it is complete, or its check sums fail
  undecodable,     // complete, and yet the decoder refuses it
  wrong_size,      // another width or height than asked for
};

/// The rest of a message that begins with the file's name: "is missing", "ends before the image is
/// complete".
[[nodiscard]] const char* to_phrase(ImageFileStatus status) noexcept;

struct ImageSize {
  int width = 0, height = 0;  // px
  bool operator==(const ImageSize&) const = default;
};

/// By the ending; hidden files, which systems put beside images, are none.
[[nodiscard]] bool is_image_name(std::string_view file) noexcept;

/// Whole file into *bytes (its capacity is reused). → ok, missing, unreadable
[[nodiscard]] ImageFileStatus read_image_file(const std::filesystem::path& file,
                                              std::vector<std::uint8_t>* bytes);

/// Size from the head of a PNG, JPEG or BMP file; the rest is not looked at. → ok, missing,
/// unreadable, not_an_image, torn
[[nodiscard]] ImageFileStatus read_image_size(const std::filesystem::path& file, ImageSize* size);

/// Reads the size from the first bytes of a file. → ok, not_an_image, torn
[[nodiscard]] ImageFileStatus read_image_size(std::span<const std::uint8_t> head,
                                              ImageSize* size) noexcept;

/// Checks that a PNG, JPEG or BMP is complete. Decoders fill what is missing with grey and say
/// nothing, and a half-grey image would be tracked as if it were the world: PNG chunks are walked
/// to IEND with their check sums, JPEG has to end with its end marker, BMP to hold its rows. → ok,
/// not_an_image, torn
[[nodiscard]] ImageFileStatus check_image(std::span<const std::uint8_t> bytes,
                                          ImageSize* size) noexcept;

/// The greatest sample of a grey PNG of 16 bits; nothing: another kind of image. One that cannot be
/// decoded has 0, as a black one. Takes memory for the image.
[[nodiscard]] std::optional<std::uint16_t> peak_of_deep_image(std::span<const std::uint8_t> bytes);

/// PNG of any depth and colour, JPEG of grey or three colours, or BMP of 8, 24 or 32 bits, PGM or
/// PPM → 8-bit grey, into size.height rows of `stride` bytes at `out`; no other copy is made. Any
/// number of threads at once. `deep_bits`: how many of the 16 bits of deep samples are used (8 …
/// 16). Not `ok`: content of `out` undefined. Throws nothing. → ok, not_an_image, torn,
/// undecodable, wrong_size
[[nodiscard]] ImageFileStatus decode_grey(std::span<const std::uint8_t> bytes, ImageSize size,
                                          std::uint8_t* out, std::size_t stride,
                                          int deep_bits = 16) noexcept;

}  // namespace vergence::app
