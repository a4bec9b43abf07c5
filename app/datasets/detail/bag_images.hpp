#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "app/datasets/detail/bag_index.hpp"
#include "app/datasets/image_file.hpp"

namespace vergence::app::detail {

/// The images of two topics of a bag by the names that a sequence gives them, loaded when they are
/// asked for. The two chunks used last stay
/// unpacked: the two images of a pair mostly lie in one.
/// Threads  Any number at once, each with a workspace of its own.  Errors  As of image_file.hpp;
/// std::bad_alloc.
/// Memory  Some 80 bytes an image, and four times kMaxChunk at most.
class BagImages {
 public:
  /// `topics`, `images`: left, right.
  BagImages(BagFormat format, std::vector<BagFile> files, std::array<std::string, 2> topics,
            std::array<std::vector<BagImage>, 2> images) noexcept;

  /// Returns the name of image `index` of camera `camera`: `left/image_raw#12`.
  [[nodiscard]] std::string name(std::size_t camera, std::size_t index) const;
  /// → ok, missing
  [[nodiscard]] ImageFileStatus size(const std::string& name, ImageSize* size) const;
  /// Its greatest sample, where those have 16 bits; nothing: another kind of image. 0: one that
  /// says nothing, for it is missing, torn or black. *work: room that is used again.
  [[nodiscard]] std::optional<std::uint16_t> peak(const std::string& name,
                                                  std::vector<std::uint8_t>* work) const;
  /// As decode_grey(); *work: room that is used again.
  [[nodiscard]] ImageFileStatus decode(const std::string& name, ImageSize size, std::uint8_t* out,
                                       std::size_t stride, int deep_bits,
                                       std::vector<std::uint8_t>* work) const;

 private:
  struct Unpacked {
    std::uint32_t file = 0;
    std::uint64_t chunk = BagPlace::kNoChunk;
    std::shared_ptr<const std::vector<std::uint8_t>> records{};
  };
  /// Nothing: no such image.
  [[nodiscard]] const BagImage* find(const std::string& name, std::size_t* camera) const noexcept;
  [[nodiscard]] bool load(const BagImage& entry, std::vector<std::uint8_t>* data) const;
  /// Records of the image's chunk; null: it does not unpack.
  [[nodiscard]] std::shared_ptr<const std::vector<std::uint8_t>> unpacked(
      const BagImage& entry) const;

  BagFormat format_;
  std::vector<BagFile> files_;
  std::array<std::string, 2> topics_;
  std::array<std::vector<BagImage>, 2> images_;
  mutable std::mutex mutex_;                  // with unpacked_
  mutable std::array<Unpacked, 2> unpacked_;  // the newer one first
};

}  // namespace vergence::app::detail
