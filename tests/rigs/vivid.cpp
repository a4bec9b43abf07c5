#include "tests/rigs/vivid.hpp"

#include <fcntl.h>
#include <linux/v4l2-dv-timings.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/mman.h>
#include <time.h>

#include <cerrno>
#include <stdexcept>

#include "drivers/v4l2/controls.hpp"

namespace vergence::test {
namespace {

constexpr std::uint32_t kBuffers = 4;
// Frames of 59.94 Hz come 25 ms apart, those of 30 Hz 40 ms: the kernel of the rig counts time in
// ticks of 10 ms, of which one or two are rounded up.
constexpr std::int64_t frame_ns(LoopSize size) noexcept {
  return size == LoopSize::vga ? 25'000'000 : 40'000'000;
}
// From a buffer's filling to its time: those before it in the queue, and half a frame of what is
// not known.
constexpr std::int64_t ahead_ns(LoopSize size) noexcept {
  return (kBuffers - 1) * frame_ns(size) + frame_ns(size) / 2;
}

[[noreturn]] void fail(const std::string& node, const std::string& what, int error) {
  throw std::runtime_error(node + ": " + what + ": " + std::strerror(error));
}

UniqueFd open_rw(const std::string& node) {
  UniqueFd fd(::open(node.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (!fd.valid()) fail(node, "open", errno);
  return fd;
}

void must(const std::string& node, int fd, unsigned long request, void* argument,
          const char* what) {
  if (const int error = v4l2::control(fd, request, argument); error != 0) fail(node, what, error);
}

void set_timings(const std::string& node, LoopSize size) {
  const UniqueFd fd = open_rw(node);
  v4l2_dv_timings vga = V4L2_DV_BT_DMT_640X480P60;
  v4l2_dv_timings hd = V4L2_DV_BT_CEA_1280X720P30;
  v4l2_dv_timings& t = size == LoopSize::vga ? vga : hd;
  must(node, fd.get(), VIDIOC_S_DV_TIMINGS, &t, "timings");
}

std::int64_t now_ns() {
  timespec t{};
  (void)::clock_gettime(CLOCK_MONOTONIC, &t);
  return static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec;
}

v4l2_buffer description(std::uint32_t index, std::uint32_t bytes) {
  v4l2_buffer b{};
  b.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  b.memory = V4L2_MEMORY_MMAP;
  b.index = index;
  b.field = V4L2_FIELD_NONE;
  b.bytesused = bytes;
  return b;
}

}  // namespace

void set_control(const std::string& node, const std::string& key, std::int64_t value) {
  const UniqueFd fd = open_rw(node);
  v4l2::Controls controls;
  controls.add(fd.get());
  const v4l2::Control* c = controls.find(key);
  if (c == nullptr)
    throw std::runtime_error(node + ": there is no control " + key + "; it has " +
                             controls.keys(200));
  if (const int error = v4l2::write(*c, value); error != 0) fail(node, key, error);
}

void loop(const std::string& capture, const std::string& output, LoopSize size) {
  set_timings(capture, size);
  set_timings(output, size);
  set_control(capture, "loop_video", 1);
  // With other modes, the frame's number is written over the image.
  set_control(capture, "osd_text_mode", 2);
}

VividPlayer::VividPlayer(const std::vector<std::string>& outputs, std::int64_t interval_ns,
                         Draw draw, LoopSize size)
    : interval_ns_(interval_ns),
      ahead_ns_(ahead_ns(size)),
      draw_(std::move(draw)),
      image_bytes_(static_cast<std::uint32_t>(width_of(size) * height_of(size))) {
  const auto width = static_cast<std::uint32_t>(width_of(size));
  const auto height = static_cast<std::uint32_t>(height_of(size));
  for (const std::string& node : outputs) {
    Output out;
    out.fd = open_rw(node);
    v4l2_format f{};
    f.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    f.fmt.pix.width = width;
    f.fmt.pix.height = height;
    f.fmt.pix.pixelformat = V4L2_PIX_FMT_GREY;
    f.fmt.pix.field = V4L2_FIELD_NONE;
    must(node, out.fd.get(), VIDIOC_S_FMT, &f, "format");
    if (f.fmt.pix.width != width || f.fmt.pix.height != height || f.fmt.pix.bytesperline != width)
      fail(node, std::to_string(width) + " x " + std::to_string(height), EINVAL);
    v4l2_requestbuffers ask{};
    ask.count = kBuffers;
    ask.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    ask.memory = V4L2_MEMORY_MMAP;
    must(node, out.fd.get(), VIDIOC_REQBUFS, &ask, "buffers");
    for (std::uint32_t i = 0; i < ask.count; ++i) {
      v4l2_buffer b = description(i, image_bytes_);
      must(node, out.fd.get(), VIDIOC_QUERYBUF, &b, "buffer");
      void* at =
          ::mmap(nullptr, b.length, PROT_READ | PROT_WRITE, MAP_SHARED, out.fd.get(), b.m.offset);
      if (at == MAP_FAILED) fail(node, "mmap", errno);
      out.buffers.push_back(
          std::span(static_cast<std::uint8_t*>(at), b.length).first(image_bytes_));
    }
    outputs_.push_back(std::move(out));
  }
  for (std::size_t k = 0; k < outputs_.size(); ++k) {
    outputs_[k].numbers.assign(outputs_[k].buffers.size(), 0);
    outputs_[k].next_from_ns = outputs_[k].looked_ns = now_ns();
    for (std::uint32_t i = 0; i < outputs_[k].buffers.size(); ++i) {
      draw_(k, 0, outputs_[k].buffers[i]);
      v4l2_buffer b = description(i, image_bytes_);
      must(outputs[k], outputs_[k].fd.get(), VIDIOC_QBUF, &b, "queue");
    }
    int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    must(outputs[k], outputs_[k].fd.get(), VIDIOC_STREAMON, &type, "start");
  }
  thread_ = std::thread([this] { feed(); });
}

VividPlayer::~VividPlayer() {
  stop();
  for (const Output& out : outputs_)
    for (const std::span<std::uint8_t>& b : out.buffers) (void)::munmap(b.data(), b.size());
}

void VividPlayer::stop() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

std::uint64_t VividPlayer::due() const noexcept {
  return static_cast<std::uint64_t>((now_ns() + ahead_ns_ - interval_ns_ / 2) / interval_ns_);
}

/// Draws into every buffer that is back, and queues it again. False: the output is gone.
bool VividPlayer::refill(std::size_t output, std::uint64_t first) {
  Output& out = outputs_[output];
  const std::int64_t looked_before_ns = out.looked_ns;
  std::size_t back = 0;
  v4l2_buffer b = description(0, image_bytes_);
  while (v4l2::control(out.fd.get(), VIDIOC_DQBUF, &b) == 0) {
    const std::int64_t now = now_ns();
    out.showings.push_back({out.numbers[b.index], out.next_from_ns, now});
    out.current = (b.index + 1) % out.buffers.size();
    out.next_from_ns = looked_before_ns;
    const std::uint64_t number = due() - first;
    draw_(output, number, out.buffers[b.index]);
    out.numbers[b.index] = static_cast<std::int64_t>(number);
    // With as many back as there are, the queue was empty from some moment on until this one.
    if (++back >= out.buffers.size()) out.showings.push_back({kNoise, looked_before_ns, now_ns()});
    b = description(b.index, image_bytes_);
    if (v4l2::control(out.fd.get(), VIDIOC_QBUF, &b) != 0) return false;
  }
  out.looked_ns = now_ns();
  return true;
}

void VividPlayer::feed() {
  const std::uint64_t first = due();
  std::vector<pollfd> looks;
  for (const Output& out : outputs_) looks.push_back({out.fd.get(), POLLOUT, 0});
  while (!stop_) {
    (void)::poll(looks.data(), looks.size(), 100);
    for (std::size_t k = 0; k < outputs_.size(); ++k)
      if (!refill(k, first)) return;
  }
  for (Output& out : outputs_)
    out.showings.push_back({out.numbers[out.current], out.next_from_ns, now_ns()});
}

}  // namespace vergence::test
