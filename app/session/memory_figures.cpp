#include "app/session/memory_figures.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string_view>

#include <fmt/format.h>

namespace vergence::app {
namespace {

constexpr std::size_t kKiB = 1024;

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

std::size_t ResidentMemory::others() const noexcept {
  std::size_t known = program;
  for (const auto& [name, bytes] : arenas) known += bytes;
  return total > known ? total - known : 0;
}

std::size_t resident_bytes(const Arena& arena) {
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  const auto begin = reinterpret_cast<std::uintptr_t>(arena.bytes().data());
  const std::size_t before = begin % page;  // of its first page
  std::vector<unsigned char> pages((before + arena.capacity() + page - 1) / page);
  if (pages.empty() ||
      ::mincore(reinterpret_cast<void*>(begin - before), pages.size() * page, pages.data()) != 0)
    return 0;
  return page * static_cast<std::size_t>(std::count_if(
                    pages.begin(), pages.end(), [](unsigned char p) { return (p & 1U) != 0; }));
}

ResidentMemory resident_memory(const std::vector<std::pair<std::string, const Arena*>>& arenas) {
  ResidentMemory memory;
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    for (const auto& [key, value] : {std::pair{std::string_view("VmRSS:"), &memory.total},
                                     std::pair{std::string_view("RssFile:"), &memory.program}})
      if (line.starts_with(key))
        *value =
            kKiB * static_cast<std::size_t>(std::strtoull(line.c_str() + key.size(), nullptr, 10));
  }
  for (const auto& [name, arena] : arenas) memory.arenas.emplace_back(name, resident_bytes(*arena));
  return memory;
}

std::vector<std::pair<std::string, std::uint64_t>> named(const ResidentMemory& memory) {
  std::vector<std::pair<std::string, std::uint64_t>> figures(memory.arenas.begin(),
                                                             memory.arenas.end());
  figures.emplace_back("program_and_libraries_bytes", memory.program);
  figures.emplace_back("others_bytes", memory.others());
  figures.emplace_back("sum_bytes", memory.total);
  return figures;
}

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

void print_memory_table(const ResidentMemory& memory) {
  for (const auto& [name, bytes] : named(memory))
    print_row("resident " + name, static_cast<std::size_t>(bytes));
  (void)std::fflush(stdout);
}

}  // namespace vergence::app
