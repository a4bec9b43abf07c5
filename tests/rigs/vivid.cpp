#include "tests/rigs/vivid.hpp"

#include <fcntl.h>
#include <linux/v4l2-dv-timings.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/mman.h>
#include <time.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "drivers/v4l2/controls.hpp"

namespace vergence::test {
namespace {

constexpr std::uint32_t kBuffers = 4;
// The frames of 59.94 Hz come 25 ms apart: the kernel of the rig counts time in ticks of 10 ms, of
// which one or two are rounded up.
constexpr std::int64_t kFrame_ns = 25'000'000;
// From a buffer's filling to its time: those before it in the queue, and half a frame of what is
// not known.
constexpr std::int64_t kAhead_ns = (kBuffers - 1) * kFrame_ns + kFrame_ns / 2;

[[noreturn]] void fail(const std::string& node, const std::string& what, int error) {
  throw std::runtime_error(node + ": " + what + ": " + std::strerror(error));
}

v4l2::UniqueFd open_rw(const std::string& node) {
  v4l2::UniqueFd fd(::open(node.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (!fd.valid()) fail(node, "open", errno);
  return fd;
}

void must(const std::string& node, int fd, unsigned long request, void* argument,
          const char* what) {
  if (const int error = v4l2::control(fd, request, argument); error != 0) fail(node, what, error);
}

void set_timings(const std::string& node) {
  const v4l2::UniqueFd fd = open_rw(node);
  v4l2_dv_timings t = V4L2_DV_BT_DMT_640X480P60;
  must(node, fd.get(), VIDIOC_S_DV_TIMINGS, &t, "timings");
}

std::int64_t now_ns() {
  timespec t{};
  (void)::clock_gettime(CLOCK_MONOTONIC, &t);
  return static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec;
}

v4l2_buffer description(std::uint32_t index) {
  v4l2_buffer b{};
  b.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  b.memory = V4L2_MEMORY_MMAP;
  b.index = index;
  b.field = V4L2_FIELD_NONE;
  b.bytesused = VividPlayer::kWidth * VividPlayer::kHeight;
  return b;
}

}  // namespace

void set_control(const std::string& node, const std::string& key, std::int64_t value) {
  const v4l2::UniqueFd fd = open_rw(node);
  v4l2::Controls controls;
  controls.add(fd.get());
  const v4l2::Control* c = controls.find(key);
  if (c == nullptr)
    throw std::runtime_error(node + ": there is no control " + key + "; it has " +
                             controls.keys(200));
  if (const int error = v4l2::write(*c, value); error != 0) fail(node, key, error);
}

void loop(const std::string& capture, const std::string& output) {
  set_timings(capture);
  set_timings(output);
  set_control(capture, "loop_video", 1);
  set_control(capture, "osd_text_mode", 2);  // else the frame's number is written over the image
}

VividPlayer::VividPlayer(const std::vector<std::string>& outputs, std::int64_t interval_ns,
                         Draw draw)
    : interval_ns_(interval_ns), draw_(std::move(draw)) {
  for (const std::string& node : outputs) {
    Output out;
    out.fd = open_rw(node);
    v4l2_format f{};
    f.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    f.fmt.pix.width = kWidth;
    f.fmt.pix.height = kHeight;
    f.fmt.pix.pixelformat = V4L2_PIX_FMT_GREY;
    f.fmt.pix.field = V4L2_FIELD_NONE;
    must(node, out.fd.get(), VIDIOC_S_FMT, &f, "format");
    if (f.fmt.pix.width != kWidth || f.fmt.pix.height != kHeight ||
        f.fmt.pix.bytesperline != kWidth)
      fail(node, "640 x 480", EINVAL);
    v4l2_requestbuffers ask{};
    ask.count = kBuffers;
    ask.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    ask.memory = V4L2_MEMORY_MMAP;
    must(node, out.fd.get(), VIDIOC_REQBUFS, &ask, "buffers");
    for (std::uint32_t i = 0; i < ask.count; ++i) {
      v4l2_buffer b = description(i);
      must(node, out.fd.get(), VIDIOC_QUERYBUF, &b, "buffer");
      void* at =
          ::mmap(nullptr, b.length, PROT_READ | PROT_WRITE, MAP_SHARED, out.fd.get(), b.m.offset);
      if (at == MAP_FAILED) fail(node, "mmap", errno);
      out.buffers.push_back(std::span(static_cast<std::uint8_t*>(at), b.length)
                                .first(static_cast<std::size_t>(kWidth) * kHeight));
    }
    outputs_.push_back(std::move(out));
  }
  for (std::size_t k = 0; k < outputs_.size(); ++k) {
    for (std::uint32_t i = 0; i < outputs_[k].buffers.size(); ++i) {
      draw_(k, 0, outputs_[k].buffers[i]);
      v4l2_buffer b = description(i);
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

void VividPlayer::feed() {
  const auto due = [this] {
    return static_cast<std::uint64_t>((now_ns() + kAhead_ns - interval_ns_ / 2) / interval_ns_);
  };
  const std::uint64_t first = due();
  std::vector<pollfd> looks;
  for (const Output& out : outputs_) looks.push_back({out.fd.get(), POLLOUT, 0});
  while (!stop_) {
    (void)::poll(looks.data(), looks.size(), 100);
    for (std::size_t k = 0; k < outputs_.size(); ++k) {
      Output& out = outputs_[k];
      v4l2_buffer b = description(0);
      while (v4l2::control(out.fd.get(), VIDIOC_DQBUF, &b) == 0) {
        out.last = due() - first;
        draw_(k, out.last, out.buffers[b.index]);
        b = description(b.index);
        if (v4l2::control(out.fd.get(), VIDIOC_QBUF, &b) != 0) return;
      }
    }
    shown_ =
        std::min_element(outputs_.begin(), outputs_.end(), [](const Output& a, const Output& b) {
          return a.last < b.last;
        })->last;
  }
}

}  // namespace vergence::test
