#pragma once
#include <array>
#include <mutex>

#include "app/datasets/detail/bag_index.hpp"
#include "app/datasets/image_file.hpp"

namespace vergence::app::detail {

/// Images of two topics of a bag by their names in a sequence, loaded on request. The last two
/// chunks stay unpacked, because the images of a pair are mostly in one. Thread-safe with a
/// workspace per thread. Uses some 80 bytes per image, and at most four times kMaxChunk. Errors as
/// in image_file.hpp, and std::bad_alloc.
class BagImages {
 public:
  /// `topics` and `images` are left and right.
  BagImages(BagFormat format, std::vector<BagFile> files, std::array<std::string, 2> topics,
            std::array<std::vector<BagImage>, 2> images) noexcept;

  /// Returns the name of image `index` of camera `camera`: `left/image_raw#12`.
  [[nodiscard]] std::string name(std::size_t camera, std::size_t index) const;
  /// → ok, missing
  [[nodiscard]] ImageFileStatus size(const std::string& name, ImageSize* size) const;
  /// Same contract as decode_grey(); *work is reused memory.
  [[nodiscard]] ImageFileStatus decode(const std::string& name, ImageSize size, std::uint8_t* out,
                                       std::size_t stride, int deep_bits,
                                       std::vector<std::uint8_t>* work) const;

 private:
  struct Unpacked {
    std::uint32_t file = 0;
    std::uint64_t chunk = BagPlace::kNoChunk;
    std::shared_ptr<const std::vector<std::uint8_t>> records{};
  };
  /// Returns null if there is no such image.
  [[nodiscard]] const BagImage* find(const std::string& name, std::size_t* camera) const noexcept;
  [[nodiscard]] bool load(const BagImage& entry, std::vector<std::uint8_t>* data) const;
  /// Records of the image's chunk; null: it does not unpack.
  [[nodiscard]] std::shared_ptr<const std::vector<std::uint8_t>> unpacked(
      const BagImage& entry) const;

  BagFormat format_;
  std::vector<BagFile> files_;
  std::array<std::string, 2> topics_;
  std::array<std::vector<BagImage>, 2> images_;
  // Guards unpacked_.
  mutable std::mutex mutex_;
  // The newer one is first.
  mutable std::array<Unpacked, 2> unpacked_;
};

}  // namespace vergence::app::detail
