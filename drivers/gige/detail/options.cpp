#include "drivers/gige/detail/options.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <functional>
#include <span>

#include "drivers/gige/gige.hpp"

namespace vergence::gige {
namespace {

using Taker = bool (*)(const std::string& text, Options* o);

bool number(const std::string& text, double least, double most, double* value) {
  double v = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), v);
  if (error != std::errc{} || end != text.data() + text.size() || !(v >= least && v <= most))
    return false;
  *value = v;
  return true;
}
template <class Integer>
bool integer(const std::string& text, double least, double most, Integer* value) {
  double v = 0;
  if (!number(text, least, most, &v) || v != std::floor(v)) return false;
  *value = static_cast<Integer>(v);
  return true;
}
bool on_off(const std::string& text, bool* value) {
  if (text != "on" && text != "off" && text != "true" && text != "false") return false;
  *value = text == "on" || text == "true";
  return true;
}
bool word(const std::string& text, std::initializer_list<const char*> words, std::string* value) {
  for (const char* w : words)
    if (text == w) {
      *value = text;
      return true;
    }
  return false;
}

constexpr std::array kRows{
    OptionRow{
        "packet_size", "bytes, 576 to 65000", "computed",
        "Size of the stream's packets with their headers: the interface's MTU, at most 9000."},
    OptionRow{"packet_delay_us", "µs, 0 to 10000", "computed",
              "Pause after each packet, so that the cameras of one link interleave."},
    OptionRow{"link_mbps", "Mbit/s", "the interface's",
              "Speed of the slowest link that the cameras share, where a switch is in between."},
    OptionRow{"link_cameras", "1 to 16", "all GigE cameras", "Cameras that share that link."},
    OptionRow{
        "packet_socket", "on, off", "off",
        "Receives through a packet socket (needs CAP_NET_RAW): less work, frames some ms later."},
    OptionRow{"resend", "auto, on, off", "auto",
              "Asks again for lost packets; auto: where the camera says that it can."},
    OptionRow{"frame_retention_ms", "ms, 1 to 1000", "3 periods",
              "How long an incomplete frame waits for packets that were asked for again."},
    OptionRow{"socket_buffer_kb", "KiB", "eight frames",
              "Receive buffer of the socket; needs net.core.rmem_max of that size."},
    OptionRow{"buffers", "4 to 48", "12", "Frames that may be in use at once."},
    OptionRow{"trigger_line", "a name of the camera", "Line1", "Input of the hardware trigger."},
    OptionRow{"trigger_edge", "rising, falling", "rising",
              "Edge of the pulse that begins the exposure."},
    OptionRow{"trigger_overlap", "off, readout, previous_frame", "the camera's",
              "Whether a pulse is taken while the frame before is read out."},
    OptionRow{"trigger_delay_us", "µs, 0 to 1000000", "0", "From the pulse to the exposure."},
    OptionRow{"exposure_mode", "timed, trigger_width", "timed",
              "trigger_width: the pulse's length is the exposure."},
    OptionRow{"exposure_line", "a name of the camera", "none",
              "Output that is high during the exposure."},
    OptionRow{"stamp_at", "start, end", "start",
              "What the camera's time stamp is of: the exposure's start or its end."},
    OptionRow{"ptp", "on, off", "off", "The camera's clock follows the network's (IEEE 1588)."},
    OptionRow{"chunks", "auto, off", "auto",
              "Each frame reports its own exposure, where the camera can (chunk data)."},
    OptionRow{"heartbeat_ms", "ms, 500 to 60000", "the camera's",
              "After so long without a word from us the camera gives up its controller."},
    OptionRow{"feature.NAME", "a value", "",
              "Any feature of the camera by its own name, set after everything else."},
};
// In the order of kRows.
constexpr std::array<Taker, kRows.size() - 1> kTakers{
    [](const std::string& t, Options* o) { return integer(t, 576, 65000, &o->packet_size); },
    [](const std::string& t, Options* o) {
      double us = 0;
      const bool ok = number(t, 0, 10000, &us);
      if (ok) o->packet_delay = Duration::seconds(us * 1e-6);
      return ok;
    },
    [](const std::string& t, Options* o) {
      const bool ok = integer(t, 1, 400'000, &o->link_speed);
      if (ok) o->link_speed *= 1'000'000;
      return ok;
    },
    [](const std::string& t, Options* o) { return integer(t, 1, 16, &o->link_cameras); },
    [](const std::string& t, Options* o) { return on_off(t, &o->packet_socket); },
    [](const std::string& t, Options* o) {
      bool on = false;
      if (t == "auto") {
        o->resend = Options::Resend::automatic;
        return true;
      }
      if (!on_off(t, &on)) return false;
      o->resend = on ? Options::Resend::on : Options::Resend::off;
      return true;
    },
    [](const std::string& t, Options* o) {
      double ms = 0;
      const bool ok = number(t, 1, 1000, &ms);
      if (ok) o->frame_retention = Duration::seconds(ms * 1e-3);
      return ok;
    },
    [](const std::string& t, Options* o) {
      const bool ok = integer(t, 64, 500'000, &o->socket_buffer);
      if (ok) o->socket_buffer *= 1024;
      return ok;
    },
    [](const std::string& t, Options* o) { return integer(t, 4, 48, &o->buffers); },
    [](const std::string& t, Options* o) { return !(o->line = t).empty(); },
    [](const std::string& t, Options* o) {
      return word(t, {"rising", "falling"}, &o->edge);
    },
    [](const std::string& t, Options* o) {
      return word(t, {"off", "readout", "previous_frame"}, &o->overlap);
    },
    [](const std::string& t, Options* o) { return number(t, 0, 1'000'000, &o->trigger_delay_us); },
    [](const std::string& t, Options* o) {
      return word(t, {"timed", "trigger_width"}, &o->exposure_mode);
    },
    [](const std::string& t, Options* o) { return !(o->exposure_line = t).empty(); },
    [](const std::string& t, Options* o) {
      o->stamp_at_end = t == "end";
      return t == "start" || t == "end";
    },
    [](const std::string& t, Options* o) { return on_off(t, &o->ptp); },
    [](const std::string& t, Options* o) {
      o->chunks = t == "auto";
      return t == "auto" || t == "off";
    },
    [](const std::string& t, Options* o) { return integer(t, 500, 60'000, &o->heartbeat_ms); },
};

}  // namespace

std::span<const OptionRow> option_rows() noexcept { return kRows; }

std::string parse_options(const std::map<std::string, std::string>& given, Options* options) {
  constexpr std::string_view kFeature = "feature.";
  Options o;
  for (const auto& [name, value] : given) {
    if (name.starts_with(kFeature) && name.size() > kFeature.size()) {
      o.features.emplace_back(name.substr(kFeature.size()), value);
      continue;
    }
    std::size_t i = 0;
    while (i < kTakers.size() && name != kRows[i].name) ++i;
    if (i == kTakers.size()) {
      std::string known;
      for (const OptionRow& row : kRows)
        known += (known.empty() ? "" : ", ") + std::string(row.name);
      return "there is no option \"" + name + "\"; GigE cameras have " + known;
    }
    if (!kTakers[i](value, &o))
      return "the option " + name + " is \"" + value + "\"; it takes " + kRows[i].values;
  }
  *options = std::move(o);
  return {};
}

}  // namespace vergence::gige
