#include "app/session/ins_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <system_error>

#include "app/datasets/text_file.hpp"
#include "core/math/angle.hpp"

namespace vergence::app {
namespace {

namespace fs = std::filesystem;

// Maximum deviation from length 1: nine decimals are much closer, and other columns rarely are.
constexpr double kQuaternionLength = 0.02;
constexpr std::array<std::string_view, 4> kFixes{"none", "dead_reckoning", "fix_2d", "fix_3d"};
constexpr std::size_t kColumns = 23;
static_assert(std::ranges::count(kInsHeader, ',') + 1 == kColumns);

template <std::size_t N>
bool finite(const std::array<double, N>& values) {
  return std::ranges::all_of(values, [](double v) { return std::isfinite(v); });
}

void append_sigma(std::string* line, double sigma, double unit) {
  *line += ',';
  if (sigma > 0 && std::isfinite(sigma))
    fmt::format_to(std::back_inserter(*line), "{:.6g}", sigma * unit);
}

/// Reads a line; a field that is no value of its column is refused with file:line.
InsRecord parse(const fs::path& file, std::size_t number, std::string_view line) {
  std::array<std::string_view, kColumns> fields{}, names{};
  if (const std::size_t count = split(line, ',', fields); count != kColumns)
    refuse(file, number,
           fmt::format("has {} columns instead of {}; the line is damaged", count, kColumns));
  (void)split(kInsHeader, ',', names);
  // Index of the next field.
  std::size_t next = 0;
  const auto require = [&](bool read) {
    if (!read)
      refuse(file, number,
             fmt::format("`{}` is not a value of the column {}; the line is damaged",
                         fields[next].substr(0, 40), names[next]));
    ++next;
  };
  constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
  // 0 for an empty field if it is `optional`.
  const auto integer = [&](std::int64_t most, bool optional = false) {
    const auto value = parse_integer(fields[next]);
    require(value ? *value >= 0 && *value <= most : optional && fields[next].empty());
    return value.value_or(0);
  };
  // False: all of them are empty.
  const auto numbers = [&](std::span<double> values) {
    const auto mine = std::span(fields).subspan(next, values.size());
    const bool none = std::ranges::all_of(mine, [](std::string_view f) { return f.empty(); });
    for (double& value : values) require(parse_number(fields[next], &value) || none);
    return !none;
  };
  const auto sigma = [&] {
    double value = 0;
    require(fields[next].empty() || (parse_number(fields[next], &value) && value >= 0));
    return value;
  };
  InsRecord r;
  InsSample& s = r.sample;
  s.stamp = Stamp(integer(kMax));
  s.stamp_error = Duration::nanoseconds(integer(kMax));
  s.number = static_cast<std::uint64_t>(integer(kMax));
  const auto fix = std::ranges::find(kFixes, fields[next]);
  require(fix != kFixes.end());
  s.fix = static_cast<FixStatus>(fix - kFixes.begin());
  std::array<double, 3> place{};
  if (numbers(place))
    s.position = {place[0], place[1], place[2]};
  else
    s.fix = FixStatus::none;
  if (!s.position.plausible())
    refuse(file, number, "the position is not a valid latitude and longitude; the line is damaged");
  s.velocity_valid = numbers(s.velocity_enu);
  s.attitude_valid = numbers(s.q_enu_ins);
  const auto& q = s.q_enu_ins;
  const double length = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3]));
  if (!(std::abs(length - 1) <= kQuaternionLength))
    refuse(file, number,
           fmt::format("the quaternion has the length {:.3g} instead of 1; the line is damaged",
                       length));
  s.position_sigma = sigma();
  s.height_sigma = sigma();
  s.velocity_sigma = sigma();
  s.tilt_sigma = sigma() / kDegreesPerRadian;
  s.heading_sigma = sigma() / kDegreesPerRadian;
  r.quality.status = static_cast<std::uint32_t>(integer(std::numeric_limits<std::uint32_t>::max()));
  r.quality.satellites = static_cast<std::uint8_t>(integer(255, true));
  r.quality.filter_valid = integer(1) != 0;
  r.quality.utc_ns = integer(kMax, true);
  r.quality.utc_valid = r.quality.utc_ns != 0;
  return r;
}

}  // namespace

void format_ins_record(const InsRecord& record, std::string* line) {
  const InsSample& s = record.sample;
  const InsQuality& q = record.quality;
  line->clear();
  const auto out = std::back_inserter(*line);
  fmt::format_to(out, "{},{},{},{}", s.stamp.ns(), s.stamp_error.ns(), s.number,
                 kFixes[static_cast<std::size_t>(s.fix)]);
  if (s.fix != FixStatus::none && s.position.plausible())
    fmt::format_to(out, ",{:.10f},{:.10f},{:.5f}", s.position.latitude_deg,
                   s.position.longitude_deg, s.position.height_m);
  else
    *line += ",,,";
  const bool velocity = s.velocity_valid && finite(s.velocity_enu),
             attitude = s.attitude_valid && finite(s.q_enu_ins);
  for (const double v : s.velocity_enu)
    velocity ? fmt::format_to(out, ",{:.6f}", v) : fmt::format_to(out, ",");
  for (const double v : s.q_enu_ins)
    attitude ? fmt::format_to(out, ",{:.9f}", v) : fmt::format_to(out, ",");
  append_sigma(line, s.position_sigma, 1);
  append_sigma(line, s.height_sigma, 1);
  append_sigma(line, s.velocity_sigma, 1);
  append_sigma(line, s.tilt_sigma, kDegreesPerRadian);
  append_sigma(line, s.heading_sigma, kDegreesPerRadian);
  fmt::format_to(out, ",{},", q.status);
  if (q.satellites != 0) fmt::format_to(out, "{}", q.satellites);
  fmt::format_to(out, ",{},", q.filter_valid ? 1 : 0);
  if (q.utc_valid && q.utc_ns > 0) fmt::format_to(out, "{}", q.utc_ns);
  *line += '\n';
}

fs::path find_ins_file(const fs::path& path) {
  std::error_code ignored;
  const fs::path file = fs::is_directory(path, ignored) ? path / "ins.csv" : path;
  if (!fs::is_regular_file(file, ignored)) return {};
  std::ifstream in(file, std::ios::binary);
  std::string head(kInsHeader.size(), '\0');
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  return file.filename() == "ins.csv" || (in && head == kInsHeader) ? file : fs::path{};
}

std::vector<InsRecord> read_ins_file(const fs::path& file) {
  std::string text = read_text(file);
  // The file is cut after its last complete line; npos + 1 is 0.
  text.resize(text.rfind('\n') + 1);
  Lines lines(text);
  std::string_view line;
  if (!lines.next(&line) || line != kInsHeader)
    refuse(file, 1, "is not the first line of an ins.csv; pass a file that `vergence run` wrote");
  std::vector<InsRecord> records;
  while (lines.next(&line)) {
    const InsRecord record = parse(file, lines.number(), line);
    if (records.empty() || records.back().sample.stamp < record.sample.stamp)
      records.push_back(record);
  }
  if (records.empty()) refuse(file, 0, "has no sample; check that the INS was connected");
  return records;
}

}  // namespace vergence::app
