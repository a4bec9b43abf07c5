#include "drivers/options/iidc_options.hpp"

namespace vergence::iidc {
namespace {

OptionTable<Options> make_table() {
  using O = Options;
  constexpr double kMostStrobeUs = 3998;  // 12 bits of 1/1024 ms
  OptionTable<O> t;
  t.number("trigger_source", &O::trigger_source, {0, 3}, "", nullptr,
           "Input of the hardware trigger.");
  t.choice<bool, bool>("trigger_edge", &O::trigger_rising, {{"rising", true}, {"falling", false}},
                       nullptr, "Edge of the pulse that begins the exposure.");
  t.choice<std::optional<unsigned>, unsigned>(
      "trigger_mode", &O::trigger_mode, {{"0", 0U}, {"14", 14U}}, "14 where the camera has it",
      "Trigger mode; 14: a pulse is taken while the frame before is read out.");
  t.number("strobe_pin", &O::strobe_pin, {0, 3}, "", "none", "Output that shows the exposure.");
  t.choice<bool, bool>("strobe_level", &O::strobe_high, {{"high", true}, {"low", false}}, nullptr,
                       "Level of that output during the exposure.");
  t.number("strobe_delay_us", &O::strobe_delay, {0, kMostStrobeUs}, "µs", nullptr,
           "From the exposure's start to the strobe's.");
  t.number("strobe_duration_us", &O::strobe_duration, {0, kMostStrobeUs}, "µs", nullptr,
           "Length of the strobe; 0: as long as the exposure.");
  t.on_off("format7", &O::format7, "where needed",
           "on: only regions (Format 7), off: only fixed modes.");
  t.number("packet_bytes", &O::packet_bytes, {4, 16384, 4}, "bytes", "its share of the bus",
           "Packets of Format 7; smaller ones leave room for others, and take longer.");
  t.choice<std::optional<BusSpeed>, BusSpeed>("speed", &O::speed,
                                              {{"100", BusSpeed::s100},
                                               {"200", BusSpeed::s200},
                                               {"400", BusSpeed::s400},
                                               {"800", BusSpeed::s800}},
                                              "800 where the camera has it, else 400",
                                              "Highest speed on IEEE 1394, in Mbit/s.");
  t.number("buffers", &O::buffers, {4, kMaxBuffers}, "", nullptr,
           "Images; all but four of them can be in use at once.");
  t.on_off("embedded", &O::embedded, nullptr, "Stamp and counter in row 0.");
  t.choice<StampedInstant, StampedInstant>("stamp_at", &O::stamped,
                                           {{"start", StampedInstant::start},
                                            {"middle", StampedInstant::middle},
                                            {"end", StampedInstant::end}},
                                           nullptr,
                                           "What the camera's stamp is of, in the exposure.");
  return t;
}

}  // namespace

const OptionTable<Options>& option_table() {
  static const OptionTable<Options> table = make_table();
  return table;
}

}  // namespace vergence::iidc
