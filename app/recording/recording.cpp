#include "app/recording/recording.hpp"

#include <pthread.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <system_error>

#include "app/runtime/file_descriptor.hpp"
#include "core/memory/allocation_guard.hpp"
#include "drivers/clock.hpp"

namespace vergence::app {

namespace {

[[noreturn]] void fail(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

using namespace std::chrono_literals;

// Interval of checking the queues.
constexpr auto kPollInterval = 20ms;
// Maximum time that a message waits for its chunk. With the polling interval and the write it stays
// below 100 ms.
constexpr std::int64_t kMaxWaitNs = 40'000'000;
// Half of the readers' limit.
constexpr std::size_t kMaxChunkBytes = std::size_t{32} << 20;
// Space of a queue that large messages leave free.
constexpr std::size_t kSpare = std::size_t{1} << 20;
// Poses take precedence; recorded data wait in memory.
constexpr int kNice = 5;

/// Fill limit of a queue while nothing is written. A producer that does not wait finds room for an
/// image; one that waits (`hurried`) finds room for anything that fits.
std::size_t room_left_at(const RecordRing& ring, bool hurried) noexcept {
  return hurried ? ring.capacity() / 4 : ring.capacity() / 8 * 7;
}

McapMessageHead read_head(std::span<const std::uint8_t> records) noexcept {
  return McapMessageHead::read(records.first<McapMessageHead::kSize>());
}

}  // namespace

RecordRing::RecordRing(std::size_t bytes) {
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  capacity_ = (std::max<std::size_t>(bytes, 1) + page - 1) / page * page;
  // The mappings keep the memory.
  const FileDescriptor memory(::memfd_create("vergence-record", MFD_CLOEXEC));
  if (!memory || ::ftruncate(memory.get(), static_cast<off_t>(capacity_)) != 0)
    fail("memory for the recording's queue");
  void* both = ::mmap(nullptr, 2 * capacity_, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (both == MAP_FAILED) fail("address space for the recording's queue");
  memory_ = static_cast<std::uint8_t*>(both);
  for (std::size_t at : {std::size_t{0}, capacity_})
    if (::mmap(memory_ + at, capacity_, PROT_READ | PROT_WRITE,
               MAP_SHARED | MAP_FIXED | MAP_POPULATE, memory.get(), 0) == MAP_FAILED) {
      const int error = errno;
      ::munmap(memory_, 2 * capacity_);
      errno = error;
      fail("memory for the recording's queue");
    }
}

RecordRing::~RecordRing() { ::munmap(memory_, 2 * capacity_); }

std::span<std::uint8_t> RecordRing::begin(std::size_t size, std::size_t spare) noexcept {
  const Count tail = tail_.load(std::memory_order_relaxed);
  const std::size_t free =
      capacity_ - static_cast<std::size_t>(tail - head_.load(std::memory_order_acquire));
  if (size > free || spare > free - size) return {};
  return {place(tail), size};
}

void RecordRing::commit(std::size_t size) noexcept {
  const Count tail = tail_.load(std::memory_order_relaxed) + size;
  const auto waiting = static_cast<std::size_t>(tail - head_.load(std::memory_order_relaxed));
  if (waiting > high_water_.load(std::memory_order_relaxed))
    high_water_.store(waiting, std::memory_order_relaxed);
  tail_.store(tail, std::memory_order_release);
}

std::span<const std::uint8_t> RecordRing::waiting() const noexcept {
  const Count head = head_.load(std::memory_order_relaxed);
  return {place(head), static_cast<std::size_t>(tail_.load(std::memory_order_acquire) - head)};
}

void RecordRing::release(std::size_t size) noexcept {
  head_.store(head_.load(std::memory_order_relaxed) + size, std::memory_order_release);
}

Recording::Recording(const std::filesystem::path& folder, const Options& options)
    : options_(options), sequences_(options.files.topics.size()), files_(folder, options.files) {
  assert(options_.queues.size() <= McapFile::kMaxParts);
  for (const std::size_t bytes : options_.queues) queues_.push_back(std::make_unique<Queue>(bytes));
  thread_ = std::thread([this] { work(); });
}

Recording::~Recording() { close(); }

// ---- producers

std::span<std::uint8_t> Recording::begin(std::size_t queue, std::size_t topic, Stamp stamp,
                                         std::size_t most, bool bulky) noexcept {
  Queue& q = *queues_[queue];
  q.head.channel = static_cast<std::uint16_t>(topic + 1);
  // A dropped message leaves a gap in the sequence.
  q.head.sequence = sequences_[topic]++;
  q.head.log_time = static_cast<std::uint64_t>(std::max<std::int64_t>(stamp.ns(), 0));
  const std::size_t size = McapMessageHead::kSize + most;
  const std::size_t spare = bulky ? std::min(kSpare, q.ring.capacity() / 8) : 0;
  const bool fits = size <= q.ring.capacity() / 2 && size <= kMaxChunkBytes;
  for (;;) {
    const WakeEvent::Ticket seen = freed_.ticket();
    q.open = fits ? q.ring.begin(size, spare) : std::span<std::uint8_t>{};
    if (!q.open.empty() || !fits || options_.when_full == WhenFull::drop) break;
    {
      const std::lock_guard lock(mutex_);
      hurry_ = true;
    }
    wake_.notify_one();
    freed_.wait(seen);
  }
  if (q.open.empty()) {
    counts_.dropped.fetch_add(1, std::memory_order_relaxed);
    if (bulky) counts_.dropped_images.fetch_add(1, std::memory_order_relaxed);
    return {};
  }
  return q.open.subspan(McapMessageHead::kSize);
}

void Recording::commit(std::size_t queue, std::size_t size) noexcept {
  Queue& q = *queues_[queue];
  if (size == 0 || q.open.size() < McapMessageHead::kSize + size) return;
  q.head.content = size;
  q.head.write(q.open.first<McapMessageHead::kSize>());
  q.ring.commit(McapMessageHead::kSize + size);
  q.open = {};
}

// ---- the writer

void Recording::work() noexcept {
  (void)pthread_setname_np(pthread_self(), "vergence-mcap");
  (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNice);
  const SealedScope sealed;
  for (bool last = false; !last;) {
    bool hurried = false;
    {
      // The thread polls, because waking it would cost the producer a system call per message.
      std::unique_lock lock(mutex_);
      (void)wake_.wait_for(lock, kPollInterval, [this] { return stop_ || hurry_; });
      last = stop_;
      hurried = hurry_;
      hurry_ = false;
    }
    drain(hurried || last, last);
  }
  files_.finish(static_cast<std::uint64_t>(std::max<std::int64_t>(options_.start.ns(), 0)));
}

void Recording::drain(bool at_once, bool last) noexcept {
  for (;;) {
    const Batch batch = gather();
    if (batch.messages == 0) {
      waiting_since_ns_ = 0;
      return;
    }
    if (!at_once && !due(batch)) return;
    if (!last && files_.resting()) return make_room(at_once);
    if (store(batch)) {
      release(batch);
      files_.roll();
      continue;
    }
    if (!last) return make_room(at_once);
    counts_.lost.fetch_add(batch.messages, std::memory_order_relaxed);
    release(batch);
  }
}

Recording::Batch Recording::gather() const noexcept {
  Batch batch;
  for (std::size_t i = 0; i < queues_.size(); ++i) {
    const std::span<const std::uint8_t> waiting = queues_[i]->ring.waiting();
    std::size_t at = 0;
    while (at < waiting.size()) {
      const McapMessageHead head = read_head(waiting.subspan(at));
      const std::size_t size = head.record_size();
      batch.filled = batch.messages == McapFile::kMaxMessages ||
                     (batch.bytes > 0 && batch.bytes + size > kMaxChunkBytes);
      if (batch.filled) break;
      if (batch.messages == 0) batch.first = head.log_time;
      at += size;
      batch.bytes += size;
      ++batch.messages;
    }
    batch.parts[i] = waiting.first(at);
  }
  return batch;
}

bool Recording::due(const Batch& batch) noexcept {
  const std::int64_t now = monotonic_now().ns();
  if (waiting_since_ns_ == 0) waiting_since_ns_ = now;
  return batch.filled || now - waiting_since_ns_ >= kMaxWaitNs;
}

void Recording::release(const Batch& batch) noexcept {
  for (std::size_t i = 0; i < queues_.size(); ++i) queues_[i]->ring.release(batch.parts[i].size());
  waiting_since_ns_ = 0;
  if (options_.when_full == WhenFull::wait) freed_.signal();
}

void Recording::drop_oldest(RecordRing* ring) noexcept {
  ring->release(read_head(ring->waiting()).record_size());
  counts_.lost.fetch_add(1, std::memory_order_relaxed);
}

/// While the disk accepts nothing, the oldest messages are dropped in favour of new ones.
void Recording::make_room(bool hurried) noexcept {
  for (const auto& q : queues_)
    while (q->ring.fill() > room_left_at(q->ring, hurried)) drop_oldest(&q->ring);
  if (options_.when_full == WhenFull::wait) freed_.signal();
}

bool Recording::store(const Batch& batch) noexcept {
  const std::uint64_t bytes =
      files_.append(std::span(batch.parts).first(queues_.size()), batch.first,
                    counts_.lost.load(std::memory_order_relaxed) + files_.unwritten());
  if (bytes == 0) return false;
  counts_.messages.fetch_add(batch.messages, std::memory_order_relaxed);
  counts_.bytes.fetch_add(bytes, std::memory_order_relaxed);
  counts_.chunks.fetch_add(1, std::memory_order_relaxed);
  return true;
}

// ---- the owner

void Recording::close() noexcept {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

RecordingCounters Recording::counters() const noexcept {
  RecordingCounters c;
  const auto get = [](const std::atomic<std::uint64_t>& v) {
    return v.load(std::memory_order_relaxed);
  };
  c.messages = get(counts_.messages), c.bytes = get(counts_.bytes);
  c.chunks = get(counts_.chunks), c.files = files_.files();
  c.dropped = get(counts_.dropped), c.dropped_images = get(counts_.dropped_images);
  c.lost = get(counts_.lost) + files_.unwritten();
  for (const auto& q : queues_) {
    c.queue_bytes += q->ring.capacity();
    c.queue_high_water += q->ring.high_water();
  }
  return c;
}

}  // namespace vergence::app
