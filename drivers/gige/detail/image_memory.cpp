#include "drivers/gige/detail/image_memory.hpp"

namespace vergence::gige {
namespace {

// Buffers in addition to the slots that may be out: one is filled while two wait.
constexpr std::size_t kSpare = 3;
// Number of wire buffers if every frame is converted immediately.
constexpr std::size_t kWireBuffers = 4;

constexpr std::size_t padded(std::size_t bytes) noexcept {
  return (bytes + kCacheLine - 1) / kCacheLine * kCacheLine;
}

}  // namespace

void ImageMemory::allocate(const GreyFormat& format, int width, int height, std::size_t payload,
                           std::size_t most) {
  clear();
  width_ = width;
  height_ = height;
  converts_ = format.how != GreyFormat::How::as_it_is;
  // When converting, one additional slot takes the frame that is then refused.
  slots_ = most + (converts_ ? 1 : kSpare);
  stride_ = converts_ ? FramePool::stride(width) : static_cast<std::size_t>(width);
  slot_bytes_ = converts_ ? stride_ * static_cast<std::size_t>(height) : padded(payload);
  wire_bytes_ = converts_ ? padded(payload) : 0;
  arena_ = std::make_unique<Arena>();
  pixels_ = arena_->make<std::uint8_t>(slots_ * slot_bytes_, "slots");
  wire_ = arena_->make<std::uint8_t>(kWireBuffers * wire_bytes_, "packets");
  // Exactly the payload: Aravis counts the packets of a frame by it.
  for (std::size_t i = 0; i < (converts_ ? kWireBuffers : slots_); ++i)
    buffers_.push_back(arv_buffer_new_full(
        payload, converts_ ? wire_.data() + i * wire_bytes_ : pixels_.data() + i * slot_bytes_,
        GSIZE_TO_POINTER(i), nullptr));
}

void ImageMemory::clear() noexcept {
  for (ArvBuffer* b : buffers_) g_object_unref(b);
  buffers_.clear();
}

std::size_t ImageMemory::index_of(ArvBuffer* buffer) noexcept {
  return static_cast<std::size_t>(
      reinterpret_cast<std::uintptr_t>(arv_buffer_get_user_data(buffer)));
}

void ImageMemory::convert(const GreyFormat& format, std::size_t index, FrameSlot slot) noexcept {
  to_grey(format, wire_.data() + index * wire_bytes_, width_, height_,
          pixels_.data() + slot * slot_bytes_, stride_);
}

ImageView ImageMemory::view(FrameSlot slot) const noexcept {
  return {pixels_.data() + slot * slot_bytes_, width_, height_,
          static_cast<std::ptrdiff_t>(stride_)};
}

}  // namespace vergence::gige
