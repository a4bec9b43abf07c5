#include "app/recording/recording.hpp"

#include <pthread.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <climits>
#include <cstdio>
#include <limits>

#include "app/runtime/errors.hpp"
#include "app/runtime/version.hpp"
#include "core/memory/allocation_guard.hpp"

namespace vergence::app {
namespace {

using namespace std::chrono_literals;

constexpr auto kLook = 20ms;                      // between two looks at the queues
constexpr std::int64_t kMostWaitNs = 40'000'000;  // of a message for its chunk: with a look and
                                                  // the write it is less than 100 ms
constexpr std::size_t kMostChunkBytes = std::size_t{32} << 20;  // half of what readers take
constexpr std::int64_t kRetryNs = 250'000'000;                  // until a disk is asked again
constexpr std::int64_t kSlowNs = 1'000'000'000;       // a write that takes so long is said
constexpr std::size_t kSpare = std::size_t{1} << 20;  // of a queue, for what is not bulky
constexpr int kNice = 5;  // poses come first; what is recorded waits in memory

constexpr const char* kQosOf[] = {
    // reliable, keep last, volatile; and for what is latched: transient local
    "- history: 1\n  depth: 10\n  reliability: 1\n  durability: 2\n  deadline:\n    sec: "
    "2147483647\n    nsec: 4294967295\n  lifespan:\n    sec: 2147483647\n    nsec: 4294967295\n  "
    "liveliness: 1\n  liveliness_lease_duration:\n    sec: 2147483647\n    nsec: 4294967295\n  "
    "avoid_ros_namespace_conventions: false\n",
    "- history: 1\n  depth: 1\n  reliability: 1\n  durability: 1\n  deadline:\n    sec: "
    "2147483647\n    nsec: 4294967295\n  lifespan:\n    sec: 2147483647\n    nsec: 4294967295\n  "
    "liveliness: 1\n  liveliness_lease_duration:\n    sec: 2147483647\n    nsec: 4294967295\n  "
    "avoid_ros_namespace_conventions: false\n"};

std::int64_t monotonic_ns() noexcept {
  timespec t{};
  (void)::clock_gettime(CLOCK_MONOTONIC, &t);
  return static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec;
}

std::vector<McapTopic> described(const std::vector<RecordedTopic>& topics) {
  std::vector<McapTopic> out;
  out.reserve(topics.size());
  for (const RecordedTopic& t : topics)
    out.push_back({t.name, std::string(ros_type_name(t.type)), ros_definition(t.type),
                   kQosOf[t.latched ? 1 : 0]});
  return out;
}

/// How full a queue may be that is not written: a producer that does not wait finds room for an
/// image; one that waits (`hurried`) for anything that fits at all.
std::size_t room_left_at(const RecordRing& ring, bool hurried) noexcept {
  return hurried ? ring.capacity() / 4 : ring.capacity() / 8 * 7;
}

McapMessageHead head_of(std::span<const std::uint8_t> records) noexcept {
  return McapMessageHead::read(records.first<McapMessageHead::kSize>());
}

}  // namespace

Recording::Recording(const std::filesystem::path& folder, Options options)
    : folder_(folder.string()),
      options_(std::move(options)),
      topics_(described(options_.topics)),
      sequences_(topics_.size()),
      disk_(options_.disk != nullptr ? *options_.disk : system_disk()),
      file_(disk_, topics_, "vergence " + std::string(version())),
      path_(PATH_MAX),
      other_path_(PATH_MAX),
      keep_until_ns_(std::numeric_limits<std::int64_t>::min()) {
  assert(options_.queues.size() <= McapFile::kMostParts);
  if (folder_.size() + 32 > PATH_MAX)
    throw InputError(folder_ + ": the name is too long for a recording in it");
  for (const std::size_t bytes : options_.queues) queues_.push_back(std::make_unique<Queue>(bytes));
  for (const Preamble& p : options_.preamble) {
    std::array<std::uint8_t, McapMessageHead::kSize> head{};
    McapMessageHead{static_cast<std::uint16_t>(p.topic + 1), 0, 0, p.message.size()}.write(head);
    preamble_.insert(preamble_.end(), head.begin(), head.end());
    preamble_.insert(preamble_.end(), p.message.begin(), p.message.end());
  }
  if (!open_file()) {
    const auto sentences = take_errors();
    throw InputError(sentences.empty() ? folder_ + ": nothing can be recorded there"
                                       : sentences.front());
  }
  thread_ = std::thread([this] { work(); });
}

Recording::~Recording() { close(); }

// ---- producers

std::span<std::uint8_t> Recording::begin(std::size_t queue, std::size_t topic, Stamp stamp,
                                         std::size_t most, bool bulky) noexcept {
  Queue& q = *queues_[queue];
  q.head.channel = static_cast<std::uint16_t>(topic + 1);
  q.head.sequence = sequences_[topic]++;  // one that is dropped leaves a gap
  q.head.log_time = static_cast<std::uint64_t>(std::max<std::int64_t>(stamp.ns(), 0));
  const std::size_t size = McapMessageHead::kSize + most;
  const std::size_t spare = bulky ? std::min(kSpare, q.ring.capacity() / 8) : 0;
  const bool fits = size <= q.ring.capacity() / 2 && size <= kMostChunkBytes;
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
    dropped_.fetch_add(1, std::memory_order_relaxed);
    if (bulky) dropped_images_.fetch_add(1, std::memory_order_relaxed);
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
  newest_ns_.store(q.head.log_time, std::memory_order_relaxed);
  q.open = {};
}

void Recording::mark_event(Stamp stamp) noexcept {
  const std::int64_t until = (stamp + options_.keep).ns();
  std::int64_t now = keep_until_ns_.load(std::memory_order_relaxed);
  while (now < until &&
         !keep_until_ns_.compare_exchange_weak(now, until, std::memory_order_relaxed)) {
  }
}

// ---- the writer

void Recording::work() noexcept {
  (void)pthread_setname_np(pthread_self(), "vergence-mcap");
  (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNice);
  const SealedScope sealed;
  for (bool last = false; !last;) {
    bool hurried = false;
    {
      // Looks by the clock: a producer that had to wake it would pay a system call a message.
      std::unique_lock lock(mutex_);
      (void)wake_.wait_for(lock, kLook, [this] { return stop_ || hurry_; });
      last = stop_;
      hurried = hurry_;
      hurry_ = false;
    }
    drain(hurried || last, last);
  }
  if (file_.open() && preamble_due_)
    (void)write_preamble(
        static_cast<std::uint64_t>(std::max<std::int64_t>(options_.start.ns(), 0)));
  const int error = file_.finish();
  if (error != 0) (void)notices_.push({Trouble::unfinished, -error, 0, number_});
}

bool Recording::holding() const noexcept {
  return options_.keep > Duration{} &&
         static_cast<std::int64_t>(newest_ns_.load(std::memory_order_relaxed)) >
             keep_until_ns_.load(std::memory_order_relaxed);
}

void Recording::drain(bool at_once, bool last) noexcept {
  for (;;) {
    if (holding()) {
      pass_over_old(at_once, last);
      return;
    }
    const Batch batch = gather();
    if (batch.messages == 0) {
      waiting_since_ns_ = 0;
      return;
    }
    if (!at_once && !due(batch)) return;
    if (trouble_ != Trouble::none && !last && monotonic_ns() < retry_ns_) return make_room(at_once);
    if (store(batch)) {
      release(batch);
      roll_if_wanted();
      continue;
    }
    if (!last) return make_room(at_once);
    lost_.fetch_add(batch.messages, std::memory_order_relaxed);
    release(batch);
  }
}

Recording::Batch Recording::gather() const noexcept {
  Batch batch;
  for (std::size_t i = 0; i < queues_.size(); ++i) {
    const std::span<const std::uint8_t> waiting = queues_[i]->ring.waiting();
    std::size_t at = 0;
    while (at < waiting.size()) {
      const McapMessageHead head = head_of(waiting.subspan(at));
      const std::size_t size = head.record_size();
      batch.filled = batch.messages == McapFile::kMostMessages ||
                     (batch.bytes > 0 && batch.bytes + size > kMostChunkBytes);
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
  const std::int64_t now = monotonic_ns();
  if (waiting_since_ns_ == 0) waiting_since_ns_ = now;
  return batch.filled || now - waiting_since_ns_ >= kMostWaitNs;
}

void Recording::release(const Batch& batch) noexcept {
  for (std::size_t i = 0; i < queues_.size(); ++i) queues_[i]->ring.release(batch.parts[i].size());
  waiting_since_ns_ = 0;
  if (options_.when_full == WhenFull::wait) freed_.signal();
}

void Recording::drop_oldest(RecordRing* ring, std::atomic<std::uint64_t>* counter) noexcept {
  ring->release(head_of(ring->waiting()).record_size());
  counter->fetch_add(1, std::memory_order_relaxed);
}

/// While nothing happens: what is older than what an event would keep, and what a full queue would
/// refuse new messages for.
void Recording::pass_over_old(bool hurried, bool all) noexcept {
  const auto newest = static_cast<std::int64_t>(newest_ns_.load(std::memory_order_relaxed));
  for (const auto& q : queues_)
    while (q->ring.fill() > 0) {
      const auto oldest = static_cast<std::int64_t>(head_of(q->ring.waiting()).log_time);
      if (!all && newest - oldest <= options_.keep.ns() &&
          q->ring.fill() <= room_left_at(q->ring, hurried))
        break;
      drop_oldest(&q->ring, &passed_over_);
    }
  if (options_.when_full == WhenFull::wait) freed_.signal();
}

/// While the disk takes nothing: the newest are worth more than the oldest.
void Recording::make_room(bool hurried) noexcept {
  for (const auto& q : queues_)
    while (q->ring.fill() > room_left_at(q->ring, hurried)) drop_oldest(&q->ring, &lost_);
  if (options_.when_full == WhenFull::wait) freed_.signal();
}

bool Recording::store(const Batch& batch) noexcept {
  if (!file_.open() && !open_file()) return false;
  const std::int64_t begun = monotonic_ns();
  const std::uint64_t before = file_.size();
  int error = preamble_due_ ? write_preamble(batch.first) : 0;
  if (error == 0) error = file_.write_chunk(std::span(batch.parts).first(queues_.size()));
  if (error != 0) {
    fail(-error);
    return false;
  }
  if (const std::int64_t took = monotonic_ns() - begun; took > kSlowNs)
    (void)notices_.push({Trouble::slow, static_cast<int>(took / 1'000'000), 0, number_});
  if (trouble_ != Trouble::none) {
    trouble_ = Trouble::none;
    (void)notices_.push({Trouble::none, 0, lost_.load(std::memory_order_relaxed), number_});
  }
  messages_.fetch_add(batch.messages, std::memory_order_relaxed);
  bytes_.fetch_add(file_.size() - before, std::memory_order_relaxed);
  chunks_.fetch_add(1, std::memory_order_relaxed);
  return true;
}

bool Recording::open_file() noexcept {
  if (const int error = file_.create(path(number_, &path_)); error != 0) {
    fail(-error);
    return false;
  }
  files_.fetch_add(1, std::memory_order_relaxed);
  preamble_due_ = !preamble_.empty();
  return true;
}

/// In front of the first chunk of a file, at its time: before it nobody knows when the file begins.
/// → 0
int Recording::write_preamble(std::uint64_t time) noexcept {
  for (std::span<std::uint8_t> rest(preamble_); !rest.empty();) {
    McapMessageHead head = head_of(rest);
    head.log_time = time;
    head.write(rest.first<McapMessageHead::kSize>());
    rest = rest.subspan(head.record_size());
  }
  const std::array<std::span<const std::uint8_t>, 1> part{preamble_};
  const int error = file_.write_chunk(part);
  preamble_due_ = error != 0;
  return error;
}

/// What the system said of a write. A full disk goes on with the same file; any other fault may
/// mean that it is not there any more: with a new one.
void Recording::fail(int error) noexcept {
  const bool full = error == ENOSPC || error == EDQUOT;
  if (!full && (file_.open() || error == EEXIST)) {
    file_.abandon();
    begin_next_number();
  }
  if (trouble_ == Trouble::none)
    (void)notices_.push({full ? Trouble::full : Trouble::gone, error, 0, number_});
  trouble_ = full ? Trouble::full : Trouble::gone;
  retry_ns_ = monotonic_ns() + kRetryNs;
}

void Recording::roll_if_wanted() noexcept {
  const bool wanted =
      roll_asked_.exchange(false, std::memory_order_relaxed) || file_.full() ||
      (options_.roll_bytes > 0 && file_.size() >= options_.roll_bytes) ||
      (options_.roll_time > Duration{} && file_.last_time() - file_.first_time() >=
                                              static_cast<std::uint64_t>(options_.roll_time.ns()));
  if (!wanted) return;
  const int error = file_.finish();
  if (error != 0) (void)notices_.push({Trouble::unfinished, -error, 0, number_});
  begin_next_number();
}

void Recording::begin_next_number() noexcept {
  if (number_ == 0) {
    const char* only = path(0, &path_);
    several_ = true;
    (void)disk_.rename(only, path(0, &other_path_));
  }
  ++number_;
}

const char* Recording::path(int number, std::vector<char>* out) const noexcept {
  if (several_)
    (void)std::snprintf(out->data(), out->size(), "%s/drive_%d.mcap", folder_.c_str(), number);
  else
    (void)std::snprintf(out->data(), out->size(), "%s/drive.mcap", folder_.c_str());
  return out->data();
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

}  // namespace vergence::app
