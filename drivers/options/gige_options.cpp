#include "drivers/options/gige_options.hpp"

namespace vergence::gige {
namespace {

OptionTable<Options> make_table() {
  using O = Options;
  OptionTable<O> t;
  t.number("packet_size", &O::packet_size, {576, 65000}, "bytes", "computed",
           "Size of the stream's packets with their headers: the interface's MTU, at most 9000.");
  t.number("packet_delay_us", &O::packet_delay, {0, 10000}, "µs", "computed",
           "Pause after each packet, so that the cameras of one link interleave.");
  t.number("link_mbps", &O::link_mbps, {1, 400000}, "Mbit/s", "the interface's",
           "Speed of the slowest link that the cameras share, where a switch is in between.");
  t.number("link_cameras", &O::link_cameras, {1, 16}, "", "all GigE cameras",
           "Cameras that share that link.");
  t.on_off("packet_socket", &O::packet_socket, nullptr,
           "Receives through a packet socket (needs CAP_NET_RAW): less work, frames some ms "
           "later.");
  t.choice<Resend, Resend>(
      "resend", &O::resend, {{"auto", Resend::automatic}, {"on", Resend::on}, {"off", Resend::off}},
      nullptr, "Asks again for lost packets; auto: where the camera says that it can.");
  t.number("frame_retention_ms", &O::frame_retention, {1, 1000}, "ms", "3 periods, 60 to 100 ms",
           "How long an incomplete frame waits for packets that were asked for again.");
  t.number("socket_buffer_kb", &O::socket_buffer_kb, {64, 500000}, "KiB", "eight frames",
           "Receive buffer of the socket; needs net.core.rmem_max of that size.");
  t.number("buffers", &O::buffers, {4, 48}, "", nullptr, "Frames that may be in use at once.");
  t.text("trigger_line", &O::line, "a name of the camera", nullptr,
         "Input of the hardware trigger.");
  t.choice<TriggerEdge, TriggerEdge>(
      "trigger_edge", &O::edge,
      {{"rising", TriggerEdge::rising}, {"falling", TriggerEdge::falling}}, nullptr,
      "Edge of the pulse that begins the exposure.");
  t.choice<TriggerOverlap, TriggerOverlap>(
      "trigger_overlap", &O::overlap,
      {{"off", TriggerOverlap::off},
       {"readout", TriggerOverlap::readout},
       {"previous_frame", TriggerOverlap::previous_frame}},
      "the camera's", "Whether a pulse is taken while the frame before is read out.");
  t.number("trigger_delay_us", &O::trigger_delay_us, {0, 1000000}, "µs", nullptr,
           "From the pulse to the exposure.");
  t.choice<ExposureMode, ExposureMode>(
      "exposure_mode", &O::exposure_mode,
      {{"timed", ExposureMode::timed}, {"trigger_width", ExposureMode::trigger_width}}, nullptr,
      "trigger_width: the pulse's length is the exposure.");
  t.text("exposure_line", &O::exposure_line, "a name of the camera", "none",
         "Output that is high during the exposure.");
  t.choice<bool, bool>("stamp_at", &O::stamp_at_end, {{"start", false}, {"end", true}}, nullptr,
                       "What the camera's time stamp is of: the exposure's start or its end.");
  t.on_off("ptp", &O::ptp, nullptr, "The camera's clock follows the network's (IEEE 1588).");
  t.choice<bool, bool>("chunks", &O::chunks, {{"auto", true}, {"off", false}}, nullptr,
                       "Each frame reports its own exposure, where the camera can (chunk data).");
  t.number("heartbeat_ms", &O::heartbeat_ms, {500, 60000}, "ms", "the camera's",
           "After so long without a word from us the camera gives up its controller.");
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
