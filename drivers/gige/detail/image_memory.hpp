#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/memory/arena.hpp"
#include "drivers/camera.hpp"
#include "drivers/gige/detail/glib.hpp"
#include "drivers/gige/detail/grey.hpp"

namespace vergence::gige {

/// The slots of a camera's images, and the buffers that Aravis fills: the slots themselves where
/// the format is 8-bit grey, else a few beside them, from which images are converted.
///
/// Ownership  One reference to every buffer is this object's.
/// Threads    allocate(), clear(): the owner, while no stream is open. The others: any; pixels
///            belong to whom the SlotReturns say.
/// Memory     One arena, taken by allocate().
class ImageMemory {
 public:
  ImageMemory() = default;
  ~ImageMemory() { clear(); }
  ImageMemory(const ImageMemory&) = delete;
  ImageMemory& operator=(const ImageMemory&) = delete;

  /// For images of this size, of which `most` may be out with the consumer. `payload`: bytes of a
  /// frame on the wire.
  void allocate(const GreyFormat& format, int width, int height, std::size_t payload,
                std::size_t most);
  void clear() noexcept;

  [[nodiscard]] std::size_t slots() const noexcept { return slots_; }
  /// True if images are converted into the slots; otherwise buffer i is slot i.
  [[nodiscard]] bool converts() const noexcept { return converts_; }
  [[nodiscard]] const std::vector<ArvBuffer*>& buffers() const noexcept { return buffers_; }
  /// Which of buffers() it is.
  [[nodiscard]] static std::size_t index_of(ArvBuffer* buffer) noexcept;
  /// The image in buffer `index`, as grey into `slot`. Precondition: converts().
  void convert(const GreyFormat& format, std::size_t index, FrameSlot slot) noexcept;
  [[nodiscard]] ImageView view(FrameSlot slot) const noexcept;

 private:
  std::unique_ptr<Arena> arena_;
  std::span<std::uint8_t> pixels_;  // of the slots
  std::span<std::uint8_t> wire_;    // of the buffers where they are not the slots
  std::size_t slot_bytes_ = 0, wire_bytes_ = 0, slots_ = 0, stride_ = 0;
  int width_ = 0, height_ = 0;
  std::vector<ArvBuffer*> buffers_;
  bool converts_ = false;
};

}  // namespace vergence::gige
