#include "app/datasets/detail/name_order.hpp"

#include <algorithm>

namespace vergence::app::detail {
namespace {

/// Takes a run of digits, or one other character, off the front of *text.
std::string_view take(std::string_view* text) noexcept {
  const std::size_t digits = std::min(text->find_first_not_of("0123456789"), text->size());
  const std::string_view part = text->substr(0, std::max<std::size_t>(digits, 1));
  text->remove_prefix(part.size());
  return part;
}

/// A run of digits without its leading zeros; another character as it is.
std::string_view value_of(std::string_view part) noexcept {
  return part.substr(std::min(part.find_first_not_of('0'), part.size()));
}

}  // namespace

bool in_name_order(std::string_view a, std::string_view b) noexcept {
  std::string_view rest_a = a, rest_b = b;
  while (!rest_a.empty() && !rest_b.empty()) {
    const std::string_view value_a = value_of(take(&rest_a)), value_b = value_of(take(&rest_b));
    const auto is_number = [](std::string_view v) {
      return v.empty() || (v.front() >= '0' && v.front() <= '9');
    };
    if (is_number(value_a) && is_number(value_b) && value_a.size() != value_b.size())
      return value_a.size() < value_b.size();
    if (value_a != value_b) return value_a < value_b;
  }
  if (rest_a.empty() != rest_b.empty()) return rest_a.empty();
  return a.size() != b.size() ? a.size() < b.size() : a < b;
}

}  // namespace vergence::app::detail
