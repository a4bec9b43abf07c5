#include "firmware_iface/iidc/frame_info.hpp"

namespace vergence::iidc {

FrameInfoLayout FrameInfoLayout::of(std::uint32_t quadlet) noexcept {
  FrameInfoLayout layout;
  if ((quadlet & kFrameInfoPresent) == 0) return layout;
  for (unsigned i = 0; i < kFrameInfoItems; ++i) {
    if ((quadlet >> i & 1U) == 0) continue;
    layout.at_[i] = static_cast<std::int16_t>(layout.size_);
    layout.size_ += 4;
  }
  return layout;
}

std::uint32_t FrameInfoLayout::read(FrameInfoItem i,
                                    std::span<const std::uint8_t> image) const noexcept {
  const auto at = static_cast<std::size_t>(at_[static_cast<std::size_t>(i)]);
  return static_cast<std::uint32_t>(image[at]) << 24U |
         static_cast<std::uint32_t>(image[at + 1]) << 16U |
         static_cast<std::uint32_t>(image[at + 2]) << 8U | image[at + 3];
}

}  // namespace vergence::iidc
