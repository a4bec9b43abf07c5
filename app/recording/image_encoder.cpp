#include "app/recording/image_encoder.hpp"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstring>
#include <new>

#include "app/recording/messages.hpp"
#include "app/recording/png_encoder.hpp"

namespace vergence::app {
namespace {

constexpr int kEncoderNice = 5;  // as the recording's thread: poses come first

/// In front of an image's rows in the ring.
struct Head {
  std::size_t topic;
  Stamp stamp;
  std::string_view frame;
  int width, height;
  [[nodiscard]] std::size_t pixels() const noexcept {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
};

}  // namespace

ImageEncoder::ImageEncoder(Recording& recording, const Options& options)
    : recording_(recording),
      options_(options),
      ring_(options.waiting),
      thread_([this] { work(); }) {}

ImageEncoder::~ImageEncoder() { close(); }

bool ImageEncoder::post(std::size_t topic, Stamp stamp, std::string_view frame,
                        const ImageView& image, std::uint32_t* crc) noexcept {
  const Head head{topic, stamp, frame, image.width, image.height};
  const std::size_t size = sizeof head + head.pixels();
  std::span<std::uint8_t> room;
  for (;;) {
    const WakeEvent::Ticket seen = freed_.ticket();
    room = ring_.begin(size, 0);
    if (!room.empty() || size > ring_.capacity() || options_.when_full == Recording::WhenFull::drop)
      break;
    freed_.wait(seen);
  }
  if (room.empty()) {
    dropped_.fetch_add(1, std::memory_order_relaxed);
    return false;
  }
  std::memcpy(room.data(), &head, sizeof head);
  std::uint8_t* to = room.data() + sizeof head;
  const auto width = static_cast<std::size_t>(image.width);
  for (int y = 0; y < image.height; ++y, to += width) std::memcpy(to, image.row(y), width);
  *crc = crc32_of(room.subspan(sizeof head));
  ring_.commit(size);
  filled_.signal();
  return true;
}

void ImageEncoder::close() noexcept {
  if (!thread_.joinable()) return;
  stop_.store(true, std::memory_order_release);
  filled_.signal();
  thread_.join();
}

void ImageEncoder::work() noexcept {
  (void)pthread_setname_np(pthread_self(), "vergence-png");
  (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kEncoderNice);
  for (;;) {
    const WakeEvent::Ticket seen = filled_.ticket();
    const bool last = stop_.load(std::memory_order_acquire);
    const std::span<const std::uint8_t> waiting = ring_.waiting();
    if (!waiting.empty()) {
      encode(waiting);
      freed_.signal();
    } else if (last) {
      return;
    } else {
      filled_.wait(seen);
    }
  }
}

/// The oldest of the images that wait.
void ImageEncoder::encode(std::span<const std::uint8_t> waiting) noexcept {
  Head head{};
  std::memcpy(&head, waiting.data(), sizeof head);
  const ImageView image{waiting.data() + sizeof head, head.width, head.height, head.width};
  bool encoded = false;
  try {
    encoded = encode_png(image, &file_);
  } catch (const std::bad_alloc&) {  // counted below
  }
  ring_.release(sizeof head + head.pixels());
  if (!encoded) dropped_.fetch_add(1, std::memory_order_relaxed);
  const auto room = encoded
                        ? recording_.begin(options_.queue, head.topic, head.stamp,
                                           kMessageRoom + head.frame.size() + file_.size(), true)
                        : std::span<std::uint8_t>{};
  if (room.empty()) return;  // counted by the recording
  CdrWriter out(room);
  write_compressed_image(&out, head.stamp, head.frame, "png", file_);
  recording_.commit(options_.queue, out.ok() ? out.size() : 0);
}

}  // namespace vergence::app
