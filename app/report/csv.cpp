#include "app/report/csv.hpp"

#include <algorithm>

#include "app/datasets/decimal.hpp"

namespace vergence::app::report {

std::string_view whole_lines(std::string_view text) noexcept {
  const std::size_t end = text.rfind('\n');
  return end == std::string_view::npos ? std::string_view{} : text.substr(0, end + 1);
}

CsvRows::CsvRows(std::string_view text) : lines_(text) {
  std::string_view head;
  if (!lines_.next(&head)) return;
  names_.resize(kMostColumns);
  names_.resize(std::min(split(head, ',', names_), kMostColumns));
  fields_.resize(names_.size());
}

std::optional<std::size_t> CsvRows::column(std::string_view name) const noexcept {
  const auto found = std::find(names_.begin(), names_.end(), name);
  if (found == names_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - names_.begin());
}

bool CsvRows::next() {
  std::string_view line;
  while (lines_.next(&line)) {
    if (split(line, ',', fields_) == names_.size()) return true;
    ++torn_;
  }
  return false;
}

std::string_view CsvRows::text(std::optional<std::size_t> column) const noexcept {
  return column ? fields_[*column] : std::string_view{};
}

std::optional<double> CsvRows::number(std::optional<std::size_t> column) const noexcept {
  double value = 0;
  if (!parse_number(text(column), &value)) return std::nullopt;
  return value;
}

std::optional<std::int64_t> CsvRows::integer(std::optional<std::size_t> column) const noexcept {
  return parse_integer(text(column));
}

}  // namespace vergence::app::report
