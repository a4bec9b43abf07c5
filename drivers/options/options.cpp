#include "drivers/options/options.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <type_traits>

namespace vergence::gige {
namespace {

OptionTable<Options> make_table() {
  using O = Options;
  OptionTable<O> t;
  t.number("packet_size", &O::packet_size, {576, 65000}, "bytes", "computed",
           "Packet size including headers, at most 9000; default: the MTU of the interface.");
  t.number("packet_delay_us", &O::packet_delay, {0, 10000}, "µs", "computed",
           "Pause after each packet, so that the cameras of one link interleave.");
  t.number("link_mbps", &O::link_mbps, {1, 400000}, "Mbit/s", "the interface's",
           "Speed of the slowest link that the cameras share, if there is a switch.");
  t.number("link_cameras", &O::link_cameras, {1, 16}, "", "all GigE cameras",
           "Cameras that share that link.");
  t.choice<Resend, Resend>(
      "resend", &O::resend, {{"auto", Resend::automatic}, {"on", Resend::on}, {"off", Resend::off}},
      nullptr, "Requests lost packets again; auto: if the camera supports it.");
  t.number("socket_buffer_kb", &O::socket_buffer_kb, {64, 500000}, "KiB", "eight frames",
           "Receive buffer of the socket; needs net.core.rmem_max of that size.");
  t.number("buffers", &O::buffers, {4, 48}, "", nullptr, "Frames that may be in use at once.");
  t.text("trigger_line", &O::line, "a name of the camera", nullptr,
         "Input of the hardware trigger.");
  t.choice<TriggerEdge, TriggerEdge>(
      "trigger_edge", &O::edge,
      {{"rising", TriggerEdge::rising}, {"falling", TriggerEdge::falling}}, nullptr,
      "Edge of the pulse that starts the exposure.");
  t.choice<bool, bool>("stamp_at", &O::stamp_at_end, {{"start", false}, {"end", true}}, nullptr,
                       "Instant of the camera's time stamp: start or end of the exposure.");
  t.on_off("ptp", &O::ptp, nullptr, "The camera's clock is synchronised by PTP (IEEE 1588).");
  t.others("feature.", &O::features, "a value",
           "Any feature of the camera by its own name, set after everything else.");
  return t;
}

}  // namespace

const OptionTable<Options>& option_table() {
  static const OptionTable<Options> table = make_table();
  return table;
}

}  // namespace vergence::gige

namespace vergence::iidc {
namespace {

OptionTable<Options> make_table() {
  using O = Options;
  // Maximum of 12 bits of 1/1024 ms.
  constexpr double kMaxStrobeUs = 3998;
  OptionTable<O> t;
  t.number("trigger_source", &O::trigger_source, {0, 3}, "", nullptr,
           "Input of the hardware trigger.");
  t.choice<bool, bool>("trigger_edge", &O::trigger_rising, {{"rising", true}, {"falling", false}},
                       nullptr, "Edge of the pulse that starts the exposure.");
  t.choice<std::optional<unsigned>, unsigned>(
      "trigger_mode", &O::trigger_mode, {{"0", 0U}, {"14", 14U}}, "14 if the camera supports it",
      "Trigger mode; 14: a pulse is accepted during the read-out of the previous frame.");
  t.number("strobe_pin", &O::strobe_pin, {0, 3}, "", "none",
           "Output that is active during the exposure.");
  t.choice<bool, bool>("strobe_level", &O::strobe_high, {{"high", true}, {"low", false}}, nullptr,
                       "Level of that output during the exposure.");
  t.number("strobe_delay_us", &O::strobe_delay, {0, kMaxStrobeUs}, "µs", nullptr,
           "From the start of the exposure to the start of the strobe.");
  t.number("strobe_duration_us", &O::strobe_duration, {0, kMaxStrobeUs}, "µs", nullptr,
           "Length of the strobe; 0: as long as the exposure.");
  t.on_off("format7", &O::format7, "where needed",
           "on: only regions (Format 7), off: only fixed modes.");
  t.number("packet_bytes", &O::packet_bytes, {4, 16384, 4}, "bytes", "its share of the bus",
           "Packet size of Format 7; smaller packets leave bandwidth for other cameras and take "
           "longer.");
  t.choice<std::optional<BusSpeed>, BusSpeed>("speed", &O::speed,
                                              {{"100", BusSpeed::s100},
                                               {"200", BusSpeed::s200},
                                               {"400", BusSpeed::s400},
                                               {"800", BusSpeed::s800}},
                                              "800 if the camera supports it, else 400",
                                              "Highest speed on IEEE 1394, in Mbit/s.");
  t.number("buffers", &O::buffers, {4, kMaxBuffers}, "", nullptr,
           "Images; all but four of them can be in use at once.");
  t.on_off("embedded", &O::embedded, nullptr, "Stamp and counter in row 0.");
  t.choice<StampedInstant, StampedInstant>("stamp_at", &O::stamped,
                                           {{"start", StampedInstant::start},
                                            {"middle", StampedInstant::middle},
                                            {"end", StampedInstant::end}},
                                           nullptr,
                                           "Instant of the camera's stamp within the exposure.");
  return t;
}

}  // namespace

const OptionTable<Options>& option_table() {
  static const OptionTable<Options> table = make_table();
  return table;
}

}  // namespace vergence::iidc

