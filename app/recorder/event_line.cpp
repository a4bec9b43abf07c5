#include "app/recorder/event_line.hpp"

#include <cmath>
#include <cstdint>
#include <iterator>
#include <string_view>
#include <variant>

#include <fmt/format.h>

namespace vergence::app {
namespace {

/// Bytes of the UTF-8 character that `text` begins with; 0: it begins with none (Unicode 15,
/// table 3-7).
std::size_t character_bytes(std::string_view text) noexcept {
  const auto byte = [text](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t n = first >= 0xc2 && first < 0xe0   ? 2
                        : first >= 0xe0 && first < 0xf0 ? 3
                        : first >= 0xf0 && first < 0xf5 ? 4
                                                        : 0;
  if (n == 0 || text.size() < n) return 0;
  // Too long forms, surrogates, and what is beyond the last code point.
  const unsigned least = first == 0xe0 ? 0xa0 : first == 0xf0 ? 0x90 : 0x80;
  const unsigned most = first == 0xed ? 0x9f : first == 0xf4 ? 0x8f : 0xbf;
  if (byte(1) < least || byte(1) > most) return 0;
  for (std::size_t i = 2; i < n; ++i)
    if ((byte(i) & 0xc0U) != 0x80) return 0;
  return n;
}

void append_text(std::string* line, std::string_view text) {
  constexpr std::string_view kReplacement = "\xef\xbf\xbd";
  *line += '"';
  while (!text.empty()) {
    const std::size_t n = character_bytes(text);
    const char c = text.front();
    if (n == 0)
      *line += kReplacement;
    else if (c == '"' || c == '\\')
      (*line += '\\') += c;
    else if (static_cast<unsigned char>(c) < 0x20)
      fmt::format_to(std::back_inserter(*line), "\\u{:04x}", static_cast<unsigned>(c));
    else
      *line += text.substr(0, n);
    text.remove_prefix(n == 0 ? 1 : n);
  }
  *line += '"';
}

void append_value(std::string* line, std::int64_t value) {
  fmt::format_to(std::back_inserter(*line), "{}", value);
}

/// The shortest digits that read back the same; always recognisable as a number with a point.
void append_value(std::string* line, double value) {
  if (!std::isfinite(value)) {
    *line += "null";
    return;
  }
  const std::size_t begin = line->size();
  fmt::format_to(std::back_inserter(*line), "{}", value);
  if (line->find_first_of(".e", begin) == std::string::npos) *line += ".0";
}

void append_value(std::string* line, const char* value) { append_text(line, value); }

}  // namespace

void format_event(const EventRecord& event, std::string* line) {
  line->clear();
  fmt::format_to(std::back_inserter(*line), "{{\"stamp_ns\":{},\"kind\":", event.stamp.ns());
  append_text(line, event.kind);
  *line += ",\"sentence\":";
  append_text(line, event.sentence.data());
  *line += ",\"fields\":{";
  bool any = false;
  for (const EventField& f : event.fields) {
    if (f.name == nullptr) continue;
    if (any) *line += ',';
    any = true;
    append_text(line, f.name);
    *line += ':';
    std::visit([line](auto value) { append_value(line, value); }, f.value);
  }
  *line += "}}\n";
}

}  // namespace vergence::app
