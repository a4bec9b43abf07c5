#include "firmware_iface/nmea/nmea.hpp"

#include <charconv>
#include <cmath>

namespace vergence::nmea {
namespace {

// In m/s.
constexpr double kKnot = 1852.0 / 3600.0;
// Talker and type.
constexpr std::size_t kAddress = 5;
constexpr std::size_t kMaxDigits = 20;

bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }

/// Digits, one point, a sign before: no exponent, no words.
std::optional<double> number(std::string_view text) noexcept {
  if (text.empty() || text.size() > kMaxDigits) return std::nullopt;
  bool digit = false;
  for (std::size_t i = 0, points = 0; i < text.size(); ++i) {
    if (text[i] == '.' ? ++points > 1 : !is_digit(text[i]) && (text[i] != '-' || i > 0))
      return std::nullopt;
    digit = digit || is_digit(text[i]);
  }
  double value = 0;
  const auto [end, error] =
      std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
  if (!digit || error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<double> within(std::optional<double> value, double least, double most) noexcept {
  return value && *value >= least && *value <= most ? value : std::nullopt;
}

/// The first n characters, all digits.
std::optional<int> digits(std::string_view text, std::size_t n) noexcept {
  if (text.size() < n) return std::nullopt;
  int value = 0;
  for (const char c : text.substr(0, n)) {
    if (!is_digit(c)) return std::nullopt;
    value = 10 * value + (c - '0');
  }
  return value;
}

/// hhmmss[.s…]
std::optional<std::int64_t> time_of_day(std::string_view text) noexcept {
  const auto clock = digits(text, 6);
  if (!clock) return std::nullopt;
  // A second of 60 is a leap second.
  const int hour = *clock / 10000, minute = *clock / 100 % 100, second = *clock % 100;
  if (hour > 23 || minute > 59 || second > 60) return std::nullopt;
  std::int64_t ns = (hour * 3600LL + minute * 60LL + second) * 1'000'000'000;
  if (text.size() == 6) return ns;
  if (text[6] != '.' || text.size() > 6 + 1 + 9) return std::nullopt;
  std::int64_t unit = 100'000'000;
  for (const char c : text.substr(7)) {
    if (!is_digit(c)) return std::nullopt;
    ns += (c - '0') * unit;
    unit /= 10;
  }
  return ns;
}

/// ddmmyy, of 1980 to 2079; days since 1970.
std::optional<std::int32_t> date(std::string_view text) noexcept {
  const auto all = digits(text, 6);
  if (!all || text.size() != 6) return std::nullopt;
  const int day = *all / 10000, month = *all / 100 % 100, short_year = *all % 100;
  if (day < 1 || day > 31 || month < 1 || month > 12) return std::nullopt;
  int year = short_year + (short_year < 80 ? 2000 : 1900);
  // Days from March on, so that a leap day is a year's last.
  const int shifted = (month + 9) % 12;
  if (month <= 2) --year;
  const int days_of_months = (153 * shifted + 2) / 5;
  return 365 * year + year / 4 - year / 100 + year / 400 + days_of_months + day - 1 - 719468;
}

/// [d]ddmm.m… with its hemisphere.
std::optional<double> angle(std::string_view text, std::string_view side, char positive,
                            char negative, double most) noexcept {
  const auto value = within(number(text), 0, 18000);
  if (!value || side.size() != 1 || (side[0] != positive && side[0] != negative))
    return std::nullopt;
  const double degrees = std::floor(*value / 100), minutes = *value - 100 * degrees;
  const double all = degrees + minutes / 60;
  if (minutes >= 60 || all > most) return std::nullopt;
  return side[0] == negative ? -all : all;
}

struct Fields {
  // Missing fields are empty.
  std::array<std::string_view, kMaxFields> at{};
};

bool split(std::string_view body, Fields* fields) noexcept {
  std::size_t n = 0;
  for (;;) {
    if (n == kMaxFields) return false;
    const std::size_t comma = body.find(',');
    fields->at[n++] = body.substr(0, comma);
    if (comma == std::string_view::npos) return true;
    body.remove_prefix(comma + 1);
  }
}

std::uint8_t small(std::string_view text) noexcept {
  const auto value = within(number(text), 0, 255);
  return value ? static_cast<std::uint8_t>(*value) : std::uint8_t{0};
}

void place(const Fields& f, std::size_t first, Sentence* s) noexcept {
  s->latitude_deg = angle(f.at[first], f.at[first + 1], 'N', 'S', 90);
  s->longitude_deg = angle(f.at[first + 2], f.at[first + 3], 'E', 'W', 180);
}

void parse_gga(const Fields& f, Sentence* s) noexcept {
  s->time_of_day_ns = time_of_day(f.at[1]);
  place(f, 2, s);
  s->quality = small(f.at[6]);
  s->satellites = small(f.at[7]);
  s->hdop = within(number(f.at[8]), 0, 100);
  if (f.at[10] == "M") s->altitude_m = within(number(f.at[9]), -1e3, 1e5);
  if (f.at[12] == "M") s->geoid_m = within(number(f.at[11]), -200, 200);
}

void parse_rmc(const Fields& f, Sentence* s) noexcept {
  s->time_of_day_ns = time_of_day(f.at[1]);
  s->valid = f.at[2] == "A";
  place(f, 3, s);
  if (const auto knots = within(number(f.at[7]), 0, 2000)) s->speed = *knots * kKnot;
  s->course_deg = within(number(f.at[8]), 0, 360);
  s->days = date(f.at[9]);
}

void parse_vtg(const Fields& f, Sentence* s) noexcept {
  if (f.at[2] == "T") s->course_deg = within(number(f.at[1]), 0, 360);
  if (f.at[8] == "K") {
    if (const auto kmh = within(number(f.at[7]), 0, 4000)) s->speed = *kmh / 3.6;
  } else if (f.at[6] == "N") {
    if (const auto knots = within(number(f.at[5]), 0, 2000)) s->speed = *knots * kKnot;
  }
}

void parse_gst(const Fields& f, Sentence* s) noexcept {
  s->time_of_day_ns = time_of_day(f.at[1]);
  s->latitude_sigma_m = within(number(f.at[6]), 0, 1e5);
  s->longitude_sigma_m = within(number(f.at[7]), 0, 1e5);
  s->altitude_sigma_m = within(number(f.at[8]), 0, 1e5);
}

std::optional<int> hex(char c) noexcept {
  if (is_digit(c)) return c - '0';
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return std::nullopt;
}

}  // namespace

std::uint8_t checksum(std::string_view body) noexcept {
  std::uint8_t sum = 0;
  for (const char c : body) sum = static_cast<std::uint8_t>(sum ^ static_cast<std::uint8_t>(c));
  return sum;
}

Status parse(std::string_view line, Sentence* sentence) noexcept {
  const std::size_t star = line.rfind('*');
  if (star == std::string_view::npos) return Status::no_checksum;
  if (line.size() != star + 3) return Status::malformed;
  const auto high = hex(line[star + 1]), low = hex(line[star + 2]);
  if (!high || !low) return Status::malformed;
  const std::string_view body = line.substr(0, star);
  if (checksum(body) != 16 * *high + *low) return Status::checksum_wrong;

  Sentence s;
  Fields f;
  // A proprietary address (P…) has a length of its own.
  const bool splits = split(body, &f);
  const std::string_view address = f.at[0];
  const std::string_view type =
      address.size() == kAddress && address[0] != 'P' ? address.substr(2) : std::string_view{};
  if (type == "GGA") {
    s.type = Type::gga;
    if (splits) parse_gga(f, &s);
  } else if (type == "RMC") {
    s.type = Type::rmc;
    if (splits) parse_rmc(f, &s);
  } else if (type == "VTG") {
    s.type = Type::vtg;
    if (splits) parse_vtg(f, &s);
  } else if (type == "GST") {
    s.type = Type::gst;
    if (splits) parse_gst(f, &s);
  } else if (type == "HDT") {
    s.type = Type::hdt;
    if (splits && f.at[2] == "T") s.heading_deg = within(number(f.at[1]), 0, 360);
  }
  if (!splits && s.type != Type::other) return Status::malformed;
  *sentence = s;
  return Status::ok;
}

bool SentenceStream::accept(std::uint8_t byte, Sentence* sentence) noexcept {
  const char c = static_cast<char>(byte);
  if (c == '$') {
    if (inside_) ++counters_.malformed;
    inside_ = true;
    count_ = 0;
    return false;
  }
  if (!inside_) {
    counters_.garbage_bytes += c == '\r' || c == '\n' ? 0U : 1U;
    return false;
  }
  if (c == '\r' || c == '\n') {
    inside_ = false;
    last_size_ = count_ + 3;
    const Status status = parse(std::string_view(line_.data(), count_), sentence);
    counters_.sentences += status == Status::ok ? 1U : 0U;
    counters_.malformed += status == Status::malformed ? 1U : 0U;
    counters_.checksum_wrong +=
        status == Status::checksum_wrong || status == Status::no_checksum ? 1U : 0U;
    return status == Status::ok;
  }
  constexpr std::uint8_t kSpace = 0x20, kTilde = 0x7E;
  if (byte < kSpace || byte > kTilde || count_ == line_.size()) {
    ++counters_.malformed;
    inside_ = false;
    return false;
  }
  line_[count_++] = c;
  return false;
}

}  // namespace vergence::nmea
