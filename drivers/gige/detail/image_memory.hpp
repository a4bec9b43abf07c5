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

/// Slots of a camera's images, and the buffers that Aravis fills. For 8-bit grey these are the
/// slots themselves; otherwise a few separate buffers, which are converted into slots.
///
/// Ownership  Holds one reference to every buffer.
/// Threads    The owner calls allocate() and clear() while no stream is open. The other functions
///            are thread-safe; SlotReturns tracks who may access the pixels.
/// Memory     One arena, taken by allocate().
class ImageMemory {
 public:
  ImageMemory() = default;
  ~ImageMemory() { clear(); }
  ImageMemory(const ImageMemory&) = delete;
  ImageMemory& operator=(const ImageMemory&) = delete;

  /// Allocates for images of this size, of which the consumer may hold `most`. `payload` is the
  /// size of a frame on the wire, in bytes.
  void allocate(const GreyFormat& format, int width, int height, std::size_t payload,
                std::size_t most);
  void clear() noexcept;

  [[nodiscard]] std::size_t slots() const noexcept { return slots_; }
  /// True if images are converted into the slots; otherwise buffer i is slot i.
  [[nodiscard]] bool converts() const noexcept { return converts_; }
  [[nodiscard]] const std::vector<ArvBuffer*>& buffers() const noexcept { return buffers_; }
  /// Index of the buffer in buffers().
  [[nodiscard]] static std::size_t index_of(ArvBuffer* buffer) noexcept;
  /// Converts the image in buffer `index` to grey into `slot`. Precondition: converts().
  void convert(const GreyFormat& format, std::size_t index, FrameSlot slot) noexcept;
  [[nodiscard]] ImageView view(FrameSlot slot) const noexcept;

 private:
  std::unique_ptr<Arena> arena_;
  // Pixels of the slots.
  std::span<std::uint8_t> pixels_;
  // Memory of the buffers if they are not the slots.
  std::span<std::uint8_t> wire_;
  std::size_t slot_bytes_ = 0, wire_bytes_ = 0, slots_ = 0, stride_ = 0;
  int width_ = 0, height_ = 0;
  std::vector<ArvBuffer*> buffers_;
  bool converts_ = false;
};

}  // namespace vergence::gige
