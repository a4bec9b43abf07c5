#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "app/datasets/decimal.hpp"
#include "app/datasets/stereo_sequence.hpp"
#include "app/datasets/text_file.hpp"

namespace vergence::app {
namespace {

constexpr double
    kShortest = 1e-3,
    kLongest = 10;  // s: faster than any stereo camera; farther than motion can be predicted across
constexpr double kUsual = 0.05;  // s

struct Unit {
  const char* name;
  double seconds;
};
constexpr std::array kUnits{Unit{"nanoseconds", 1e-9}, Unit{"microseconds", 1e-6},
                            Unit{"milliseconds", 1e-3}, Unit{"seconds", 1}};

/// The unit that makes a step of `number` the most usual one; `read_as` s a unit is not it.
const Unit* likely_unit(double number, double read_as) {
  const Unit* best = nullptr;
  const auto strange = [number](const Unit& u) {
    return std::abs(std::log(number * u.seconds / kUsual));
  };
  for (const Unit& unit : kUnits) {
    const double step = number * unit.seconds;
    if (unit.seconds == read_as || step < kShortest || step > kLongest) continue;
    if (best == nullptr || strange(unit) < strange(*best)) best = &unit;
  }
  return best;
}

std::string in_words(double seconds) {
  if (seconds < 1e-6) return fmt::format("{:.0f} ns", seconds * 1e9);
  if (seconds < 1e-3) return fmt::format("{:.4g} µs", seconds * 1e6);
  return fmt::format("{:.4g} s", seconds);
}

}  // namespace

void check_times(const StereoSequence& sequence) {
  // Half of what 64 bits hold: no difference of two stamps is beyond them.
  constexpr std::int64_t kFarthest = std::int64_t{1} << 62;  // ns: 1823 to 2116
  const std::filesystem::path file = sequence.times.empty() ? sequence.root : sequence.times;
  for (const StereoPair& pair : sequence.pairs)
    if (pair.stamp.ns() > kFarthest || pair.stamp.ns() < -kFarthest)
      refuse(file, 0,
             fmt::format("has the stamp {} ns, {} s from 1970; those of a drive are between the "
                         "years 1824 and 2116: are these other units, or is the line broken?",
                         pair.stamp.ns(), format_seconds(pair.stamp.ns())));
  if (sequence.pairs.size() < 3) return;
  std::vector<double> steps;  // s, those forward
  std::size_t backward = 0;
  for (std::size_t i = 1; i < sequence.pairs.size(); ++i) {
    const double step = (static_cast<double>(sequence.pairs[i].stamp.ns()) -
                         static_cast<double>(sequence.pairs[i - 1].stamp.ns())) *
                        1e-9;
    if (sequence.pairs[i].stamp > sequence.pairs[i - 1].stamp)
      steps.push_back(step);
    else if (sequence.pairs[i].stamp < sequence.pairs[i - 1].stamp)
      ++backward;
  }
  const std::size_t all = sequence.pairs.size() - 1;
  if (2 * steps.size() < all)
    refuse(file, 0,
           fmt::format("has times that do not go forward: of {} steps from pair to pair {} go back "
                       "and {} stand still; are the lines in the order "
                       "of the images, the oldest first?",
                       all, backward, all - backward - steps.size()));
  // The lower middle: a gap is no unit.
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>((steps.size() - 1) / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  if (*middle >= kShortest && *middle <= kLongest) return;
  // Whole numbers were read as nanoseconds, numbers with a point as seconds; a step that is too
  // short was whole.
  const double read_as = *middle < kShortest ? 1e-9 : 1.0;
  const Unit* unit = likely_unit(*middle / read_as, read_as);
  const std::string ask = unit != nullptr ? fmt::format("are these {}?", unit->name)
                                          : "steps of 1 ms to 10 s are those of a drive.";
  std::string help;
  if (file.extension() == ".txt") {  // else the format has its one unit
    help = " Whole numbers are read as nanoseconds, numbers with a point as seconds";
    if (unit != nullptr && unit->seconds == 1) help += ": write these with a point";
    if (unit != nullptr && unit->seconds < 1)
      help +=
          fmt::format(": divide these by {:.0f} and write them with a point", 1 / unit->seconds);
  }
  refuse(file, 0,
         fmt::format("has pairs that follow one another after {} (median); {}{}", in_words(*middle),
                     ask, help));
}

}  // namespace vergence::app
