#include "app/datasets/detail/names.hpp"

#include <algorithm>
#include <map>
#include <sstream>

namespace vergence::app::detail {
namespace {

/// Words for left and right in turns, the more specific ones first: `left/cam0` is left because of
/// `left`. The last ones are for images in one directory: frame 12 is `000012_0.png` and
/// `000012_1.png`.
constexpr const char* kSides =
    "left right infrared_1 infrared_2 infra1 infra2 infra_1 infra_2 fisheye1 fisheye2 cam0 cam1 "
    "cam_0 cam_1 cam00 cam01 camera0 camera1 camera_0 camera_1 image_0 image_1 image_00 image_01 "
    "image0 image1 image_2 image_3 image_02 image_03 img0 img1 cam1 cam2 cam_1 cam_2 camera1 "
    "camera2 camera_1 camera_2 image_1 image_2 image1 image2 i1 i2 caml camr imgl imgr lcam rcam l "
    "r c0 c1 0 1";

std::vector<std::array<std::string, 2>> all_sides() {
  std::vector<std::array<std::string, 2>> all;
  std::istringstream words(kSides);
  for (std::array<std::string, 2> sides; words >> sides[0] >> sides[1];) all.push_back(sides);
  return all;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return c >= 'a' && c <= 'z'; }

/// True if `word` at position `at` of a lower-case name is a separate word: a number is complete,
/// and a word of one letter has no letter next to it.
bool stands_alone(std::string_view name, std::size_t at, std::string_view word) {
  const char before = at > 0 ? name[at - 1] : '/';
  const char after = at + word.size() < name.size() ? name[at + word.size()] : '/';
  if (is_digit(word.back()) && is_digit(after)) return false;
  if (is_digit(word.front()) && is_digit(before)) return false;
  const bool whole = word.size() > 3 || !is_letter(before);
  // One letter before a number is a side only at the beginning of a file name: `L0012.png`.
  return whole && (word.size() > 2 || (!is_letter(after) && !is_letter(before) &&
                                       (is_digit(word.back()) || !is_digit(after) || at == 0)));
}

/// The name with `from` replaced by `to` wherever it occurs; empty if it does not occur.
std::optional<std::string> replaced(std::string name, std::string_view from, std::string_view to) {
  bool any = false;
  for (std::size_t at = name.find(from); at != std::string::npos;) {
    const bool alone = stands_alone(name, at, from);
    if (alone) name.replace(at, from.size(), to);
    any = any || alone;
    at = name.find(from, at + (alone ? to.size() : 1));
  }
  return any ? std::optional(std::move(name)) : std::nullopt;
}

/// Removes and returns a run of digits, or one other character, from the front of *text.
std::string_view pop_token(std::string_view* text) noexcept {
  const std::size_t digits = std::min(text->find_first_not_of("0123456789"), text->size());
  const std::string_view part = text->substr(0, std::max<std::size_t>(digits, 1));
  text->remove_prefix(part.size());
  return part;
}

/// A run of digits without its leading zeros; other characters unchanged.
std::string_view value_of(std::string_view part) noexcept {
  return part.substr(std::min(part.find_first_not_of('0'), part.size()));
}

}  // namespace

bool in_name_order(std::string_view a, std::string_view b) noexcept {
  std::string_view rest_a = a, rest_b = b;
  while (!rest_a.empty() && !rest_b.empty()) {
    const std::string_view value_a = value_of(pop_token(&rest_a)),
                           value_b = value_of(pop_token(&rest_b));
    const auto is_number = [](std::string_view v) { return v.empty() || is_digit(v.front()); };
    if (is_number(value_a) && is_number(value_b) && value_a.size() != value_b.size())
      return value_a.size() < value_b.size();
    if (value_a != value_b) return value_a < value_b;
  }
  if (rest_a.empty() != rest_b.empty()) return rest_a.empty();
  return a.size() != b.size() ? a.size() < b.size() : a < b;
}

bool present(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::exists(path, ignored);
}

std::vector<std::filesystem::path> entries_in(const std::filesystem::path& folder,
                                              std::error_code* error) {
  std::vector<std::filesystem::path> entries;
  std::error_code failed;
  for (std::filesystem::directory_iterator it(folder, failed), end; !failed && it != end;
       it.increment(failed))
    entries.push_back(it->path());
  if (error != nullptr) *error = failed;
  std::ranges::sort(entries, in_name_order, [](const auto& p) { return p.filename().string(); });
  return entries;
}

std::string lower(std::string_view text) {
  std::string small(text);
  std::ranges::transform(small, small.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return small;
}

std::vector<std::array<std::string, 2>> stereo_names(const std::vector<std::string>& names) {
  // Names by their lower-case form.
  std::map<std::string, std::string> there;
  for (const std::string& name : names) there.emplace(lower(name), name);
  std::vector<std::array<std::string, 2>> pairs;
  for (const auto& [left, right] : all_sides()) {
    if (is_digit(left[0])) continue;
    for (const auto& [small, name] : there) {
      const auto other = replaced(small, left, right);
      const auto found = other ? there.find(*other) : there.end();
      if (found != there.end() &&
          std::ranges::find(pairs, name, [](const auto& pair) { return pair[0]; }) == pairs.end())
        pairs.push_back({name, found->second});
    }
  }
  return pairs;
}

std::optional<std::string> without_side(const std::string& name, const std::string& word) {
  return replaced(lower(name), word, "");
}

std::array<std::string, 2> side_names(const std::vector<std::string>& files) {
  std::array<std::string, 2> best;
  std::size_t most = 0;
  for (const auto& sides : all_sides()) {
    std::array<std::size_t, 2> of{};
    for (const std::string& file : files) {
      const bool left = without_side(file, sides[0]).has_value();
      if (left != without_side(file, sides[1]).has_value()) ++of[left ? 0 : 1];
    }
    // A directory of one camera also has some names that look like sides. Numbers are the weakest
    // evidence.
    if (std::min(of[0], of[1]) <= most || 10 * (of[0] + of[1]) < 9 * files.size() ||
        (is_digit(sides[0][0]) && (most > 0 || files.size() < 3)))
      continue;
    most = std::min(of[0], of[1]);
    best = sides;
  }
  return best;
}

}  // namespace vergence::app::detail
