#include "drivers/gige/detail/session.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <shared_mutex>
#include <thread>
#include <utility>

namespace vergence::gige {
namespace {

constexpr std::uint64_t kCapabilities = 0x934, kControlPrivilege = 0xA00;
constexpr std::uint32_t kCanResend = 4;
constexpr std::int64_t kLeastSocketBuffer = 4 << 20;  // bytes
constexpr std::int64_t kBufferedFrames = 8;           // that the socket holds while nobody reads

std::string text_of(const char* text) { return text == nullptr ? "" : text; }

/// Aravis falls back in silence.
bool may_open_packet_socket() {
  const int fd = ::socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, 0);
  if (fd >= 0) (void)::close(fd);
  return fd >= 0;
}

std::string address_of(GSocketAddress* address) {
  if (address == nullptr || !G_IS_INET_SOCKET_ADDRESS(address)) return "";
  const Memory<char> text(
      g_inet_address_to_string(g_inet_socket_address_get_address(G_INET_SOCKET_ADDRESS(address))));
  return text_of(text.get());
}

/// Of Aravis's list of devices, which it looks up and makes anew without a lock, while every camera
/// that is away has a thread that looks for it.
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
    all.push_back({{"gige", text_of(arv_interface_get_device_serial_nbr(gv, i)),
                    text_of(arv_interface_get_device_vendor(gv, i)) + " " +
                        text_of(arv_interface_get_device_model(gv, i)),
                    text_of(arv_interface_get_device_address(gv, i))},
                   text_of(arv_interface_get_device_id(gv, i))});
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
    *message = error ? where + " does not answer: " + error.text()
                     : where + " does not answer; is its address in the network of this host?";
    return nullptr;
  }
  lock.unlock();
  if (arv_gv_device_is_controller(ARV_GV_DEVICE(device.get())) == FALSE) {
    *status = DeviceStatus::busy;
    *message = where + " is controlled by another program, or was by one that ended seconds ago";
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
  info_.place = address_of(arv_gv_device_get_device_address(gv));
  link_ = interface_of(address_of(arv_gv_device_get_interface_address(gv)));
  const auto noticed =
      +[](ArvDevice*, Session* self) { self->lost_.store(true, std::memory_order_release); };
  (void)g_signal_connect(device_.get(), "control-lost", G_CALLBACK(noticed), this);
}

