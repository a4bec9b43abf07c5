#include "drivers/v4l2/capture_queue.hpp"

#include <linux/videodev2.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "drivers/v4l2/node.hpp"

namespace vergence::v4l2 {
namespace {

/// Description of a buffer with the one plane that a multi-plane queue requires.
struct Description {
  v4l2_buffer buffer{};
  v4l2_plane plane{};

  Description(std::uint32_t type, std::uint32_t index) noexcept {
    buffer.type = type;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = index;
    if (!planes()) return;
    buffer.m.planes = &plane;
    buffer.length = 1;
  }
  Description(const Description&) = delete;
  Description& operator=(const Description&) = delete;

  [[nodiscard]] bool planes() const noexcept { return V4L2_TYPE_IS_MULTIPLANAR(buffer.type); }
  [[nodiscard]] std::size_t length() const noexcept {
    return planes() ? plane.length : buffer.length;
  }
  [[nodiscard]] std::int64_t offset() const noexcept {
    return planes() ? plane.m.mem_offset : buffer.m.offset;
  }
  [[nodiscard]] std::size_t used() const noexcept {
    if (!planes()) return buffer.bytesused;
    return plane.bytesused - std::min(plane.data_offset, plane.bytesused);
  }
  [[nodiscard]] std::size_t first() const noexcept { return planes() ? plane.data_offset : 0; }
};

}  // namespace

Mapping::Mapping(Mapping&& o) noexcept
    : data_(std::exchange(o.data_, nullptr)), bytes_(std::exchange(o.bytes_, 0)) {}

Mapping& Mapping::operator=(Mapping&& o) noexcept {
  std::swap(data_, o.data_);
  std::swap(bytes_, o.bytes_);
  return *this;
}

Mapping::~Mapping() {
  if (data_ != nullptr) (void)::munmap(data_, bytes_);
}

int CaptureQueue::request(std::uint32_t requested, std::vector<Mapping>* mappings) {
  mappings->clear();
  v4l2_requestbuffers ask{};
  ask.count = requested;
  ask.type = type_;
  ask.memory = V4L2_MEMORY_MMAP;
  if (const int error = control(fd_, VIDIOC_REQBUFS, &ask); error != 0) return error;
  for (std::uint32_t i = 0; i < ask.count; ++i) {
    Description d(type_, i);
    if (const int error = control(fd_, VIDIOC_QUERYBUF, &d.buffer); error != 0) return error;
    void* at =
        ::mmap(nullptr, d.length(), PROT_READ, MAP_SHARED, fd_, static_cast<off_t>(d.offset()));
    if (at == MAP_FAILED) return errno;
    mappings->emplace_back(at, d.length());
    flags_ = d.buffer.flags;
  }
  return mappings->empty() ? ENOMEM : 0;
}

void CaptureQueue::free() noexcept {
  v4l2_requestbuffers ask{};
  ask.type = type_;
  ask.memory = V4L2_MEMORY_MMAP;
  (void)control(fd_, VIDIOC_REQBUFS, &ask);
}

int CaptureQueue::enqueue(std::uint32_t index) noexcept {
  Description d(type_, index);
  return control(fd_, VIDIOC_QBUF, &d.buffer);
}

int CaptureQueue::dequeue(Filled* filled) noexcept {
  Description d(type_, 0);
  if (const int error = control(fd_, VIDIOC_DQBUF, &d.buffer); error != 0) return error;
  *filled = {d.buffer.index,
             d.buffer.sequence,
             d.buffer.flags,
             static_cast<std::int64_t>(d.buffer.timestamp.tv_sec) * 1'000'000'000 +
                 static_cast<std::int64_t>(d.buffer.timestamp.tv_usec) * 1'000,
             d.used(),
             d.first()};
  return 0;
}

int CaptureQueue::start() noexcept {
  auto type = static_cast<int>(type_);
  return control(fd_, VIDIOC_STREAMON, &type);
}

int CaptureQueue::stop() noexcept {
  auto type = static_cast<int>(type_);
  return control(fd_, VIDIOC_STREAMOFF, &type);
}

}  // namespace vergence::v4l2
