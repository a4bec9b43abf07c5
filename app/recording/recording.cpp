#include "app/recording/recording.hpp"

#include <sys/mman.h>
#include <sys/resource.h>

#include <cassert>
#include <cerrno>
#include <cstdio>
#include <system_error>

#include "app/runtime/errors.hpp"
#include "app/runtime/file_descriptor.hpp"
#include "app/runtime/version.hpp"
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

/// Quality of service of a topic: reliable, and for latched topics transient local.
std::string qos(bool latched) {
  constexpr const char* kForever = "    sec: 2147483647\n    nsec: 4294967295\n";
  return fmt::format(
      "- history: 1\n  depth: {}\n  reliability: 1\n  durability: {}\n  deadline:\n{}  "
      "lifespan:\n{}"
      "  liveliness: 1\n  liveliness_lease_duration:\n{}  avoid_ros_namespace_conventions: false\n",
      latched ? 1 : 10, latched ? 1 : 2, kForever, kForever, kForever);
}

std::vector<McapTopic> described(const std::vector<RecordedTopic>& topics) {
  std::vector<McapTopic> out;
  out.reserve(topics.size());
  for (const RecordedTopic& t : topics)
    out.push_back(
        {t.name, std::string(ros_type_name(t.type)), ros_definition(t.type), qos(t.latched)});
  return out;
}

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

Recording::Recording(const std::filesystem::path& folder, const Options& options)
    : options_(options),
      sequences_(options.topics.size()),
      folder_(folder.string()),
      topics_(described(options.topics)),
      disk_(options.disk != nullptr ? *options.disk : disk_of_system_),
      file_(disk_, topics_, "vergence " + std::string(version())) {
  assert(options_.queues.size() <= McapFile::kMaxParts);
  if (folder_.size() + 32 > PATH_MAX)
    throw InputError(folder_ + ": the path is too long for a recording; use a shorter one");
  for (const RecordingPreamble& p : options.preamble) {
    std::array<std::uint8_t, McapMessageHead::kSize> head{};
    McapMessageHead{static_cast<std::uint16_t>(p.topic + 1), 0, 0, p.message.size()}.write(head);
    preamble_.insert(preamble_.end(), head.begin(), head.end());
    preamble_.insert(preamble_.end(), p.message.begin(), p.message.end());
  }
  if (const int error = open_file(); error != 0)
    throw InputError(folder_ + ": the recording cannot be created (" + std::strerror(-error) +
                     "); check the disk and the directory's permissions");
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
    ++counts_.dropped;
    if (bulky) ++counts_.dropped_images;
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
  if (file_.open() && preamble_due_)
    (void)write_preamble(
        static_cast<std::uint64_t>(std::max<std::int64_t>(options_.start.ns(), 0)));
  end_file();
}

