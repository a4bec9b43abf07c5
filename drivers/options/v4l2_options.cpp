#include "drivers/options/v4l2_options.hpp"

namespace vergence::v4l2 {
namespace {

OptionTable<Options> make_table() {
  using O = Options;
  OptionTable<O> t;
  t.number("readout_us", &O::readout, {0, 1000000}, "µs", "the sensor's own figures, else 0",
           "From the end of the exposure to the last pixel.");
  t.number("thin", &O::thin, {1, 60}, "", nullptr,
           "The camera runs at so many times the rate, one image in each interval is kept.");
  t.number("buffers", &O::buffers, {4, 32}, "", nullptr,  // 32: the kernel's own limit
           "Images; all but two of them can be in use at once.");
  t.number("shift", &O::shift, {0, 8}, "bits", "by the format",
           "Bits below the eight that are kept, of `Y10` to `Y16`.");
  t.text("subdevice", &O::subdevice, "/dev/v4l-subdevN", "none",
         "A sensor behind a media controller, whose controls are then used as well.");
  t.text("trigger_control", &O::trigger_control, "key of a control, external",
         "the first with \"trigger\"",
         "Switches the hardware trigger on; external: something outside does.");
  t.text("trigger_value", &O::trigger_value, "a number, a menu item's key",
         "external, hardware, on or 1", "What that control is set to.");
  t.number("gain_step_db", &O::gain_step_db, {0.001, 20}, "dB", "not known",
           "One step of the gain control.");
  t.others("control_", &O::controls, "a number, a menu item's key", "Any control by its key.");
  return t;
}

}  // namespace

const OptionTable<Options>& option_table() {
  static const OptionTable<Options> table = make_table();
  return table;
}

}  // namespace vergence::v4l2
