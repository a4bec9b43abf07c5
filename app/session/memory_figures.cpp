#include "app/session/memory_figures.hpp"

#include <algorithm>
#include <cstdio>
#include <string_view>

#include <fmt/format.h>

namespace vergence::app {
namespace {

void print_row(std::string_view name, std::size_t bytes) {
  fmt::print("{:<44}{:>14}\n", name, bytes);
}

/// What an arena holds, the largest first; those below a hundredth of it in one line.
void print_parts(const MemoryRow& row) {
  std::vector<ArenaRow> parts(row.parts.begin(), row.parts.end());
  std::stable_sort(parts.begin(), parts.end(),
                   [](const ArenaRow& a, const ArenaRow& b) { return a.bytes > b.bytes; });
  std::size_t rest = row.bytes;
  for (const ArenaRow& part : parts) {
    if (part.bytes < row.bytes / 100) break;
    print_row(fmt::format("  {}", part.name), part.bytes);
    rest -= part.bytes;
  }
  if (!parts.empty()) print_row("  smaller ones", rest);
}

}  // namespace

void print_memory_table(const std::vector<MemoryRow>& memory) {
  std::size_t sum = 0;
  for (const MemoryRow& row : memory) {
    print_row(row.name, row.bytes);
    print_parts(row);
    sum += row.bytes;
  }
  print_row("sum_bytes", sum);
  (void)std::fflush(stdout);
}

}  // namespace vergence::app
