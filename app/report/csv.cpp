#include "app/report/csv.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "app/datasets/decimal.hpp"
#include "app/datasets/text_file.hpp"

namespace vergence::app::report {

FileLines::FileLines(const std::filesystem::path& file) {
  std::error_code ignored;
  const auto status = std::filesystem::status(file, ignored);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
    refuse(file, 0, "is no file: a folder, a pipe or a device");  // a pipe would wait for ever
  in_.open(file, std::ios::binary);
  if (!in_) refuse(file, 0, std::string("cannot be opened (") + std::strerror(errno) + ")");
}

bool FileLines::read_block() {
  std::array<char, 1U << 16U> block;
  in_.read(block.data(), block.size());
  if (in_.gcount() <= 0) return false;
  read_.erase(0, at_);
  at_ = 0;
  if (read_.size() > kLongestLine) read_.resize(kLongestLine);
  read_.append(block.data(), static_cast<std::size_t>(in_.gcount()));
  return true;
}

bool FileLines::next_whole(std::string_view* line) {
  for (std::size_t looked = at_;;) {
    const std::size_t end = read_.find('\n', looked);
    if (end != std::string::npos) {
      *line = std::string_view(read_).substr(at_, end - at_);
      at_ = end + 1;
      return true;
    }
    const std::size_t left = std::min(read_.size() - at_, kLongestLine);
    if (!read_block()) {
      torn_ = left > 0;
      return false;
    }
    looked = left;
  }
}

bool FileLines::next(std::string_view* line) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  for (std::string_view whole; next_whole(&whole);) {
    if (!std::exchange(begun_, true) && whole.starts_with(kByteOrderMark))
      whole.remove_prefix(kByteOrderMark.size());
    *line = trimmed(whole);
    if (!line->empty() && line->front() != '#') return true;
  }
  return false;
}

CsvRows::CsvRows(NextLine next_line) : next_line_(std::move(next_line)) {
  std::string_view head;
  if (!next_line_(&head)) return;
  std::vector<std::string_view> names(kMostColumns);
  names.resize(std::min(split(head, ',', names), kMostColumns));
  names_.assign(names.begin(), names.end());
  fields_.resize(names_.size());
}

std::optional<std::size_t> CsvRows::column(std::string_view name) const noexcept {
  const auto found = std::find(names_.begin(), names_.end(), name);
  if (found == names_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - names_.begin());
}

bool CsvRows::next() {
  std::string_view line;
  while (next_line_(&line)) {
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