Session::~Session() {
  close_stream(!lost());
  (void)g_signal_handlers_disconnect_by_data(device_.get(), this);
  // Aravis's heartbeat holds the device for a moment when it notices that control is lost. Were its
  // reference the last, it would have to wait for its own thread: so it is told that there is
  // nothing to lose any more, and waited for.
  if (!lost()) {
    Error error;
    (void)arv_gv_device_leave_control(ARV_GV_DEVICE(device_.get()), error.out());
  }
  constexpr int kMoments = 1000;  // of a millisecond
  const auto references = [this] { return g_atomic_int_get(&G_OBJECT(device_.get())->ref_count); };
  for (int i = 0; i < kMoments && references() > 1; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

DeviceStatus Session::refuse(DeviceStatus status, std::string sentence) {
  last_error_ = std::move(sentence);
  // A camera that has gone refuses everything; the sentence about the last feature would mislead.
  if (lost() || !in_control()) {
    last_error_ = "the camera does not answer any more";
    return DeviceStatus::gone;
  }
  return status;
}

std::optional<double> Session::temperature_c() const {
  const char* name = features_.find(Purpose::temperature);
  return name != nullptr ? features_.number(name) : std::nullopt;
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
  if (o.packet_socket && !may_open_packet_socket()) {
    last_error_ =
        "the packet socket needs CAP_NET_RAW: sudo setcap cap_net_raw+ep on the program, or set "
        "the option packet_socket to off";
    return DeviceStatus::no_permission;
  }
  arv_gv_device_set_stream_options(gv, o.packet_socket
                                           ? ARV_GV_STREAM_OPTION_NONE
                                           : ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  Error error;
  stream_.reset(arv_device_create_stream(device_.get(), callback, user, error.out()));
  if (stream_ == nullptr || !ARV_IS_GV_STREAM(stream_.get())) {
    stream_.reset();
    if (error.is(ARV_DEVICE_ERROR_NOT_CONTROLLER)) {
      last_error_ = "another program controls the camera";
      return DeviceStatus::gone;
    }
    return refuse(DeviceStatus::failed, "the stream cannot be made: " + error.text());
  }
  // Aravis may have tried the size with a test packet and taken another one.
  const int size = static_cast<int>(arv_gv_device_get_packet_size(gv, error.out()));
  if (!error && size > a.link.mtu)
    arv_gv_device_set_packet_size(gv, a.plan.packet_size, error.out());
  if (!error && size < a.plan.packet_size)
    note("packets of " + std::to_string(size) +
         " bytes: larger ones do not come through; check the MTU of every switch and of " +
         a.link.name);

  std::uint32_t capabilities = 0;
  const bool can =
      arv_device_read_register(device_.get(), kCapabilities, &capabilities, error.out()) != FALSE &&
      (capabilities & kCanResend) != 0;
  const bool resend = o.resend == Resend::on || (o.resend == Resend::automatic && can);
  if (o.resend == Resend::on && !can) note("the camera says that it cannot send packets again");
  const Duration period = Duration::seconds(1 / a.actual.rate_hz);
  const Duration retention =
      o.frame_retention > Duration{}
          ? o.frame_retention
          : std::clamp(period * 3, Duration::milliseconds(60), Duration::milliseconds(100));
  g_object_set(stream_.get(), "packet-resend",
               resend ? ARV_GV_STREAM_PACKET_RESEND_ALWAYS : ARV_GV_STREAM_PACKET_RESEND_NEVER,
               "frame-retention", static_cast<guint>(retention.ns() / 1000), "packet-timeout",
               static_cast<guint>(retention.ns() / 8000), "socket-buffer",
               ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size", 0, nullptr);
  enlarge_socket_buffer(a);
  return DeviceStatus::ok;
}

/// Before the first packet, which Aravis does after it: half of all streams would lose their first
/// frame.
void Session::enlarge_socket_buffer(const Applied& a) {
  const std::int64_t requested =
      a.options.socket_buffer_kb > 0
          ? std::int64_t{a.options.socket_buffer_kb} * 1024
          : std::max(kLeastSocketBuffer, kBufferedFrames * static_cast<std::int64_t>(a.payload));
  const int socket = find_udp_socket(arv_gv_stream_get_port(ARV_GV_STREAM(stream_.get())));
  const std::int64_t got = socket < 0 ? 0 : set_receive_buffer(socket, requested);
  const std::int64_t least = 2 * static_cast<std::int64_t>(a.payload);
  if (got < std::min(requested, least))
    note("the receive buffer holds " + std::to_string(got / 1024) + " KiB instead of " +
         std::to_string(requested / 1024) +
         ": frames will be lost; sudo sysctl -w net.core.rmem_max=" + std::to_string(requested));
}

void Session::push(ArvBuffer* buffer) noexcept {
  arv_buffer_set_frame_id(
      buffer, 0);  // an id that no frame has: Aravis leaves the old one where the leader is lost
  arv_stream_push_buffer(stream_.get(), static_cast<ArvBuffer*>(g_object_ref(buffer)));
}

DeviceStatus Session::start_acquisition() {
  Error error;
  if (features_.has("TLParamsLocked"))
    arv_device_set_integer_feature_value(device_.get(), "TLParamsLocked", 1, error.out());
  arv_device_execute_command(device_.get(), "AcquisitionStart", error.out());
  return error ? refuse(DeviceStatus::gone, "the camera does not begin: " + error.text())
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
  g_object_unref(stream_.get());  // joins its thread, whose callbacks use stream_ until then
  (void)stream_.release();
}

DeviceStatus Session::trigger() {
  Error error;
  arv_device_execute_command(device_.get(), "TriggerSoftware", error.out());
  return error ? refuse(DeviceStatus::gone, "the software trigger was refused: " + error.text())
               : DeviceStatus::ok;
}

}  // namespace vergence::gige
