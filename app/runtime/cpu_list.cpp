#include "app/runtime/cpu_list.hpp"

#include <charconv>

namespace vergence::app {
namespace {

/// Takes a number from the front of the text; false: there is none, or no such processor.
bool take_number(std::string_view* text, int* number) noexcept {
  const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), *number);
  if (error != std::errc() || *number < 0 || *number >= CPU_SETSIZE) return false;
  text->remove_prefix(static_cast<std::size_t>(end - text->data()));
  return true;
}

bool take(std::string_view* text, char c) noexcept {
  if (!text->starts_with(c)) return false;
  text->remove_prefix(1);
  return true;
}

}  // namespace

std::optional<cpu_set_t> parse_cpu_list(std::string_view text) noexcept {
  cpu_set_t set;
  CPU_ZERO(&set);
  do {
    int first = 0;
    if (!take_number(&text, &first)) return std::nullopt;
    int last = first;
    if (take(&text, '-') && (!take_number(&text, &last) || last < first)) return std::nullopt;
    for (int cpu = first; cpu <= last; ++cpu) CPU_SET(static_cast<unsigned>(cpu), &set);
  } while (take(&text, ','));
  if (!text.empty()) return std::nullopt;
  return set;
}

}  // namespace vergence::app
