#include "app/datasets/detail/pairing.hpp"
#include "core/math/robust.hpp"

#include <cstdint>
#include <cstdlib>
#include <limits>
#include <map>

#include <fmt/format.h>

namespace vergence::app::detail {
namespace {

/// Distance of two stamps, limited to 64 bits because files may have arbitrary stamps.
std::int64_t apart(Stamp a, Stamp b) {
  const auto later = static_cast<std::uint64_t>(std::max(a, b).ns()),
             earlier = static_cast<std::uint64_t>(std::min(a, b).ns());
  constexpr auto kMax = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  return static_cast<std::int64_t>(std::min(later - earlier, kMax));
}

/// First index of every stamp.
using IndexByStamp = std::map<Stamp, std::size_t>;

IndexByStamp index_stamps(std::span<const Stamp> stamps) {
  IndexByStamp index;
  for (std::size_t i = 0; i < stamps.size(); ++i) index.emplace(stamps[i], i);
  return index;
}

/// Index of the nearest stamp; the earlier one of two. Precondition: there is one.
std::size_t nearest(const IndexByStamp& stamps, Stamp to) {
  const auto after = stamps.lower_bound(to);
  if (after == stamps.begin()) return after->second;
  const auto before = std::prev(after);
  const bool earlier = after == stamps.end() || apart(before->first, to) <= apart(after->first, to);
  return (earlier ? before : after)->second;
}

template <typename T>
T at_share(std::vector<T> values, double share) {
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(
                                          share * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

}  // namespace

Duration usual_interval(std::span<const Stamp> stamps) {
  std::vector<std::int64_t> ns;
  for (std::size_t i = 1; i < stamps.size(); ++i)
    if (stamps[i] > stamps[i - 1]) ns.push_back(apart(stamps[i], stamps[i - 1]));
  if (ns.empty()) return Duration::milliseconds(100);
  return Duration::nanoseconds(median(std::span(ns)));
}

std::vector<std::array<std::size_t, 2>> pair_nearest(std::span<const Stamp> left,
                                                     std::span<const Stamp> right, Duration most) {
  std::vector<std::array<std::size_t, 2>> pairs;
  if (left.empty() || right.empty()) return pairs;
  const IndexByStamp of_left = index_stamps(left), of_right = index_stamps(right);
  for (std::size_t l = 0; l < left.size(); ++l) {
    const std::size_t r = nearest(of_right, left[l]);
    if (apart(left[l], right[r]) <= most.ns() && nearest(of_left, right[r]) == l)
      pairs.push_back({l, r});
  }
  return pairs;
}

PairOffset pair_offset(std::span<const Stamp> left, std::span<const Stamp> right,
                       std::span<const std::array<std::size_t, 2>> pairs) {
  constexpr double kMiddle = 0.5, kMax = 0.95;
  std::vector<std::int64_t> ns, far;
  for (const auto& [l, r] : pairs) {
    ns.push_back((right[r] - left[l]).ns());
    far.push_back(std::abs(ns.back()));
  }
  if (ns.empty()) return {};
  return {Duration::nanoseconds(at_share(std::move(ns), kMiddle)),
          Duration::nanoseconds(at_share(std::move(far), kMax))};
}

std::string describe(const PairOffset& offset) {
  return fmt::format("{:.6g} ms (median; 95 % within {:.6g} ms)", 1e3 * offset.median.to_seconds(),
                     1e3 * offset.farthest.to_seconds());
}

void remark_pairs(const std::string& left, const std::string& right, const PairOffset& offset,
                  Duration interval, std::size_t alone, std::vector<std::string>* remarks) {
  constexpr Duration kSuspicious = Duration::milliseconds(5);
  // Share of the interval.
  constexpr double kSuspiciousShare = 0.1;
  const Duration far = std::max({offset.median, -offset.median, offset.farthest});
  if (far > kSuspicious || far.to_seconds() > kSuspiciousShare * interval.to_seconds())
    remarks->push_back(fmt::format(
        "the stamps of {} and {} differ by {} at an interval of {:.3g} ms: if the cameras do not "
        "expose together, poses are less accurate in turns; if they do, correct the stamps of one",
        left, right, describe(offset), 1e3 * interval.to_seconds()));
  if (alone > 0)
    remarks->push_back(
        fmt::format("{} images have no partner within {:.0f} % of the interval and are skipped",
                    alone, 100 * kMaxApart));
}

std::vector<std::size_t> ascending(std::span<const Stamp> stamps) {
  std::vector<std::size_t> ends, before(stamps.size());
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    const auto place = std::lower_bound(ends.begin(), ends.end(), stamps[i],
                                        [&](std::size_t e, Stamp s) { return stamps[e] < s; });
    before[i] = place == ends.begin() ? i : *(place - 1);
    if (place == ends.end())
      ends.push_back(i);
    else if (stamps[i] < stamps[*place])
      // The first of equal stamps stays.
      *place = i;
  }
  std::vector<std::size_t> kept(ends.size());
  if (ends.empty()) return kept;
  std::size_t at = ends.back();
  for (std::size_t n = kept.size(); n-- > 0; at = before[at]) kept[n] = at;
  return kept;
}

}  // namespace vergence::app::detail
