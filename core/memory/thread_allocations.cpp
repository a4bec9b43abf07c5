#include "core/memory/thread_allocations.hpp"

#include <sys/prctl.h>

#include <algorithm>
#include <atomic>
#include <cstring>

namespace vergence {
namespace {

using Name = std::array<char, ThreadAllocations::kNameBytes>;

struct Counter {
  // Published by `used`.
  Name name{};
  std::atomic<std::uint64_t> count{0};
};

constexpr int kNoRow = -1;

std::array<Counter, ThreadAllocations::kMaxNames> table;
std::atomic<std::size_t> used{0};
std::atomic<std::uint64_t> others{0};
std::atomic<bool> counting{false};
// Number of begin() calls; rows of earlier ones are invalid.
std::atomic<std::uint32_t> session{0};
std::atomic_flag claiming = ATOMIC_FLAG_INIT;

/// Constant-initialised thread-local storage, because reading it inside malloc must not allocate.
struct Place {
  std::uint32_t session = 0;
  int row = kNoRow;
};
thread_local constinit Place place{};

int find(const Name& name, std::size_t rows) noexcept {
  for (std::size_t i = 0; i < rows; ++i)
    if (table[i].name == name) return static_cast<int>(i);
  return kNoRow;
}

/// Returns the row of that name, creating it if necessary; kNoRow if the table is full.
int row_of(const Name& name) noexcept {
  if (const int row = find(name, used.load(std::memory_order_acquire)); row != kNoRow) return row;
  while (claiming.test_and_set(std::memory_order_acquire)) {
  }
  const std::size_t rows = used.load(std::memory_order_relaxed);
  // Another thread of that name may have been first.
  int row = find(name, rows);
  if (row == kNoRow && rows < table.size()) {
    table[rows].name = name;
    used.store(rows + 1, std::memory_order_release);
    row = static_cast<int>(rows);
  }
  claiming.clear(std::memory_order_release);
  return row;
}

Name name_of_this_thread() noexcept {
  Name name{};
  (void)::prctl(PR_GET_NAME, name.data());
  name.back() = 0;
  std::fill(std::find(name.begin(), name.end(), '\0'), name.end(), '\0');
  return name;
}

/// True for the program's own thread names, which are final; other threads may still be renamed.
bool is_final(const Name& name) noexcept {
  constexpr std::size_t kPrefix = 9;
  return std::memcmp(name.data(), "vergence-", kPrefix) == 0;
}

}  // namespace

void ThreadAllocations::begin() noexcept {
  end();
  while (claiming.test_and_set(std::memory_order_acquire)) {
  }
  used.store(0, std::memory_order_release);
  for (Counter& counter : table) counter.count.store(0, std::memory_order_relaxed);
  others.store(0, std::memory_order_relaxed);
  session.fetch_add(1, std::memory_order_release);
  claiming.clear(std::memory_order_release);
  counting.store(true, std::memory_order_release);
}

void ThreadAllocations::end() noexcept { counting.store(false, std::memory_order_release); }

ThreadAllocations::Counts ThreadAllocations::counts() noexcept {
  Counts out;
  out.size = used.load(std::memory_order_acquire);
  for (std::size_t i = 0; i < out.size; ++i)
    out.rows[i] = {table[i].name, table[i].count.load(std::memory_order_relaxed)};
  out.others = others.load(std::memory_order_relaxed);
  return out;
}

void ThreadAllocations::record_allocation() noexcept {
  if (counting.load(std::memory_order_acquire)) count();
}

[[gnu::noinline]] void ThreadAllocations::count() noexcept {
  const std::uint32_t now = session.load(std::memory_order_acquire);
  int row = place.session == now ? place.row : kNoRow;
  if (row == kNoRow) {
    const Name name = name_of_this_thread();
    row = row_of(name);
    if (row == kNoRow) {
      others.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    if (is_final(name)) place = {now, row};
  }
  table[static_cast<std::size_t>(row)].count.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace vergence
