#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <thread>
#include <vector>

#include "app/recording/record_ring.hpp"
#include "app/recording/recording.hpp"
#include "core/types/image.hpp"
#include "drivers/common/wake_event.hpp"

namespace vergence::app {

/// Images into a recording as sensor_msgs/CompressedImage of PNG: who posts copies the pixels, a
/// thread of its own encodes them and posts the message into a queue of the recording.
///
/// Threads    post(): one. counters: any. close(): the owner's, after the last post() and before
///            the recording's close().
/// Memory     What waits: at construction. The encoder's thread takes heap as libpng does.
/// Full       As the recording: an image that finds no room is dropped and counted, or waited for.
/// Errors     The constructor throws std::system_error, std::bad_alloc.
class ImageEncoder {
 public:
  struct Options {
    std::size_t queue = 0;    // of the recording, the encoder's alone
    std::size_t waiting = 0;  // bytes of pixels that may wait to be encoded
    Recording::WhenFull when_full = Recording::WhenFull::drop;
  };
  /// `recording` outlives it.
  ImageEncoder(Recording& recording, const Options& options);
  ~ImageEncoder();
  ImageEncoder(const ImageEncoder&) = delete;
  ImageEncoder& operator=(const ImageEncoder&) = delete;

  /// `frame`, of the header, outlives the encoder. `crc`: of the pixels. False: dropped.
  [[nodiscard]] bool post(std::size_t topic, Stamp stamp, std::string_view frame,
                          const ImageView& image, std::uint32_t* crc) noexcept;
  /// Encodes what waits. Once.
  void close() noexcept;
  [[nodiscard]] std::uint64_t dropped() const noexcept {
    return dropped_.load(std::memory_order_relaxed);
  }
  /// Bytes of pixels that may wait.
  [[nodiscard]] std::size_t memory() const noexcept { return ring_.capacity(); }

 private:
  void work() noexcept;
  void encode(std::span<const std::uint8_t> waiting) noexcept;

  Recording& recording_;
  const Options options_;
  RecordRing ring_;
  std::vector<std::uint8_t> file_;  // of the encoder's thread
  std::atomic<std::uint64_t> dropped_{0};
  std::atomic<bool> stop_{false};
  WakeEvent filled_, freed_;
  std::thread thread_;
};

}  // namespace vergence::app
