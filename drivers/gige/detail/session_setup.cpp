#include "drivers/gige/detail/session.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <string_view>
#include <thread>
#include <utility>

/// The half of a session that writes a configuration into the camera.
namespace vergence::gige {
namespace {

std::string shown(double v) {
  std::array<char, 32> text{};
  (void)std::snprintf(text.data(), text.size(), "%.4g", v);
  return text.data();
}

const char* feature_value(TriggerOverlap overlap) {
  switch (overlap) {
    case TriggerOverlap::readout:
      return "ReadOut";
    case TriggerOverlap::previous_frame:
      return "PreviousFrame";
    default:
      return "Off";
  }
}

}  // namespace

DeviceStatus Session::apply(const CameraConfiguration& requested, const Options& options,
                            Applied* applied) {
  Applied a;
  a.actual = requested;
  a.options = options;
  remark_.clear();
  Error error;
  arv_device_execute_command(device_.get(), "AcquisitionStop",
                             error.out());  // what a killed program left running
  features_.choose_if_there("AcquisitionMode", "Continuous");
  if (options.heartbeat_ms > 0 &&
      !features_.set("GevHeartbeatTimeout", options.heartbeat_ms, "ms", nullptr))
    return refuse(DeviceStatus::unsupported, features_.last_error());
  DeviceStatus status = set_format(requested, &a);
  if (status == DeviceStatus::ok) status = set_region(requested);
  if (status == DeviceStatus::ok) status = set_trigger(requested, options);
  if (status == DeviceStatus::ok) status = set_exposure(requested, options, &a);
  if (status == DeviceStatus::ok) status = set_rate(requested, &a);
  if (status == DeviceStatus::ok) status = set_clock(options, &a);
  if (status != DeviceStatus::ok) return status;
  set_chunks(options, &a);
  for (const auto& [name, value] : options.features)
    if (!features_.set_text(name, value))
      return refuse(DeviceStatus::unsupported, features_.last_error());
  const auto payload = features_.number("PayloadSize");
  if (!payload || *payload < 1)
    return refuse(DeviceStatus::unsupported,
                  "the camera does not say how large a frame is (PayloadSize)");
  a.payload = static_cast<std::size_t>(*payload);
  a.pixels = static_cast<std::size_t>(requested.width) *
             static_cast<std::size_t>(requested.height) *
             (a.format->how == GreyFormat::How::words ? 2 : 1);
  if (a.payload < a.pixels)
    return refuse(DeviceStatus::unsupported, "the camera's frames of " + std::to_string(a.payload) +
                                                 " bytes are smaller than the image");
  status = set_packets(requested, options, &a);
  if (status == DeviceStatus::ok) *applied = std::move(a);
  return status;
}

DeviceStatus Session::set_format(const CameraConfiguration& requested, Applied* a) {
  const auto offered = features_.choices("PixelFormat");
  a->format = choose_format(offered, requested.pixel_format);
  if (a->format == nullptr) {
    std::string all;
    for (const std::string& name : offered)
      if (choose_format({name}, "") != nullptr) all += (all.empty() ? "" : ", ") + name;
    return refuse(
        DeviceStatus::unsupported,
        (requested.pixel_format.empty() ? "no pixel format gives grey"
                                        : "there is no pixel format " + requested.pixel_format) +
            "; the camera offers " + (all.empty() ? "none that is known here" : all));
  }
  if (!features_.choose("PixelFormat", a->format->name))
    return refuse(DeviceStatus::unsupported, features_.last_error());
  a->actual.pixel_format = a->format->name;
  return DeviceStatus::ok;
}

DeviceStatus Session::set_region(const CameraConfiguration& requested) {
  const auto exactly = [&](const char* name, int value) {
    double actual = value;
    if (!features_.set(name, value, "px", &actual))
      return refuse(DeviceStatus::unsupported, features_.last_error());
    if (actual == value) return DeviceStatus::ok;
    const auto limits = features_.bounds(name);
    return refuse(DeviceStatus::unsupported,
                  std::string(name) + " " + std::to_string(value) +
                      " px is not possible: the camera offers steps of " +
                      shown(limits ? limits->step : 1) + " px, " + shown(actual) +
                      " is the nearest");
  };
  // Offsets first to zero: what is allowed of the one depends on the other.
  const bool offsets = features_.has("OffsetX") && features_.has("OffsetY");
  if (offsets)
    for (const char* name : {"OffsetX", "OffsetY"}) (void)features_.set(name, 0, "px", nullptr);
  for (const auto& [name, value] :
       {std::pair{"Width", requested.width}, {"Height", requested.height}})
    if (const DeviceStatus s = exactly(name, value); s != DeviceStatus::ok) return s;
  if (!offsets) {
    if (requested.offset_x == 0 && requested.offset_y == 0) return DeviceStatus::ok;
    return refuse(DeviceStatus::unsupported, "the camera has no offset of its region");
  }
  for (const auto& [name, value] :
       {std::pair{"OffsetX", requested.offset_x}, {"OffsetY", requested.offset_y}})
    if (const DeviceStatus s = exactly(name, value); s != DeviceStatus::ok) return s;
  return DeviceStatus::ok;
}

DeviceStatus Session::set_trigger(const CameraConfiguration& requested, const Options& o) {
  if (features_.has("TriggerSelector"))
    for (const std::string& selector : features_.choices("TriggerSelector")) {
      features_.choose_if_there("TriggerSelector", selector);
      features_.choose_if_there("TriggerMode", "Off");
    }
  if (requested.trigger == CameraTrigger::free) {
    features_.choose_if_there("TriggerMode", "Off");
    return DeviceStatus::ok;
  }
  for (const char* selector : {"AcquisitionStart", "FrameBurstStart", "FrameStart"})
    features_.choose_if_there("TriggerSelector", selector);
  const bool software = requested.trigger == CameraTrigger::software;
  // The mode before the source: some cameras offer sources only then.
  if (!features_.choose("TriggerMode", "On") ||
      !features_.choose("TriggerSource", software ? "Software" : o.line))
    return refuse(DeviceStatus::unsupported, features_.last_error());
  if (software) return DeviceStatus::ok;
  if (o.edge == TriggerEdge::rising)
    features_.choose_if_there("TriggerActivation", "RisingEdge");
  else if (!features_.choose("TriggerActivation", "FallingEdge"))
    return refuse(DeviceStatus::unsupported, features_.last_error());
  if (o.overlap != TriggerOverlap::unset &&
      !features_.choose("TriggerOverlap", feature_value(o.overlap)))
    return refuse(DeviceStatus::unsupported, features_.last_error());
  const char* delay = features_.find(Purpose::trigger_delay);
  if (delay == nullptr && o.trigger_delay_us > 0)
    return refuse(DeviceStatus::unsupported, "the camera has no delay of its trigger");
  if (delay != nullptr && !features_.set(delay, o.trigger_delay_us, "us", nullptr))
    return refuse(DeviceStatus::unsupported, features_.last_error());
  if (!o.exposure_line.empty() && (!features_.choose("LineSelector", o.exposure_line) ||
                                   !features_.choose("LineMode", "Output") ||
                                   !features_.choose("LineSource", "ExposureActive")))
    return refuse(DeviceStatus::unsupported, features_.last_error());
  return DeviceStatus::ok;
}

DeviceStatus Session::set_exposure(const CameraConfiguration& requested, const Options& o,
                                   Applied* a) {
  for (const char* automatic : {"ExposureAuto", "GainAuto"})
    features_.choose_if_there(automatic, "Off");
  if (o.exposure_mode == ExposureMode::trigger_width) {
    if (!features_.choose("ExposureMode", "TriggerWidth"))
      return refuse(DeviceStatus::unsupported, features_.last_error());
  } else {
    features_.choose_if_there("ExposureMode", "Timed");
    const char* exposure = features_.find(Purpose::exposure);
    if (exposure == nullptr)
      return refuse(DeviceStatus::unsupported, "the camera's exposure cannot be set");
    double us = 0;
    if (!features_.set(exposure, requested.exposure.to_seconds() * 1e6, "us", &us))
      return refuse(DeviceStatus::unsupported, features_.last_error());
    a->actual.exposure = Duration::seconds(us * 1e-6);
  }
  features_.choose_if_there("GainSelector", "All");
  const char* gain = features_.find(Purpose::gain);
  if (gain == nullptr) {
    if (requested.gain_db != 0)
      return refuse(DeviceStatus::unsupported, "the camera's gain cannot be set");
    return DeviceStatus::ok;
  }
  const auto limits = features_.bounds(gain);
  double value = requested.gain_db;
  if (value == 0 && limits)
    value = std::max(value, limits->least);  // none asked for: the least there is
  if (std::string(gain) == "GainRaw") {
    if (requested.gain_db != 0)
      return refuse(
          DeviceStatus::unsupported,
          "the camera's gain has no unit: set gain_db to 0 and the option feature.GainRaw" +
              (limits ? " to " + shown(limits->least) + " … " + shown(limits->most)
                      : std::string()));
    (void)features_.set(gain, value, "", nullptr);
    return DeviceStatus::ok;
  }
  if (!features_.set(gain, value, "dB", &a->actual.gain_db))
    return refuse(DeviceStatus::unsupported, features_.last_error());
  return DeviceStatus::ok;
}

DeviceStatus Session::change_exposure(const ExposureSetting& requested, const Options& o,
                                      ExposureSetting* actual) {
  const char* exposure = features_.find(Purpose::exposure);
  if (o.exposure_mode == ExposureMode::trigger_width || exposure == nullptr)
    return refuse(DeviceStatus::unsupported, "the camera's exposure cannot be set");
  const auto set_nearest = [this](const char* name, double value, const char* unit, double* taken) {
    const auto limits = features_.bounds(name);
    return features_.set(
        name,
        limits ? std::clamp(value, limits->least, std::max(limits->least, limits->most)) : value,
        unit, taken);
  };
  double us = 0;
  *actual = requested;
  if (!set_nearest(exposure, requested.exposure.to_seconds() * 1e6, "us", &us))
    return refuse(in_control() ? DeviceStatus::unsupported : DeviceStatus::gone,
                  features_.last_error());
  actual->exposure = Duration::seconds(us * 1e-6);
  const char* gain = features_.find(Purpose::gain);
  if (gain == nullptr ||
      std::string_view(gain) == "GainRaw") {  // none, or in no unit that could be reckoned with
    actual->gain_db = 0;
    return DeviceStatus::ok;
  }
  if (!set_nearest(gain, requested.gain_db, "dB", &actual->gain_db))
    return refuse(in_control() ? DeviceStatus::unsupported : DeviceStatus::gone,
                  features_.last_error());
  return DeviceStatus::ok;
}

DeviceStatus Session::set_rate(const CameraConfiguration& requested, Applied* a) {
  const bool free = requested.trigger == CameraTrigger::free;
  for (const char* enable : {"AcquisitionFrameRateEnable", "AcquisitionFrameRateEnabled"})
    if (features_.has(enable)) (void)features_.switch_on(enable, free);
  features_.choose_if_there("AcquisitionFrameRateAuto", "Off");
  if (!free) return DeviceStatus::ok;
  const char* rate = features_.find(Purpose::frame_rate);
  if (rate == nullptr)
    return refuse(DeviceStatus::unsupported, "the camera's frame rate cannot be set; trigger it");
  if (!features_.set(rate, requested.rate_hz, "Hz", &a->actual.rate_hz))
    return refuse(DeviceStatus::unsupported, features_.last_error());
  return DeviceStatus::ok;
}

DeviceStatus Session::set_clock(const Options& o, Applied* a) {
  Error error;
  a->tick_frequency =
      arv_gv_device_get_timestamp_tick_frequency(ARV_GV_DEVICE(device_.get()), error.out());
  if (error) a->tick_frequency = 0;
  const char* enable = features_.find(Purpose::ptp_enable);
  if (o.ptp && enable == nullptr)
    return refuse(DeviceStatus::unsupported,
                  "the camera knows no PTP (IEEE 1588); set the option ptp to off");
  if (enable != nullptr && !features_.switch_on(enable, o.ptp) && o.ptp)
    return refuse(DeviceStatus::unsupported, features_.last_error());
  if (!o.ptp) {
    if (a->tick_frequency == 0)
      note("the camera has no clock: its images are stamped when they arrive");
    return DeviceStatus::ok;
  }
  a->tick_frequency = 1'000'000'000;  // PTP counts nanoseconds
  constexpr auto kSettle = std::chrono::seconds(3);
  const char *latch = features_.find(Purpose::ptp_latch),
             *state = features_.find(Purpose::ptp_status);
  std::string word;
  for (const auto end = std::chrono::steady_clock::now() + kSettle; state != nullptr;) {
    if (latch != nullptr) (void)features_.execute(latch);
    word = features_.text(state);
    if (word == "Slave" || std::chrono::steady_clock::now() > end) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  if (word != "Slave")
    note("the camera's clock does not follow the network's yet (PTP is " +
         (word.empty() ? "silent" : word) + "); is there a master?");
  return DeviceStatus::ok;
}

/// Which exposure a frame had is best known by the camera. One that cannot say is no trouble: it is
/// reckoned, then.
void Session::set_chunks(const Options& o, Applied* a) {
  const char* mode = features_.find(Purpose::chunk_mode);
  if (mode == nullptr) return;
  if (o.chunks && ask_for_exposures(mode, a)) return;
  (void)features_.switch_on(mode, false);  // what another program left on
}

bool Session::ask_for_exposures(const char* mode, Applied* a) {
  if (!features_.switch_on(mode, true)) return false;
  // Cameras before GigE Vision 2.0: only then the leader still tells the image's size.
  if (features_.has("GevSCCFGExtendedChunkData"))
    (void)features_.switch_on("GevSCCFGExtendedChunkData", true);
  const auto offered = features_.choices("ChunkSelector");
  bool enabled = false;
  for (const char* name : {"ExposureTime", "ExposureTimeAbs", "Exposure"}) {
    if (enabled || std::find(offered.begin(), offered.end(), name) == offered.end()) continue;
    enabled = features_.choose("ChunkSelector", name) && features_.switch_on("ChunkEnable", true);
  }
  if (!enabled) return false;
  const char* exposure = features_.find(Purpose::chunk_exposure);
  if (exposure != nullptr) a->exposure_chunk = find_chunk_field(device_.get(), exposure);
  if (!a->exposure_chunk)
    note(
        "the camera's chunk data has the exposure in a way that is not known here: it is reckoned");
  return a->exposure_chunk.has_value();
}

DeviceStatus Session::set_packets(const CameraConfiguration& requested, const Options& o,
                                  Applied* a) {
  a->link = link_;
  const std::int64_t speed =
      o.link_mbps > 0 ? std::int64_t{o.link_mbps} * 1'000'000 : a->link.speed;
  const auto limits = features_.bounds("GevSCPSPacketSize");
  const auto least = limits ? std::max(limits->least, 576.0) : 576.0,
             most = limits && limits->most >= least ? limits->most : 9000.0;
  const int size = choose_packet_size(o.packet_size, a->link.mtu, static_cast<std::int64_t>(least),
                                      static_cast<std::int64_t>(most),
                                      limits ? static_cast<std::int64_t>(limits->step) : 4);
  if (o.packet_size > 0 && size != o.packet_size)
    note("packets of " + std::to_string(size) + " bytes instead of " +
         std::to_string(o.packet_size) + ": " + a->link.name + " carries " +
         std::to_string(a->link.mtu) + ", the camera " + shown(least) + " to " + shown(most));
  Error error;
  arv_gv_device_set_packet_size(ARV_GV_DEVICE(device_.get()), size, error.out());
  if (error)
    return refuse(DeviceStatus::unsupported,
                  "packets of " + std::to_string(size) + " bytes were refused: " + error.text());
  const int cameras = o.link_cameras > 0 ? o.link_cameras : requested.sharing;
  const LinkLoad load{static_cast<std::int64_t>(a->payload), requested.rate_hz, cameras, false};
  a->plan = plan_link(load, size, speed, o.packet_delay);
  if (a->plan.share > kMostOfPeriod)
    return refuse(DeviceStatus::unsupported,
                  std::to_string(cameras) + " cameras of " + std::to_string(requested.width) +
                      " x " + std::to_string(requested.height) + " " + a->format->name + " at " +
                      shown(requested.rate_hz) + " Hz do not fit on " +
                      (a->link.name.empty() ? "the link" : a->link.name) + " of " +
                      shown(static_cast<double>(speed) * 1e-6) + " Mbit/s with packets of " +
                      std::to_string(size) + " bytes; it carries " +
                      shown(highest_rate(load, size, speed)) + " Hz, or a smaller region");
  const double ticks = a->plan.delay.to_seconds() * static_cast<double>(a->tick_frequency);
  if (features_.has("GevSCPD")) {
    if (!features_.set("GevSCPD", std::ceil(ticks), "ticks", nullptr))
      return refuse(DeviceStatus::unsupported, features_.last_error());
  } else if (ticks > 0) {
    note("the camera has no packet delay: cameras that expose together may overflow the switch");
  }
  return DeviceStatus::ok;
}

}  // namespace vergence::gige
