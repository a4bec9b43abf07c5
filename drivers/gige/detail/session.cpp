#include "drivers/gige/detail/session.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <mutex>
#include <shared_mutex>
#include <string_view>
#include <thread>
#include <utility>

#include "drivers/format_text.hpp"

namespace vergence::gige {

namespace {

struct Names {
  Purpose purpose;
  // Names from the newest standard to the oldest, null-padded.
  std::array<const char*, 4> names;
};
constexpr std::array kNames{
    Names{Purpose::exposure, {"ExposureTime", "ExposureTimeAbs", "ExposureTimeRaw", "Exposure"}},
    Names{Purpose::gain, {"Gain", "GainAbs", "GainRaw", nullptr}},
    Names{Purpose::frame_rate,
          {"AcquisitionFrameRate", "AcquisitionFrameRateAbs", nullptr, nullptr}},
    Names{Purpose::trigger_delay, {"TriggerDelay", "TriggerDelayAbs", nullptr, nullptr}},
    Names{Purpose::serial, {"DeviceSerialNumber", "DeviceID", nullptr, nullptr}},
    Names{Purpose::ptp_enable, {"PtpEnable", "GevIEEE1588", nullptr, nullptr}},
    Names{Purpose::ptp_status, {"PtpStatus", "GevIEEE1588Status", nullptr, nullptr}},
    Names{Purpose::ptp_latch, {"PtpDataSetLatch", "GevIEEE1588DataSetLatch", nullptr, nullptr}},
    Names{Purpose::chunk_mode, {"ChunkModeActive", "ChunkMode", nullptr, nullptr}},
};

std::string shown(double v) { return format_text("%.6g", v); }

std::string listed(const std::vector<std::string>& words) {
  std::string all;
  for (const std::string& w : words) all += (all.empty() ? "" : ", ") + w;
  return all.empty() ? "nothing" : all;
}

}  // namespace

bool Features::has(const std::string& name) const {
  Error error;
  return arv_device_is_feature_available(device_, name.c_str(), error.out()) != 0 && !error;
}

const char* Features::find(Purpose purpose) const {
  for (const Names& row : kNames) {
    if (row.purpose != purpose) continue;
    for (const char* name : row.names)
      if (name != nullptr && has(name)) return name;
  }
  return nullptr;
}

std::optional<Features::Bounds> Features::bounds(const std::string& name) const {
  ArvGcNode* node = arv_device_get_feature(device_, name.c_str());
  Error error;
  Bounds b;
  if (ARV_IS_GC_FLOAT(node)) {
    arv_device_get_float_feature_bounds(device_, name.c_str(), &b.least, &b.most, error.out());
  } else if (ARV_IS_GC_INTEGER(node)) {
    gint64 least = 0, most = 0;
    arv_device_get_integer_feature_bounds(device_, name.c_str(), &least, &most, error.out());
    if (error) return std::nullopt;
    b.least = static_cast<double>(least);
    b.most = static_cast<double>(most);
    b.step = static_cast<double>(
        arv_device_get_integer_feature_increment(device_, name.c_str(), error.out()));
    if (error || !(b.step >= 1)) b.step = 1;
    return b;
  } else {
    return std::nullopt;
  }
  if (error) return std::nullopt;
  return b;
}

std::optional<double> Features::number(const std::string& name) const {
  ArvGcNode* node = arv_device_get_feature(device_, name.c_str());
  Error error;
  double value = 0;
  if (ARV_IS_GC_FLOAT(node))
    value = arv_device_get_float_feature_value(device_, name.c_str(), error.out());
  else if (ARV_IS_GC_INTEGER(node))
    value = static_cast<double>(
        arv_device_get_integer_feature_value(device_, name.c_str(), error.out()));
  else
    return std::nullopt;
  if (error) return std::nullopt;
  return value;
}

std::string Features::text(const std::string& name) const {
  Error error;
  const char* value = arv_device_get_string_feature_value(device_, name.c_str(), error.out());
  return value == nullptr || error ? "" : value;
}

std::vector<std::string> Features::choices(const std::string& name) const {
  Error error;
  guint n = 0;
  const Memory<const char*> entries(arv_device_dup_available_enumeration_feature_values_as_strings(
      device_, name.c_str(), &n, error.out()));
  std::vector<std::string> all;
  for (guint i = 0; entries != nullptr && i < n; ++i) all.emplace_back(entries.get()[i]);
  return all;
}

bool Features::set(const std::string& name, double value, const char* unit, double* actual) {
  const auto limits = bounds(name);
  if (!limits) return refuse("the camera has no number " + name);
  const bool whole = limits->step > 0;
  if (whole)
    value = limits->least + std::round((value - limits->least) / limits->step) * limits->step;
  // Tolerance for floats that pass through a 32-bit register.
  const double slack = 1e-6 * std::max(1.0, std::abs(value));
  if (value < limits->least - slack || value > limits->most + slack)
    return refuse(name + " " + shown(value) + " " + unit + " is not possible: the camera offers " +
                  shown(limits->least) + " to " + shown(limits->most) + " " + unit);
  Error error;
  if (whole)
    arv_device_set_integer_feature_value(device_, name.c_str(),
                                         static_cast<gint64>(std::llround(value)), error.out());
  else
    arv_device_set_float_feature_value(device_, name.c_str(), value, error.out());
  if (error)
    return refuse(name + " " + shown(value) + " " + unit + " was refused: " + error.text());
  if (actual != nullptr) *actual = number(name).value_or(value);
  return true;
}

bool Features::choose(const std::string& name, const std::string& entry) {
  if (!has(name)) return refuse("the camera has no " + name);
  const auto all = choices(name);
  if (std::find(all.begin(), all.end(), entry) == all.end())
    return refuse(name + " has no " + entry + "; the camera offers " + listed(all));
  Error error;
  arv_device_set_string_feature_value(device_, name.c_str(), entry.c_str(), error.out());
  return !error || refuse(name + " " + entry + " was refused: " + error.text());
}

bool Features::switch_on(const std::string& name, bool on) {
  if (!has(name)) return refuse("the camera has no " + name);
  if (ARV_IS_GC_ENUMERATION(arv_device_get_feature(device_, name.c_str())))
    return choose(name, on ? "On" : "Off");
  Error error;
  arv_device_set_boolean_feature_value(device_, name.c_str(), on ? TRUE : FALSE, error.out());
  return !error || refuse(name + " was refused: " + error.text());
}

bool Features::execute(const std::string& name) {
  if (!has(name)) return refuse("the camera has no " + name);
  Error error;
  arv_device_execute_command(device_, name.c_str(), error.out());
  return !error || refuse(name + " was refused: " + error.text());
}

bool Features::set_text(const std::string& name, const std::string& value) {
  ArvGcNode* node = arv_device_get_feature(device_, name.c_str());
  if (node == nullptr || !has(name)) return refuse("the camera has no feature " + name);
  if (ARV_IS_GC_COMMAND(node)) return execute(name);
  if (ARV_IS_GC_ENUMERATION(node)) return choose(name, value);
  if (ARV_IS_GC_BOOLEAN(node))
    return switch_on(name, value == "on" || value == "true" || value == "1");
  if (ARV_IS_GC_FLOAT(node) || ARV_IS_GC_INTEGER(node)) {
    char* end = nullptr;
    const double v = g_ascii_strtod(value.c_str(), &end);
    if (value.empty() || *end != '\0')
      return refuse(name + " is a number; \"" + value + "\" is not one");
    return set(name, v, "", nullptr);
  }
  Error error;
  arv_device_set_string_feature_value(device_, name.c_str(), value.c_str(), error.out());
  return !error || refuse(name + " was refused: " + error.text());
}

void Features::choose_if_there(const std::string& name, const std::string& entry) {
  if (!has(name)) return;
  const auto all = choices(name);
  if (std::find(all.begin(), all.end(), entry) == all.end()) return;
  Error error;
  arv_device_set_string_feature_value(device_, name.c_str(), entry.c_str(), error.out());
}

namespace {

constexpr std::uint64_t kCapabilities = 0x934, kControlPrivilege = 0xA00;
constexpr std::uint32_t kCanResend = 4;
// Minimum size of the socket's receive buffer, in bytes.
constexpr std::int64_t kMinSocketBuffer = 4 << 20;
// Number of frames that the receive buffer holds.
constexpr std::int64_t kBufferedFrames = 8;

std::string to_text(const char* text) { return text == nullptr ? "" : text; }

std::string to_address(GSocketAddress* address) {
  if (address == nullptr || !G_IS_INET_SOCKET_ADDRESS(address)) return "";
  const Memory<char> text(
      g_inet_address_to_string(g_inet_socket_address_get_address(G_INET_SOCKET_ADDRESS(address))));
  return to_text(text.get());
}

/// Guards Aravis's list of devices, which Aravis reads and rebuilds without a lock while the thread
/// of each disconnected camera searches for it.
std::shared_mutex& device_list() {
  static std::shared_mutex mutex;
  return mutex;
}

}  // namespace

std::vector<Found> discover() {
  const std::unique_lock lock(device_list());
  ArvInterface* gv = arv_gv_interface_get_instance();
  arv_interface_update_device_list(gv);
  std::vector<Found> all;
  const unsigned n = arv_interface_get_n_devices(gv);
  for (unsigned i = 0; i < n; ++i)
    all.push_back({{"gige", to_text(arv_interface_get_device_serial_nbr(gv, i)),
                    to_text(arv_interface_get_device_vendor(gv, i)) + " " +
                        to_text(arv_interface_get_device_model(gv, i)),
                    to_text(arv_interface_get_device_address(gv, i))},
                   to_text(arv_interface_get_device_id(gv, i))});
  std::sort(all.begin(), all.end(),
            [](const Found& a, const Found& b) { return a.info.serial < b.info.serial; });
  return all;
}

// ---- control

std::unique_ptr<Session> Session::open(const std::string& where, DeviceStatus* status,
                                       std::string* message) {
  Error error;
  std::shared_lock lock(device_list());
  Object<ArvDevice> device(
      arv_interface_open_device(arv_gv_interface_get_instance(), where.c_str(), error.out()));
  if (device == nullptr || !ARV_IS_GV_DEVICE(device.get())) {
    *status = DeviceStatus::not_found;
    *message =
        error ? where + " does not respond: " + error.text()
              : where + " does not respond; check that its address is in a network of this host";
    return nullptr;
  }
  lock.unlock();
  if (arv_gv_device_is_controller(ARV_GV_DEVICE(device.get())) == FALSE) {
    *status = DeviceStatus::busy;
    *message = where +
               " is controlled by another program, or was until seconds ago; end that program, or "
               "wait and repeat";
    return nullptr;
  }
  *status = DeviceStatus::ok;
  return std::unique_ptr<Session>(new Session(std::move(device)));
}

Session::Session(Object<ArvDevice> device) : device_(std::move(device)), features_(device_.get()) {
  info_.driver = "gige";
  if (const char* name = features_.find(Purpose::serial)) info_.serial = features_.text(name);
  info_.model = features_.text("DeviceVendorName") + " " + features_.text("DeviceModelName");
  ArvGvDevice* gv = ARV_GV_DEVICE(device_.get());
  info_.place = to_address(arv_gv_device_get_device_address(gv));
  link_ = find_interface(to_address(arv_gv_device_get_interface_address(gv)));
  const auto noticed =
      +[](ArvDevice*, Session* self) { self->lost_.store(true, std::memory_order_release); };
  (void)g_signal_connect(device_.get(), "control-lost", G_CALLBACK(noticed), this);
}

Session::~Session() {
  close_stream(!lost());
  (void)g_signal_handlers_disconnect_by_data(device_.get(), this);
  // When Aravis detects a loss of control, its heartbeat thread holds a reference for a moment. If
  // that became the last one, the thread would join itself. So control is given up first, and that
  // reference awaited.
  if (!lost()) {
    Error error;
    (void)arv_gv_device_leave_control(ARV_GV_DEVICE(device_.get()), error.out());
  }
  // Longest wait, in milliseconds.
  constexpr int kMoments = 1000;
  const auto references = [this] { return g_atomic_int_get(&G_OBJECT(device_.get())->ref_count); };
  for (int i = 0; i < kMoments && references() > 1; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

DeviceStatus Session::refuse(DeviceStatus status, std::string message) {
  last_error_ = std::move(message);
  // A disconnected camera refuses everything; the message about the last feature would mislead.
  if (lost() || !in_control()) {
    last_error_ = "the camera no longer responds; check cable and power";
    return DeviceStatus::disconnected;
  }
  return status;
}

bool Session::in_control() {
  std::uint32_t privilege = 0;
  Error error;
  return arv_device_read_register(device_.get(), kControlPrivilege, &privilege, error.out()) !=
             FALSE &&
         !error && (privilege & 3U) != 0 &&
         arv_gv_device_is_controller(ARV_GV_DEVICE(device_.get())) != FALSE;
}

// ---- stream

DeviceStatus Session::open_stream(const Applied& a, ArvStreamCallback callback, void* user) {
  const Options& o = a.options;
  ArvGvDevice* gv = ARV_GV_DEVICE(device_.get());
  arv_gv_device_set_stream_options(gv, ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  Error error;
  stream_.reset(arv_device_create_stream(device_.get(), callback, user, error.out()));
  if (stream_ == nullptr || !ARV_IS_GV_STREAM(stream_.get())) {
    stream_.reset();
    if (error.is(ARV_DEVICE_ERROR_NOT_CONTROLLER)) {
      last_error_ = "another program controls the camera";
      return DeviceStatus::disconnected;
    }
    return refuse(DeviceStatus::failed, "the stream cannot be created: " + error.text());
  }
  // Aravis may have tested the packet size and chosen another one.
  const int size = static_cast<int>(arv_gv_device_get_packet_size(gv, error.out()));
  if (!error && size > a.link.mtu)
    arv_gv_device_set_packet_size(gv, a.plan.packet_size, error.out());
  if (!error && size < a.plan.packet_size)
    add_remark("packets of " + std::to_string(size) +
               " bytes, because larger ones do not arrive; check the MTU of every switch and of " +
               a.link.name);

  std::uint32_t capabilities = 0;
  const bool can =
      arv_device_read_register(device_.get(), kCapabilities, &capabilities, error.out()) != FALSE &&
      (capabilities & kCanResend) != 0;
  const bool resend = o.resend == Resend::on || (o.resend == Resend::automatic && can);
  if (o.resend == Resend::on && !can) add_remark("the camera cannot resend packets");
  const Duration period = Duration::seconds(1 / a.actual.rate_hz);
  const Duration retention =
      std::clamp(period * 3, Duration::milliseconds(60), Duration::milliseconds(100));
  g_object_set(stream_.get(), "packet-resend",
               resend ? ARV_GV_STREAM_PACKET_RESEND_ALWAYS : ARV_GV_STREAM_PACKET_RESEND_NEVER,
               "frame-retention", static_cast<guint>(retention.ns() / 1000), "packet-timeout",
               static_cast<guint>(retention.ns() / 8000), "socket-buffer",
               ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size", 0, nullptr);
  enlarge_socket_buffer(a);
  return DeviceStatus::ok;
}

/// Must be called before the first packet. Aravis sets the buffer later, and half of all streams
/// would lose their first frame.
void Session::enlarge_socket_buffer(const Applied& a) {
  const std::int64_t requested =
      a.options.socket_buffer_kb > 0
          ? std::int64_t{a.options.socket_buffer_kb} * 1024
          : std::max(kMinSocketBuffer, kBufferedFrames * static_cast<std::int64_t>(a.payload));
  const int socket = find_udp_socket(arv_gv_stream_get_port(ARV_GV_STREAM(stream_.get())));
  const std::int64_t got = socket < 0 ? 0 : set_receive_buffer(socket, requested);
  const std::int64_t least = 2 * static_cast<std::int64_t>(a.payload);
  if (got < std::min(requested, least))
    add_remark(
        "the receive buffer holds " + std::to_string(got / 1024) + " KiB instead of " +
        std::to_string(requested / 1024) +
        ": frames will be lost; sudo sysctl -w net.core.rmem_max=" + std::to_string(requested));
}

void Session::push(ArvBuffer* buffer) noexcept {
  // Sets an id that no frame has, because Aravis keeps the old one if the leader is lost.
  arv_buffer_set_frame_id(buffer, 0);
  arv_stream_push_buffer(stream_.get(), static_cast<ArvBuffer*>(g_object_ref(buffer)));
}

DeviceStatus Session::start_acquisition() {
  Error error;
  if (features_.has("TLParamsLocked"))
    arv_device_set_integer_feature_value(device_.get(), "TLParamsLocked", 1, error.out());
  arv_device_execute_command(device_.get(), "AcquisitionStart", error.out());
  return error ? refuse(DeviceStatus::disconnected, "the camera does not start: " + error.text())
               : DeviceStatus::ok;
}

void Session::close_stream(bool reachable) noexcept {
  if (stream_ == nullptr) return;
  Error error;
  if (reachable) {
    arv_device_execute_command(device_.get(), "AcquisitionStop", error.out());
    if (!error && features_.has("TLParamsLocked"))
      arv_device_set_integer_feature_value(device_.get(), "TLParamsLocked", 0, error.out());
  }
  // Joins the stream's thread, whose callbacks use stream_ until then.
  g_object_unref(stream_.get());
  (void)stream_.release();
}

DeviceStatus Session::trigger() {
  Error error;
  arv_device_execute_command(device_.get(), "TriggerSoftware", error.out());
  return error ? refuse(DeviceStatus::disconnected,
                        "the software trigger was refused: " + error.text())
               : DeviceStatus::ok;
}

DeviceStatus Session::apply(const CameraConfiguration& requested, const Options& options,
                            Applied* applied) {
  Applied a;
  a.actual = requested;
  a.options = options;
  remark_.clear();
  Error error;
  // Stops an acquisition left running by a killed program.
  arv_device_execute_command(device_.get(), "AcquisitionStop", error.out());
  features_.choose_if_there("AcquisitionMode", "Continuous");
  DeviceStatus status = set_format(requested, &a);
  if (status == DeviceStatus::ok) status = set_region(requested);
  if (status == DeviceStatus::ok) status = set_trigger(requested, options);
  if (status == DeviceStatus::ok) status = set_exposure(requested, &a);
  if (status == DeviceStatus::ok) status = set_rate(requested, &a);
  if (status == DeviceStatus::ok) status = set_clock(options, &a);
  if (status != DeviceStatus::ok) return status;
  // With chunk data, which another program may have left on, a leader may lack the image size.
  if (const char* chunks = features_.find(Purpose::chunk_mode))
    (void)features_.switch_on(chunks, false);
  for (const auto& [name, value] : options.features)
    if (!features_.set_text(name, value))
      return refuse(DeviceStatus::unsupported, features_.last_error());
  const auto payload = features_.number("PayloadSize");
  if (!payload || *payload < 1)
    return refuse(DeviceStatus::unsupported,
                  "the camera does not report the size of a frame (PayloadSize)");
  a.payload = static_cast<std::size_t>(*payload);
  const std::size_t pixels = static_cast<std::size_t>(requested.width) *
                             static_cast<std::size_t>(requested.height) *
                             (a.format->how == GreyFormat::How::words ? 2 : 1);
  if (a.payload < pixels)
    return refuse(DeviceStatus::unsupported,
                  "the camera's frames of " + std::to_string(a.payload) +
                      " bytes are smaller than the image; check pixel_format and size");
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
        (requested.pixel_format.empty() ? "no supported pixel format gives grey values"
                                        : "there is no pixel format " + requested.pixel_format) +
            "; the camera offers " + (all.empty() ? "none that is supported" : all));
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
  // Offsets are zeroed first, because the permitted size depends on them.
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
  // The mode is set first, because some cameras offer sources only then.
  if (!features_.choose("TriggerMode", "On") ||
      !features_.choose("TriggerSource", software ? "Software" : o.line))
    return refuse(DeviceStatus::unsupported, features_.last_error());
  if (software) return DeviceStatus::ok;
  if (o.edge == TriggerEdge::rising)
    features_.choose_if_there("TriggerActivation", "RisingEdge");
  else if (!features_.choose("TriggerActivation", "FallingEdge"))
    return refuse(DeviceStatus::unsupported, features_.last_error());
  const char* delay = features_.find(Purpose::trigger_delay);
  if (delay != nullptr && !features_.set(delay, 0, "us", nullptr))
    return refuse(DeviceStatus::unsupported, features_.last_error());
  return DeviceStatus::ok;
}

DeviceStatus Session::set_exposure(const CameraConfiguration& requested, Applied* a) {
  for (const char* automatic : {"ExposureAuto", "GainAuto"})
    features_.choose_if_there(automatic, "Off");
  features_.choose_if_there("ExposureMode", "Timed");
  const char* exposure = features_.find(Purpose::exposure);
  if (exposure == nullptr)
    return refuse(DeviceStatus::unsupported, "the camera's exposure cannot be set");
  double us = 0;
  if (!features_.set(exposure, requested.exposure.to_seconds() * 1e6, "us", &us))
    return refuse(DeviceStatus::unsupported, features_.last_error());
  a->actual.exposure = Duration::seconds(us * 1e-6);
  features_.choose_if_there("GainSelector", "All");
  const char* gain = features_.find(Purpose::gain);
  if (gain == nullptr) {
    if (requested.gain_db != 0)
      return refuse(DeviceStatus::unsupported, "the camera's gain cannot be set");
    return DeviceStatus::ok;
  }
  const auto limits = features_.bounds(gain);
  double value = requested.gain_db;
  // Without a requested gain the minimum is used.
  if (value == 0 && limits) value = std::max(value, limits->least);
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

DeviceStatus Session::change_exposure(const ExposureSetting& requested, ExposureSetting* actual) {
  const char* exposure = features_.find(Purpose::exposure);
  if (exposure == nullptr)
    return refuse(DeviceStatus::unsupported, "the camera's exposure cannot be set");
  const auto set_nearest = [this](const char* name, double value, const char* unit,
                                  double* applied) {
    const auto limits = features_.bounds(name);
    return features_.set(
        name,
        limits ? std::clamp(value, limits->least, std::max(limits->least, limits->most)) : value,
        unit, applied);
  };
  double us = 0;
  *actual = requested;
  if (!set_nearest(exposure, requested.exposure.to_seconds() * 1e6, "us", &us))
    return refuse(in_control() ? DeviceStatus::unsupported : DeviceStatus::disconnected,
                  features_.last_error());
  actual->exposure = Duration::seconds(us * 1e-6);
  const char* gain = features_.find(Purpose::gain);
  // The camera has no gain, or a gain without a unit.
  if (gain == nullptr || std::string_view(gain) == "GainRaw") {
    actual->gain_db = 0;
    return DeviceStatus::ok;
  }
  if (!set_nearest(gain, requested.gain_db, "dB", &actual->gain_db))
    return refuse(in_control() ? DeviceStatus::unsupported : DeviceStatus::disconnected,
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
    return refuse(DeviceStatus::unsupported,
                  "the camera's frame rate cannot be set; set trigger to hardware or software");
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
                  "the camera does not support PTP (IEEE 1588); set the option ptp to off");
  if (enable != nullptr && !features_.switch_on(enable, o.ptp) && o.ptp)
    return refuse(DeviceStatus::unsupported, features_.last_error());
  if (!o.ptp) {
    if (a->tick_frequency == 0)
      add_remark("the camera has no clock; its images are stamped at arrival");
    return DeviceStatus::ok;
  }
  // PTP stamps are in nanoseconds.
  a->tick_frequency = 1'000'000'000;
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
    add_remark("the camera's clock is not synchronised by PTP yet (state " +
               (word.empty() ? "silent" : word) + "); check that there is a PTP master");
  return DeviceStatus::ok;
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
    add_remark("packets of " + std::to_string(size) + " bytes instead of " +
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
  if (a->plan.share > kMaxOfPeriod)
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
    add_remark("the camera has no packet delay; simultaneous images may overflow the switch");
  }
  return DeviceStatus::ok;
}

}  // namespace vergence::gige