namespace vergence::v4l2 {
namespace {

OptionTable<Options> make_table() {
  using O = Options;
  OptionTable<O> t;
  t.number("readout_us", &O::readout, {0, 1000000}, "µs", "the sensor's own figures, else 0",
           "From the end of the exposure to the last pixel.");
  t.number("thin", &O::thin, {1, 60}, "", nullptr,
           "The camera runs at this multiple of the rate; one image per interval is kept.");
  // 32 is the kernel's limit.
  t.number("buffers", &O::buffers, {4, 32}, "", nullptr,
           "Images; all but two of them can be in use at once.");
  t.number("shift", &O::shift, {0, 8}, "bits", "by the format",
           "Lower bits of `Y10` to `Y16` that are dropped.");
  t.text("subdevice", &O::subdevice, "/dev/v4l-subdevN", "none",
         "Sensor behind a media controller; its controls are also used.");
  t.text("trigger_control", &O::trigger_control, "key of a control, external",
         "the first with \"trigger\"",
         "Control that enables the hardware trigger; external: it is enabled elsewhere.");
  t.text("trigger_value", &O::trigger_value, "a number, a menu item's key",
         "external, hardware, on or 1", "Value of that control.");
  t.number("gain_step_db", &O::gain_step_db, {0.001, 20}, "dB", "not known",
           "One step of the gain control.");
  t.others("control_", &O::controls, "a number, a menu item's key",
           "Any control by its key (see below).");
  return t;
}

}  // namespace

const OptionTable<Options>& option_table() {
  static const OptionTable<Options> table = make_table();
  return table;
}

}  // namespace vergence::v4l2

namespace vergence {

std::optional<double> parse_number(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value))
    return std::nullopt;
  return value;
}

std::optional<bool> parse_switch(std::string_view text) {
  if (text == "on" || text == "yes" || text == "true") return true;
  if (text == "off" || text == "no" || text == "false") return false;
  return std::nullopt;
}

std::string shortest_text(double value) {
  std::array<char, 32> text{};
  // Whole numbers are shown with all digits: 1000000, not 1e+06.
  const bool whole = value == std::floor(value) && std::abs(value) < 1e15;
  const auto end = whole ? std::to_chars(text.begin(), text.end(), value, std::chars_format::fixed)
                         : std::to_chars(text.begin(), text.end(), value);
  return {text.begin(), end.ptr};
}

namespace {

const OptionTable<gige::Options>& table_of(const gige::Options&) { return gige::option_table(); }
const OptionTable<iidc::Options>& table_of(const iidc::Options&) { return iidc::option_table(); }
const OptionTable<v4l2::Options>& table_of(const v4l2::Options&) { return v4l2::option_table(); }

/// Returns the result of `use` for the options' kind, or `none` without a kind.
template <class Variant, class Result, class Use>
Result with_kind(Variant& options, Result none, const Use& use) {
  return std::visit(
      [&](auto& kind) -> Result {
        if constexpr (std::is_same_v<std::decay_t<decltype(kind)>, std::monostate>)
          return none;
        else
          return use(table_of(kind), kind);
      },
      options);
}

}  // namespace

std::optional<CameraOptions> default_options(std::string_view driver) {
  if (driver == "gige") return gige::Options{};
  if (driver == "iidc-usb" || driver == "iidc-1394") return iidc::Options{};
  if (driver == "v4l2") return v4l2::Options{};
  return std::nullopt;
}

bool set_option(std::string_view name, std::string_view text, CameraOptions* options) {
  return with_kind(*options, false,
                   [&](const auto& table, auto& kind) { return table.set(name, text, &kind); });
}

const std::vector<OptionRow>& option_rows(const CameraOptions& options) {
  static const std::vector<OptionRow> none;
  return *with_kind(options, &none, [](const auto& table, const auto&) { return &table.rows(); });
}

const OptionRow* find_option(const CameraOptions& options, std::string_view name) {
  return with_kind(options, static_cast<const OptionRow*>(nullptr),
                   [&](const auto& table, const auto&) { return table.find(name); });
}

std::string options_text(const CameraOptions& options) {
  return with_kind(options, std::string(),
                   [](const auto& table, const auto& kind) { return table.to_text(kind); });
}

}  // namespace vergence
