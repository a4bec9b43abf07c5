#include "app/datasets/frame_decoder.hpp"

#include <pthread.h>

#include <algorithm>
#include <cassert>
#include <chrono>

#include "app/datasets/text_file.hpp"
#include "core/types/bayer.hpp"

namespace vergence::app {
namespace {

using Clock = std::chrono::steady_clock;

/// Kinds of events, by ImageFileStatus.
constexpr std::array kKinds{"",
                            "image_missing",
                            "image_unreadable",
                            "image_unreadable",
                            "image_unreadable",
                            "image_truncated",
                            "image_unreadable",
                            "image_size"};

void set_issue(DecodedPair* pair, const char* kind, const std::string& message) {
  pair->kind = kind;
  const std::size_t n = std::min(message.size(), pair->issue.size() - 1);
  std::copy_n(message.begin(), n, pair->issue.begin());
  pair->issue[n] = 0;
}

}  // namespace

FrameDecoder::FrameDecoder(const StereoSequence& sequence, std::size_t first, std::size_t count,
                           FramePool& pool)
    : sequence_(sequence),
      next_index_(std::min(first, sequence.pairs.size())),
      end_(next_index_ + std::min(count, sequence.pairs.size() - next_index_)),
      pool_(pool) {
  assert(pool.width() == sequence.calibration.intrinsics[0].width &&
         pool.height() == sequence.calibration.intrinsics[0].height);
  if (sequence.bayer)
    for (Workspace& work : workspaces_)
      work.mosaic.resize(FramePool::stride(pool.width()) * static_cast<std::size_t>(pool.height()));
  if (sequence.side_by_side)
    workspaces_[0].mosaic.resize(FramePool::stride(2 * pool.width()) *
                                 static_cast<std::size_t>(pool.height()));
  thread_ = std::thread([this] { work(); });
}

FrameDecoder::~FrameDecoder() {
  stop();
  thread_.join();
}

bool FrameDecoder::next(DecodedPair* pair) noexcept {
  for (;;) {
    const WakeEvent::Ticket seen = filled_.ticket();
    if (stop_.load(std::memory_order_acquire)) return false;
    // `finished_` is read before the ring, so that pairs pushed before it was set are still found.
    const bool finished = finished_.load(std::memory_order_acquire);
    if (ring_.pop(pair)) {
      freed_.signal();
      return true;
    }
    if (finished) return false;
    filled_.wait(seen);
  }
}

void FrameDecoder::release(const DecodedPair& pair) noexcept {
  if (!pair.decoded) return;
  for (const FrameSlot slot : pair.slots) pool_.release(slot);
  freed_.signal();
}

void FrameDecoder::stop() noexcept {
  stop_.store(true, std::memory_order_release);
  filled_.signal();
  freed_.signal();
}

void FrameDecoder::work() {
  (void)pthread_setname_np(pthread_self(), "vergence-decode");
  for (; next_index_ < end_; ++next_index_) {
    for (; own_count_ < own_.size(); ++own_count_) {
      std::optional<FrameSlot> free;
      if (!wait_until([&] { return (free = pool_.acquire()).has_value(); })) return;
      own_[own_count_] = *free;
    }
    const DecodedPair pair = decode(next_index_);
    if (!wait_until([&] { return ring_.push(pair); })) return;
    filled_.signal();
  }
  finished_.store(true, std::memory_order_release);
  filled_.signal();
}

DecodedPair FrameDecoder::decode(std::size_t index) {
  const auto start = Clock::now();
  const StereoPair& listed = sequence_.pairs[index];
  DecodedPair pair{.frame = index, .stamp = listed.stamp};
  const bool late = newest_ && listed.stamp <= *newest_;
  if (late || !listed.in_order) {
    set_issue(
        &pair, late ? "stamp_not_increasing" : "stamp_outlier",
        fmt::format(
            "frame {} skipped: its time {} is {}", index, format_seconds(listed.stamp.ns()),
            late ? "not later than " + format_seconds(newest_->ns()) + ", the latest before it"
                 : "later than those of the frames after it"));
    return pair;
  }
  newest_ = listed.stamp;
  std::array<ImageFileStatus, 2> status{};
  if (sequence_.side_by_side) {
    status[0] = load_both(listed.file[0], &workspaces_[0]);
  } else {
    auto left = [&] { status[0] = load(listed.file[0], own_[0], &workspaces_[0]); };
    auto right = [&] { status[1] = load(listed.file[1], own_[1], &workspaces_[1]); };
    both_.run(TaskRef(left), TaskRef(right));
  }
  for (std::size_t k = 0; k < 2; ++k) {
    if (status[k] == ImageFileStatus::ok) continue;
    const std::string name = !listed.file[k].empty() ? listed.file[k]
                             : k == 0                ? "the left image"
                                                     : "the right image";
    set_issue(&pair, kKinds.at(static_cast<std::size_t>(status[k])),
              fmt::format("frame {} skipped: {} {}", index, name, to_phrase(status[k])));
    return pair;
  }
  pair.slots = own_;
  pair.decoded = true;
  own_count_ = 0;
  pair.decode_ms = std::chrono::duration<float, std::milli>(Clock::now() - start).count();
  return pair;
}

ImageFileStatus FrameDecoder::load(const std::string& name, FrameSlot slot, Workspace* work) {
  const ImageSize size{pool_.width(), pool_.height()};
  const std::size_t stride = FramePool::stride(size.width);
  std::uint8_t* out = pool_.writable(slot).data();
  const auto status =
      decode_image(sequence_, name, size, sequence_.bayer ? work->mosaic.data() : out, stride,
                   sequence_.deep_bits, &work->bytes);
  const auto step = static_cast<std::ptrdiff_t>(stride);
  if (sequence_.bayer && status == ImageFileStatus::ok)
    bayer_to_grey(work->mosaic.data(), step, size.width, size.height, out, step);
  return status;
}

ImageFileStatus FrameDecoder::load_both(const std::string& name, Workspace* work) {
  const int width = pool_.width(), height = pool_.height();
  const std::size_t stride = FramePool::stride(width), wide = FramePool::stride(2 * width);
  const auto status = decode_image(sequence_, name, {2 * width, height}, work->mosaic.data(), wide,
                                   sequence_.deep_bits, &work->bytes);
  if (status != ImageFileStatus::ok) return status;
  for (std::size_t k = 0; k < 2; ++k) {
    std::uint8_t* out = pool_.writable(own_[k]).data();
    const std::uint8_t* from = work->mosaic.data() + k * static_cast<std::size_t>(width);
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y)
      std::copy_n(from + y * wide, width, out + y * stride);
  }
  return status;
}

template <class Attempt>
bool FrameDecoder::wait_until(const Attempt& attempt) noexcept {
  for (;;) {
    const WakeEvent::Ticket seen = freed_.ticket();
    if (stop_.load(std::memory_order_acquire)) return false;
    if (attempt()) return true;
    freed_.wait(seen);
  }
}

}  // namespace vergence::app
