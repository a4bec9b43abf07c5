#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/memory/arena.hpp"

/// What a drive's memory is taken for.
namespace vergence::app {

/// Bytes taken by one holder, an arena's with what it holds by name.
struct MemoryRow {
  std::string name{};
  std::size_t bytes = 0;
  std::span<const ArenaRow> parts{};
};

/// The table of --memory on stdout, before the drive.
void print_memory_table(const std::vector<MemoryRow>& memory);

}  // namespace vergence::app
