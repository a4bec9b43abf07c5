#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace vergence::v4l2 {

/// Buffer memory of a driver, mapped into this process.
class Mapping {
 public:
  Mapping() noexcept = default;
  Mapping(void* data, std::size_t bytes) noexcept
      : data_(static_cast<std::uint8_t*>(data)), bytes_(bytes) {}
  Mapping(Mapping&& o) noexcept;
  Mapping& operator=(Mapping&& o) noexcept;
  ~Mapping();
  [[nodiscard]] const std::uint8_t* data() const noexcept { return data_; }
  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }

 private:
  std::uint8_t* data_ = nullptr;
  std::size_t bytes_ = 0;
};

/// A filled buffer.
struct Filled {
  std::uint32_t index = 0;
  std::uint32_t sequence = 0;
  std::uint32_t flags = 0;
  std::int64_t stamp_ns = 0;
  /// Number of bytes received.
  std::size_t bytes = 0;
  /// Offset of the first pixel, because some drivers put a header before the image.
  std::size_t offset = 0;
};

/// The kernel's queue of capture buffers of one open node: single-plane, or multi-plane with one
/// plane.
///
/// Does not own the descriptor, which must stay open longer. Every call returns 0 or the errno.
class CaptureQueue {
 public:
  CaptureQueue(int fd, std::uint32_t type) noexcept : fd_(fd), type_(type) {}

  /// Requests this number of buffers, which the kernel may change. Buffer i is mapped as
  /// (*mappings)[i].
  [[nodiscard]] int request(std::uint32_t requested, std::vector<Mapping>* mappings);
  /// Flags of the buffers before use; they tell the kind of stamps.
  [[nodiscard]] std::uint32_t description_flags() const noexcept { return flags_; }
  /// Frees all buffers; mappings still held stay valid.
  void free() noexcept;
  [[nodiscard]] int enqueue(std::uint32_t index) noexcept;
  /// Returns EAGAIN if no buffer is filled.
  [[nodiscard]] int dequeue(Filled* filled) noexcept;
  [[nodiscard]] int start() noexcept;
  /// Stops the stream and takes all buffers back from the kernel.
  int stop() noexcept;

 private:
  int fd_;
  std::uint32_t type_;
  std::uint32_t flags_ = 0;
};

}  // namespace vergence::v4l2
