#include "app/session/thread_names.hpp"

#include <cstdint>
#include <map>

#include <fmt/format.h>

#include "app/runtime/process_threads.hpp"
#include "core/memory/thread_allocations.hpp"

namespace vergence::app {

void ThreadNames::look() {
  for (const ProcessThread& thread : process_threads())
    if (thread.ours()) ours_.insert(thread.name);
}

ThreadAllocationFigures ThreadNames::figures() const {
  const ThreadAllocations::Counts counts = ThreadAllocations::counts();
  std::map<std::string, std::uint64_t> ours, libraries;
  for (const std::string& name : ours_) ours[name] = 0;
  for (std::size_t i = 0; i < counts.size; ++i) {
    const std::string name = counts.rows[i].name.data();
    (ProcessThread{0, name}.ours() ? ours : libraries)[name] += counts.rows[i].count;
  }
  if (counts.others > 0) libraries["others"] = counts.others;
  ThreadAllocationFigures out;
  out.ours.assign(ours.begin(), ours.end());
  out.libraries.assign(libraries.begin(), libraries.end());
  return out;
}

std::string allocations_sentence(const ThreadAllocationFigures& figures) {
  std::string list;
  for (const auto* names : {&figures.ours, &figures.libraries})
    for (const auto& [name, count] : *names)
      if (count > 0) list += fmt::format("{}{} {}", list.empty() ? "" : ", ", name, count);
  return list.empty() ? "" : "heap allocations while frames came: " + list;
}

}  // namespace vergence::app
