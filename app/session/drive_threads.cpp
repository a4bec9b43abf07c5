#include "app/session/drive_threads.hpp"

#include <cstdint>
#include <map>

#include <fmt/format.h>

#include "core/memory/thread_allocations.hpp"

namespace vergence::app {

namespace {

void print(const std::vector<std::string>& messages, Progress* progress) {
  for (const std::string& message : messages) progress->print("vergence: " + message);
}

}  // namespace

DriveThreads::DriveThreads(const RealtimeSettings& settings) : realtime_(settings, system_) {
  // A run has fewer threads than this, so polling does not allocate.
  constexpr std::size_t kThreads = 64;
  threads_.reserve(kThreads);
}

void DriveThreads::lock_memory(Progress* progress) { print(realtime_.lock_memory(), progress); }

void DriveThreads::poll(Progress* progress) {
  // Threads are examined at every poll in the first second, then once per second.
  constexpr int kAtFirst = 20, kLater = 20;
  const int count = polls_++;
  if (count >= kAtFirst && count % kLater != 0) return;
  process_threads(&threads_);
  for (const ProcessThread& thread : threads_)
    if (thread.own()) own_.insert(thread.name);
  print(realtime_.apply(threads_), progress);
}

ThreadAllocationCounts DriveThreads::allocations() const {
  const ThreadAllocations::Counts counts = ThreadAllocations::counts();
  std::map<std::string, std::uint64_t> own, libraries;
  for (const std::string& name : own_) own[name] = 0;
  for (std::size_t i = 0; i < counts.size; ++i) {
    const std::string name = counts.rows[i].name.data();
    (ProcessThread{0, name}.own() ? own : libraries)[name] += counts.rows[i].count;
  }
  if (counts.others > 0) libraries["others"] = counts.others;
  ThreadAllocationCounts out;
  out.own.assign(own.begin(), own.end());
  out.libraries.assign(libraries.begin(), libraries.end());
  return out;
}

std::string allocations_message(const ThreadAllocationCounts& allocations) {
  std::string list;
  for (const auto* names : {&allocations.own, &allocations.libraries})
    for (const auto& [name, count] : *names)
      if (count > 0) list += fmt::format("{}{} {}", list.empty() ? "" : ", ", name, count);
  return list.empty() ? "" : "runtime heap allocations: " + list;
}

}  // namespace vergence::app
