#include "app/session/temperature_watch.hpp"

#include <pthread.h>

#include <chrono>
#include <condition_variable>
#include <system_error>
#include <utility>

namespace vergence::app {

void TemperatureWatch::begin() noexcept {
  try {
    thread_ = std::jthread([this](const std::stop_token& stop) { work(stop); });
  } catch (const std::system_error&) {  // a drive does not end for want of a figure on a page
  }
}

TemperatureWatch::Celsius TemperatureWatch::take_new() noexcept {
  const std::lock_guard lock(mutex_);
  return std::exchange(new_, Celsius{});
}

void TemperatureWatch::work(const std::stop_token& stop) {
  constexpr std::chrono::seconds kInterval{5};
  (void)pthread_setname_np(pthread_self(), "vergence-temp");
  std::condition_variable_any ended;
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    for (int k = 0; k < source_.facts().begin.file.rig.cameras && !stop.stop_requested(); ++k) {
      lock.unlock();
      const std::optional<double> celsius = source_.temperature_c(k);
      lock.lock();
      if (celsius) new_[static_cast<std::size_t>(k)] = celsius;
    }
    (void)ended.wait_for(lock, stop, kInterval, [] { return false; });
  }
}

}  // namespace vergence::app
