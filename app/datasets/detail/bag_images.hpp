#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "app/datasets/detail/bag_index.hpp"
#include "app/datasets/image_store.hpp"

namespace vergence::app::detail {

/// The images of two topics of a bag, loaded when they are asked for. A camera's chunk stays
/// unpacked until its next one is wanted.
/// Memory  Some 80 bytes an image, and twice kMostChunk a camera at most.
class BagImages final : public ImageStore {
 public:
  /// `topics`, `images`: left, right.
  BagImages(BagFormat format, std::vector<BagFile> files, std::array<std::string, 2> topics,
            std::array<std::vector<BagImage>, 2> images) noexcept;

  /// What names image `index` of camera `camera`: `left/image_raw#12`.
  [[nodiscard]] std::string name(std::size_t camera, std::size_t index) const;
  [[nodiscard]] ImageFileStatus size(const std::string& name, ImageSize* size) const override;
  [[nodiscard]] ImageFileStatus decode(const std::string& name, ImageSize size, std::uint8_t* out,
                                       std::size_t stride,
                                       std::vector<std::uint8_t>* work) const override;

 private:
  /// The chunk that a camera's last image was in.
  struct Unpacked {
    std::mutex one_at_a_time;
    std::uint32_t file = 0;
    std::uint64_t chunk = 0;
    std::vector<std::uint8_t> records;
  };
  /// Nothing: no such image.
  [[nodiscard]] const BagImage* find(const std::string& name, std::size_t* camera) const noexcept;
  [[nodiscard]] bool load(const BagImage& entry, Unpacked* unpacked,
                          std::vector<std::uint8_t>* data) const;

  BagFormat format_;
  std::vector<BagFile> files_;
  std::array<std::string, 2> topics_;
  std::array<std::vector<BagImage>, 2> images_;
  mutable std::array<Unpacked, 2> unpacked_;
};

}  // namespace vergence::app::detail
