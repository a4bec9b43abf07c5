#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/datasets/image_file.hpp"

namespace vergence::app {

/// Images that are no files of their own, by the names that a sequence gives them.
/// Threads  Any number at once, each with a workspace of its own.  Errors  As of image_file.hpp;
/// std::bad_alloc.
class ImageStore {
 public:
  virtual ~ImageStore() = default;
  /// → ok, missing
  [[nodiscard]] virtual ImageFileStatus size(const std::string& name, ImageSize* size) const = 0;
  /// Its greatest sample, where those have 16 bits; nothing: another kind of image. 0: one that
  /// says nothing, for it is missing, torn or black. *work: room that is used again.
  [[nodiscard]] virtual std::optional<std::uint16_t> peak(
      const std::string& name, std::vector<std::uint8_t>* work) const = 0;
  /// As decode_grey(); *work: room that is used again.
  [[nodiscard]] virtual ImageFileStatus decode(const std::string& name, ImageSize size,
                                               std::uint8_t* out, std::size_t stride, int deep_bits,
                                               std::vector<std::uint8_t>* work) const = 0;
};

}  // namespace vergence::app
