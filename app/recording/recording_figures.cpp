#include <cstring>

#include <fmt/format.h>

#include "app/recording/recording.hpp"

/// What a recording says of itself.
namespace vergence::app {

std::vector<std::string> Recording::take_errors() {
  const std::lock_guard lock(errors_mutex_);
  std::vector<std::string> out;
  for (Notice n; notices_.pop(&n);) {
    const std::string what = std::strerror(n.error);
    switch (n.trouble) {
      case Trouble::none:
        out.push_back(fmt::format("{}: the disk takes the recording again; {} messages were lost",
                                  folder_, n.lost));
        break;
      case Trouble::full:
        out.push_back(fmt::format(
            "{}: the recording has no room ({}): the drive goes on, what is recorded waits in "
            "memory and then is lost; make room on that disk",
            folder_, what));
        break;
      case Trouble::gone:
        out.push_back(fmt::format(
            "{}: the recording cannot be written ({}): the drive goes on, a new file is tried "
            "four times a second; look after that disk",
            folder_, what));
        break;
      case Trouble::slow:
        out.push_back(fmt::format(
            "{}: the disk kept the recording waiting for {:.1f} s; what found no room in memory "
            "meanwhile is counted as dropped",
            folder_, n.error / 1000.0));
        break;
      case Trouble::unfinished:
        out.push_back(fmt::format(
            "{}: file {} of the recording has no summary ({}); it reads back without, up to its "
            "last chunk",
            folder_, n.file, what));
        break;
    }
  }
  return out;
}

RecordingCounters Recording::counters() const noexcept {
  RecordingCounters c;
  const auto get = [](const std::atomic<std::uint64_t>& v) {
    return v.load(std::memory_order_relaxed);
  };
  c.messages = get(messages_), c.bytes = get(bytes_);
  c.chunks = get(chunks_), c.files = get(files_);
  c.dropped = get(dropped_), c.dropped_images = get(dropped_images_);
  c.lost = get(lost_), c.passed_over = get(passed_over_);
  if (!queues_.empty()) {
    c.queue_bytes = queues_.front()->ring.capacity();
    c.queue_high_water = queues_.front()->ring.high_water();
  }
  return c;
}

}  // namespace vergence::app
