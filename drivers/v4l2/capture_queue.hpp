#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace vergence::v4l2 {

/// A piece of a driver's buffer memory in our address space.
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
  std::size_t bytes = 0;  // that came
  std::size_t offset =
      0;  // of the first pixel in the buffer: some drivers put a header before the image
};

/// The kernel's queue of capture buffers of one open node, single plane or a multi-plane queue of
/// one plane.
///
/// Ownership  The descriptor stays the caller's and open longer than this.
/// Errors     Every call → 0 or the errno.
class CaptureQueue {
 public:
  CaptureQueue(int fd, std::uint32_t type) noexcept : fd_(fd), type_(type) {}

  /// About `requested` buffers, which the kernel may change, each mapped: (*mappings)[index].
  [[nodiscard]] int request(std::uint32_t requested, std::vector<Mapping>* mappings);
  /// Flags of the buffers as they lie there: the kind of their stamps.
  [[nodiscard]] std::uint32_t description_flags() const noexcept { return flags_; }
  /// Gives all buffers back; mappings still held stay valid.
  void free() noexcept;
  [[nodiscard]] int enqueue(std::uint32_t index) noexcept;
  /// EAGAIN: none is filled.
  [[nodiscard]] int dequeue(Filled* filled) noexcept;
  [[nodiscard]] int start() noexcept;
  /// All buffers are ours again.
  int stop() noexcept;

 private:
  int fd_;
  std::uint32_t type_;
  std::uint32_t flags_ = 0;
};

}  // namespace vergence::v4l2
