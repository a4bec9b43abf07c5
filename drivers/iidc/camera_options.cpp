#include "drivers/iidc/camera_options.hpp"

#include <array>
#include <charconv>
#include <string_view>

#include "drivers/iidc/bus.hpp"

namespace vergence::iidc {
namespace {

std::optional<std::uint64_t> number(std::string_view text, std::uint64_t least,
                                    std::uint64_t most) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value < least || value > most)
    return std::nullopt;
  return value;
}

std::optional<bool> yes_or_no(std::string_view text) {
  if (text == "yes" || text == "true" || text == "on") return true;
  if (text == "no" || text == "false" || text == "off") return false;
  return std::nullopt;
}

/// One option: its name, what it takes (for sentences), and how it is taken. False: the value
/// cannot be.
struct Row {
  std::string_view name, takes;
  bool (*take)(std::string_view text, CameraOptions* o);
};

constexpr std::uint64_t kMostStrobeUs = 3998;  // 12 bits of 1/1024 ms

template <auto Member>
bool take_duration(std::string_view text, CameraOptions* o) {
  const auto us = number(text, 0, kMostStrobeUs);
  if (us) o->*Member = Duration::microseconds(static_cast<std::int64_t>(*us));
  return us.has_value();
}

constexpr std::array kRows{
    Row{"buffers", "4 to 32",
        [](std::string_view t, CameraOptions* o) {
          const auto n = number(t, 4, kMaxBuffers);
          if (n) o->buffers = static_cast<std::size_t>(*n);
          return n.has_value();
        }},
    Row{"embedded", "yes or no",
        [](std::string_view t, CameraOptions* o) {
          const auto b = yes_or_no(t);
          if (b) o->embedded = *b;
          return b.has_value();
        }},
    Row{"format7", "yes or no",
        [](std::string_view t, CameraOptions* o) {
          o->format7 = yes_or_no(t);
          return o->format7.has_value();
        }},
    Row{"packet_bytes", "a multiple of 4 from 4 to 16384",
        [](std::string_view t, CameraOptions* o) {
          const auto n = number(t, 4, 16384);
          if (!n || *n % 4 != 0) return false;
          o->packet_bytes = static_cast<std::size_t>(*n);
          return true;
        }},
    Row{"speed", "100, 200, 400 or 800",
        [](std::string_view t, CameraOptions* o) {
          if (t == "100") o->speed = BusSpeed::s100;
          if (t == "200") o->speed = BusSpeed::s200;
          if (t == "400") o->speed = BusSpeed::s400;
          if (t == "800") o->speed = BusSpeed::s800;
          return o->speed.has_value();
        }},
    Row{"stamp_at", "start, middle or end",
        [](std::string_view t, CameraOptions* o) {
          if (t == "start") o->stamped = StampedInstant::start;
          if (t == "middle") o->stamped = StampedInstant::middle;
          if (t == "end") o->stamped = StampedInstant::end;
          return t == "start" || t == "middle" || t == "end";
        }},
    Row{"strobe_delay_us", "0 to 3998", &take_duration<&CameraOptions::strobe_delay>},
    Row{"strobe_duration_us", "0 (the exposure) to 3998",
        &take_duration<&CameraOptions::strobe_duration>},
    Row{"strobe_level", "high or low",
        [](std::string_view t, CameraOptions* o) {
          o->strobe_high = t == "high";
          return t == "high" || t == "low";
        }},
    Row{"strobe_pin", "0 to 3",
        [](std::string_view t, CameraOptions* o) {
          const auto n = number(t, 0, 3);
          if (n) o->strobe_pin = static_cast<unsigned>(*n);
          return n.has_value();
        }},
    Row{"trigger_edge", "rising or falling",
        [](std::string_view t, CameraOptions* o) {
          o->trigger_rising = t == "rising";
          return t == "rising" || t == "falling";
        }},
    Row{"trigger_mode", "0 or 14",
        [](std::string_view t, CameraOptions* o) {
          if (t != "0" && t != "14") return false;
          o->trigger_mode = t == "0" ? 0U : 14U;
          return true;
        }},
    Row{"trigger_source", "0 to 3",
        [](std::string_view t, CameraOptions* o) {
          const auto n = number(t, 0, 3);
          if (n) o->trigger_source = static_cast<unsigned>(*n);
          return n.has_value();
        }},
};

}  // namespace

DeviceStatus parse_options(const std::map<std::string, std::string>& given, CameraOptions* options,
                           std::string* message) {
  CameraOptions out;
  for (const auto& [name, text] : given) {
    const Row* row = nullptr;
    for (const Row& r : kRows)
      if (r.name == name) row = &r;
    if (row == nullptr) {
      *message = "there is no option \"" + name + "\"; IIDC cameras have ";
      for (const Row& r : kRows) *message += (&r == kRows.data() ? "" : ", ") + std::string(r.name);
      return DeviceStatus::unsupported;
    }
    if (!row->take(text, &out)) {
      *message =
          "option " + name + " cannot be \"" + text + "\"; it takes " + std::string(row->takes);
      return DeviceStatus::bad_configuration;
    }
  }
  *options = out;
  return DeviceStatus::ok;
}

}  // namespace vergence::iidc