void Recording::drain(bool at_once, bool last) noexcept {
  for (;;) {
    const Batch batch = gather();
    if (batch.messages == 0) {
      waiting_since_ns_ = 0;
      return;
    }
    if (!at_once && !due(batch)) return;
    // Shortly after a failure the disk is not used.
    if (!last && failing_ && monotonic_now().ns() < retry_ns_) return make_room(at_once);
    if (store(batch)) {
      release(batch);
      begin_next_file();
      continue;
    }
    if (!last) return make_room(at_once);
    counts_.lost += batch.messages;
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
  ++counts_.lost;
}

/// While the disk accepts nothing, the oldest messages are dropped in favour of new ones.
void Recording::make_room(bool hurried) noexcept {
  for (const auto& q : queues_)
    while (q->ring.fill() > room_left_at(q->ring, hurried)) drop_oldest(&q->ring);
  if (options_.when_full == WhenFull::wait) freed_.signal();
}

bool Recording::store(const Batch& batch) noexcept {
  if (!file_.open() && open_file() != 0) return false;
  const std::uint64_t before = file_.size();
  int error = preamble_due_ ? write_preamble(batch.first) : 0;
  if (error == 0) error = file_.write_chunk(std::span(batch.parts).first(queues_.size()));
  record_unwritten();
  if (error != 0) {
    fail(-error);
    return false;
  }
  if (std::exchange(failing_, false))
    (void)notices_.push({Notice::Kind::good_again, 0, counts_.lost, number_});
  counts_.messages += batch.messages;
  counts_.bytes += file_.size() - before;
  ++counts_.chunks;
  return true;
}

void Recording::end_file() noexcept {
  const int error = file_.finish();
  record_unwritten();
  if (error != 0) (void)notices_.push({Notice::Kind::unfinished, -error, 0, number_});
}

/// The data are not written again, because the system no longer has them.
void Recording::record_unwritten() noexcept {
  const McapFile::Unwritten missing = file_.pop_unwritten();
  if (missing.messages == 0) return;
  counts_.lost += missing.messages;
  (void)notices_.push({Notice::Kind::unwritten, -missing.error, missing.messages, number_});
}

int Recording::open_file() noexcept {
  if (const int error = file_.create(path().data()); error != 0) {
    fail(-error);
    return error;
  }
  ++counts_.files;
  preamble_due_ = !preamble_.empty();
  return 0;
}

/// Writes the preamble before the first chunk of a file, with that chunk's time. Returns 0 or an
/// error.
int Recording::write_preamble(std::uint64_t time) noexcept {
  for (std::span<std::uint8_t> rest(preamble_); !rest.empty();) {
    McapMessageHead head = McapMessageHead::read(rest.first<McapMessageHead::kSize>());
    head.log_time = time;
    head.write(rest.first<McapMessageHead::kSize>());
    rest = rest.subspan(head.record_size());
  }
  const std::array<std::span<const std::uint8_t>, 1> part{preamble_};
  const int error = file_.write_chunk(part);
  preamble_due_ = error != 0;
  return error;
}

void Recording::fail(int error) noexcept {
  if (!std::exchange(failing_, true))
    (void)notices_.push({Notice::Kind::failed, error, 0, number_});
  retry_ns_ = (monotonic_now() + kRetry).ns();
}

void Recording::begin_next_file() noexcept {
  if (!file_.full() && (options_.roll_bytes == 0 || file_.size() < options_.roll_bytes)) return;
  end_file();
  if (!several_) {
    const auto only = path();
    several_ = true;
    (void)std::rename(only.data(), path().data());
  }
  ++number_;
}

std::array<char, PATH_MAX> Recording::path() const noexcept {
  std::array<char, PATH_MAX> path{};
  (void)(several_
             ? fmt::format_to_n(path.data(), path.size() - 1, "{}/drive_{}.mcap", folder_, number_)
             : fmt::format_to_n(path.data(), path.size() - 1, "{}/drive.mcap", folder_));
  return path;
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

std::vector<std::string> Recording::pop_errors() {
  std::vector<std::string> out;
  for (Notice n; notices_.pop(&n);) out.push_back(message(n));
  return out;
}

std::string Recording::message(const Notice& n) const {
  const std::string what = std::strerror(n.error);
  switch (n.kind) {
    case Notice::Kind::good_again:
      return fmt::format("{}: the recording is written again; {} messages were lost", folder_,
                         n.lost);
    case Notice::Kind::failed:
      return fmt::format(
          "{}: the recording cannot be written ({}); the session continues, writing is retried "
          "every {:.0f} s, and messages that do not fit into memory are lost: check the disk",
          folder_, what, kRetry.to_seconds());
    case Notice::Kind::unfinished:
      return fmt::format(
          "{}: file {} of the recording has no summary ({}); it can be read without one, up to its "
          "last chunk",
          folder_, n.file, what);
    case Notice::Kind::unwritten:
      return fmt::format(
          "{}: the disk lost data that it had accepted ({}): {} messages of file {} of the "
          "recording are lost; check the disk",
          folder_, what, n.lost, n.file);
  }
  return {};
}

RecordingCounters Recording::counters() const noexcept {
  RecordingCounters c{.messages = counts_.messages,
                      .bytes = counts_.bytes,
                      .chunks = counts_.chunks,
                      .files = counts_.files,
                      .dropped = counts_.dropped,
                      .dropped_images = counts_.dropped_images,
                      .lost = counts_.lost};
  for (const auto& q : queues_) {
    c.queue_bytes += q->ring.capacity();
    c.queue_high_water += q->ring.high_water();
  }
  return c;
}

}  // namespace vergence::app
