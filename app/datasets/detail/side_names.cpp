#include "app/datasets/detail/side_names.hpp"

#include <algorithm>
#include <map>
#include <optional>

namespace vergence::app::detail {
namespace {

struct Sides {
  std::string_view left, right;
};
/// Those that say more stand first: `left/cam0` is left by `left`.
constexpr std::array kSides{Sides{"left", "right"},
                            Sides{"infrared_1", "infrared_2"},
                            Sides{"infra1", "infra2"},
                            Sides{"infra_1", "infra_2"},
                            Sides{"cam0", "cam1"},
                            Sides{"cam_0", "cam_1"},
                            Sides{"cam00", "cam01"},
                            Sides{"camera0", "camera1"},
                            Sides{"camera_0", "camera_1"},
                            Sides{"image_0", "image_1"},
                            Sides{"image_00", "image_01"},
                            Sides{"image0", "image1"},
                            Sides{"image_2", "image_3"},
                            Sides{"image_02", "image_03"},
                            Sides{"img0", "img1"},
                            Sides{"cam1", "cam2"},
                            Sides{"cam_1", "cam_2"},
                            Sides{"camera1", "camera2"},
                            Sides{"camera_1", "camera_2"},
                            Sides{"image_1", "image_2"},
                            Sides{"image1", "image2"},
                            Sides{"i1", "i2"},
                            Sides{"l", "r"}};

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return c >= 'a' && c <= 'z'; }

/// Whether `word` stands at `at` of a name in small letters as a word of its own: a number is
/// whole, and a word of one letter has no letter beside it.
bool stands_alone(std::string_view name, std::size_t at, std::string_view word) {
  const char before = at > 0 ? name[at - 1] : '/';
  const char after = at + word.size() < name.size() ? name[at + word.size()] : '/';
  if (is_digit(word.back()) && is_digit(after)) return false;
  const bool whole = word.size() > 3 || !is_letter(before);
  return whole && (word.size() > 2 || (!is_letter(after) && !is_letter(before) &&
                                       (is_digit(word.back()) || !is_digit(after))));
}

/// The name with `from` replaced by `to` wherever it stands; nothing: it does not.
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

}  // namespace

std::string lower(std::string_view text) {
  std::string small(text);
  std::transform(small.begin(), small.end(), small.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return small;
}

std::vector<std::array<std::string, 2>> stereo_names(const std::vector<std::string>& names) {
  std::map<std::string, std::string> there;  // by small letters
  for (const std::string& name : names) there.emplace(lower(name), name);
  std::vector<std::array<std::string, 2>> pairs;
  for (const Sides& sides : kSides)
    for (const auto& [small, name] : there) {
      const auto other = replaced(small, sides.left, sides.right);
      const auto found = other ? there.find(*other) : there.end();
      const bool taken = std::any_of(pairs.begin(), pairs.end(),
                                     [&name = name](const auto& pair) { return pair[0] == name; });
      if (found != there.end() && !taken) pairs.push_back({name, found->second});
    }
  return pairs;
}

std::array<std::string, 2> side_prefixes(const std::vector<std::string>& names) {
  std::array<std::string, 2> best;
  std::size_t most = 0;
  for (const Sides& sides : kSides) {
    std::array<std::size_t, 2> count{};
    std::array<std::string, 2> written;
    for (const std::string& name : names) {
      const std::string small = lower(name);
      for (std::size_t k = 0; k < 2; ++k) {
        const std::string_view word = k == 0 ? sides.left : sides.right;
        if (!small.starts_with(word) || !stands_alone(small, 0, word)) continue;
        if (count[k]++ == 0) written[k] = name.substr(0, word.size());
      }
    }
    if (std::min(count[0], count[1]) <= most) continue;
    most = std::min(count[0], count[1]);
    best = written;
  }
  return best;
}

}  // namespace vergence::app::detail
