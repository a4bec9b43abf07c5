#include "drivers/serial/line_log.hpp"

#include <exception>
#include <filesystem>
#include <string>
#include <system_error>

namespace vergence {

void LineLog::note(const LineEvent& event) noexcept {
  if (LineObserver* observer = observer_.load(std::memory_order_acquire))
    observer->on_line_event(event);
  else if (keeps_)
    keep(event);
}

void LineLog::opened(const LinePlace& place, HostStamp now) noexcept {
  try {
    // Where a link leads says what kind of port it is, and links are of one machine.
    std::error_code none;
    const std::string name = place.name();
    const std::string real = std::filesystem::canonical(name, none).string();
    const std::string& said = none ? name : real;
    LineEvent event{LineEvent::Kind::opened, now};
    event.value = static_cast<std::uint32_t>(place.latency_timer().ns() / 1000);
    event.bytes = {reinterpret_cast<const std::uint8_t*>(said.data()), said.size()};
    note(event);
  } catch (const std::exception&) {  // out of memory: a record without it
    whole_ = false;
  }
}

void LineLog::keep(const LineEvent& event) noexcept {
  // An event counts as it lies in memory: questions to a silent port are many and small.
  const std::size_t held = bytes_.size() + kept_.size() * sizeof(Kept);
  if (!whole_ || held + event.bytes.size() + sizeof(Kept) > kMostBytes) {
    whole_ = false;
    return;
  }
  try {
    kept_.push_back({event, bytes_.size(), event.bytes.size()});
    bytes_.insert(bytes_.end(), event.bytes.begin(), event.bytes.end());
  } catch (const std::exception&) {
    whole_ = false;
  }
}

void LineLog::observe(LineObserver* observer) noexcept {
  if (observer != nullptr)
    for (Kept& k : kept_) {
      k.event.bytes = std::span(bytes_).subspan(k.from, k.size);
      observer->on_line_event(k.event);
    }
  observer_.store(observer, std::memory_order_release);
  streaming();
}

void LineLog::streaming() noexcept {
  keeps_ = false;
  kept_ = {};
  bytes_ = {};
}

}  // namespace vergence
