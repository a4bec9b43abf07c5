#pragma once
#include <gtest/gtest.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

namespace vergence::test {

/// The thread of a transport on which its library takes heap memory, at most so often.
struct LibraryAllocations {
  std::string thread;
  std::uint64_t most = 0;
};

/// Between a drive's first frame and its last no thread has allocated, by its `summary`
/// (summary.json), but `library`'s and those that write messages and YAML: the caller's, the one
/// that keeps calibrations and the one that watches the others.
inline void expect_no_heap_but_of(const LibraryAllocations& library,
                                  const nlohmann::json& summary) {
  const auto& threads = summary.at("memory").at("allocations_by_thread");
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  // A sanitizer brings its own malloc, which nothing counts; else the table names every thread.
  ASSERT_TRUE(threads.contains("vergence-estim")) << threads.dump();
#endif
  for (const auto& [name, count] : threads.items()) {
    if (name == "vergence" || name == "vergence-state" || name == "vergence-watch") continue;
    EXPECT_LE(count.get<std::uint64_t>(), name == library.thread ? library.most : 0U)
        << name << " of " << threads.dump();
  }
}

}  // namespace vergence::test
