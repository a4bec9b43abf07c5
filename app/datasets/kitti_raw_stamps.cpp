#include <algorithm>

#include "app/datasets/decimal.hpp"
#include "app/datasets/detail/kitti_raw.hpp"
#include "app/datasets/recorded_ins.hpp"
#include "app/datasets/stamp_text.hpp"
#include "app/datasets/text_file.hpp"

namespace vergence::app::detail {
namespace {

constexpr std::size_t kLargest = std::size_t{128} << 20U;  // bytes: more lines than may be

std::size_t decimals(std::string_view line) noexcept {
  const std::size_t point = line.find('.');
  return point == std::string_view::npos ? 0 : line.size() - point - 1;
}

}  // namespace

KittiStamps read_kitti_stamps(const std::filesystem::path& file) {
  const std::string text = read_text(file, kLargest);
  KittiStamps stamps;
  std::size_t good = 0, last_decimals = 0;
  std::string_view rest = text;
  while (!rest.empty()) {
    const std::size_t end = rest.find('\n');
    const std::string_view line = trimmed(rest.substr(0, end));
    const bool cut = end == std::string_view::npos;
    rest.remove_prefix(cut ? rest.size() : end + 1);
    if (stamps.lines.size() == kMostReadings)
      refuse(file, stamps.lines.size(),
             "and there are more lines: more than any drive has, so this is not the file that is "
             "meant");
    std::optional<Stamp> stamp = parse_iso_time(line);
    if (stamp && cut && good > 0 && decimals(line) < last_decimals) stamp.reset();
    stamps.lines.push_back(stamp);
    if (stamp) {
      ++good;
      last_decimals = decimals(line);
    } else if (stamps.broken++ == 0) {
      stamps.first_broken = stamps.lines.size();
    }
  }
  if (good == 0)
    refuse(file, stamps.first_broken,
           "has no stamp like 2011-09-26 14:05:35.500923136; one a line and file is expected");
  return stamps;
}

}  // namespace vergence::app::detail
