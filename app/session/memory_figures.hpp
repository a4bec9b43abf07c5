#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/memory/arena.hpp"

/// What a drive's memory is taken for, and what of it is resident.
namespace vergence::app {

/// Bytes taken by one holder, an arena's with what it holds by name.
struct MemoryRow {
  std::string name{};
  std::size_t bytes = 0;
  std::span<const ArenaRow> parts{};
};

/// Resident bytes of this process. `total` is `program` and all the rest: arenas, and what is on
/// the heap and the stacks.
struct ResidentMemory {
  std::size_t total = 0;    // VmRSS of proc(5)
  std::size_t program = 0;  // RssFile: pages of the program and its libraries, as files have them
  std::vector<std::pair<std::string, std::size_t>> arenas{};
  [[nodiscard]] std::size_t others() const noexcept;
};

/// Bytes of an arena whose pages are resident (mincore(2)).
[[nodiscard]] std::size_t resident_bytes(const Arena& arena);
/// Zeros where proc is not mounted.
[[nodiscard]] ResidentMemory resident_memory(
    const std::vector<std::pair<std::string, const Arena*>>& arenas);

/// Its figures as summary.json has them.
[[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> named(
    const ResidentMemory& memory);

/// The tables of --memory on stdout: before the drive what is taken, after it what is resident.
void print_memory_table(const std::vector<MemoryRow>& memory);
void print_memory_table(const ResidentMemory& memory);

}  // namespace vergence::app
