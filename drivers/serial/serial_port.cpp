#include "drivers/serial/serial_port.hpp"

#include <errno.h>
#include <fcntl.h>
#include <libserialport.h>
#include <sys/eventfd.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>

#include "drivers/serial/detail/fd_line.hpp"

namespace vergence {
namespace {

namespace fs = std::filesystem;

/// Device file behind links; the name itself if there is none.
fs::path resolved(const std::string& port) {
  std::error_code error;
  fs::path real = fs::canonical(port, error);
  return error ? fs::path(port) : real;
}

DeviceStatus to_status(int system_error) noexcept {
  switch (system_error) {
    case ENOENT:
    case ENODEV:
    case ENXIO:
      return DeviceStatus::not_found;
    case EACCES:
    case EPERM:
      return DeviceStatus::no_permission;
    case EBUSY:
      return DeviceStatus::busy;
    case ENOTTY:
    case EINVAL:
      return DeviceStatus::unsupported;
    default:
      return DeviceStatus::failed;
  }
}

std::string text(const char* t) { return t == nullptr ? std::string() : std::string(t); }

struct PortFreer {
  void operator()(sp_port* port) const noexcept { ::sp_free_port(port); }
};

/// System information about a port; nullopt if it has vanished or has no hardware.
std::optional<SerialPortInfo> read_port_info(const std::string& name) {
  sp_port* found = nullptr;
  if (::sp_get_port_by_name(name.c_str(), &found) != SP_OK) return std::nullopt;
  const std::unique_ptr<sp_port, PortFreer> owned(found);
  const sp_port* port = found;
  SerialPortInfo info;
  info.port = text(::sp_get_port_name(port));
  info.description = text(::sp_get_port_description(port));
  if (::sp_get_port_transport(port) == SP_TRANSPORT_USB) {
    int vendor = 0, product = 0;
    if (::sp_get_port_usb_vid_pid(port, &vendor, &product) == SP_OK) {
      info.usb_vendor = static_cast<std::uint16_t>(vendor);
      info.usb_product = static_cast<std::uint16_t>(product);
    }
    info.usb_serial = text(::sp_get_port_usb_serial(port));
  }
  info.latency_timer_ms = read_latency_timer_ms(info.port);
  return info;
}

/// True for a port with hardware. Pseudo-terminals and consoles have none, and absent ports of a PC
/// are of type 0 (PORT_UNKNOWN in linux/serial.h).
bool has_hardware(const fs::path& tty) {
  std::error_code error;
  if (!fs::exists(tty / "device", error)) return false;
  std::ifstream file(tty / "type");
  int type = 0;
  return !(file >> type) || type != 0;
}

/// Device files of the present ports, in order.
std::vector<std::string> names_of_ttys() {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator tty("/sys/class/tty", error), end; !error && tty != end;
       tty.increment(error))
    if (has_hardware(tty->path())) names.push_back("/dev/" + tty->path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

/// Locks the port: TIOCEXCL excludes other programs, the lock also privileged ones.
DeviceStatus hold(int fd) noexcept {
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0)
    return errno == EWOULDBLOCK ? DeviceStatus::busy : to_status(errno);
  return ::ioctl(fd, TIOCEXCL) == 0 ? DeviceStatus::ok : to_status(errno);
}

/// If not ok, *tty is unchanged.
DeviceStatus open_tty(const fs::path& real, const LineSettings& settings, UniqueFd* tty) {
  UniqueFd fd(::open(real.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!fd.valid()) return to_status(errno);
  if (::isatty(fd.get()) == 0) return DeviceStatus::unsupported;
  if (const DeviceStatus s = hold(fd.get()); s != DeviceStatus::ok) return s;
  if (const DeviceStatus s = set_raw_tty(fd.get(), settings); s != DeviceStatus::ok) return s;
  *tty = std::move(fd);
  return DeviceStatus::ok;
}

}  // namespace

// Replaces sp_list_ports(). If a port vanishes during listing, libserialport 0.1.1 returns or reads
// a null list (list_ports() in its linux.c does not check list_append()), and it opens the ports of
// a PC to detect them.
std::vector<SerialPortInfo> list_serial_ports() {
  std::vector<SerialPortInfo> ports;
  for (const std::string& name : names_of_ttys())
    if (auto info = read_port_info(name)) ports.push_back(std::move(*info));
  return ports;
}

std::optional<int> read_latency_timer_ms(const std::string& port) {
  std::ifstream file(fs::path("/sys/class/tty") / resolved(port).filename() /
                     "device/latency_timer");
  int ms = 0;
  if (!(file >> ms) || ms < 1 || ms > 255) return std::nullopt;
  return ms;
}

bool is_native_usb(const std::string& port) {
  return resolved(port).filename().string().starts_with("ttyACM");
}

namespace {

/// Returns `asked`, or nothing if another device has its name now.
std::string unless_of_another(const std::vector<SerialPortInfo>& ports,
                              const std::string& usb_serial, const std::string& asked) {
  const std::string real = resolved(asked).string();
  const bool of_another = std::any_of(ports.begin(), ports.end(), [&](const SerialPortInfo& p) {
    return p.port == real && !p.usb_serial.empty() && p.usb_serial != usb_serial;
  });
  return of_another ? std::string() : asked;
}

}  // namespace

std::string port_with_serial(const std::vector<SerialPortInfo>& ports,
                             const std::string& usb_serial, const std::string& asked) {
  if (usb_serial.empty()) return asked;
  const std::string real = resolved(asked).string();
  const auto bears = [&](const SerialPortInfo& p) { return p.usb_serial == usb_serial; };
  const auto named = [&](const SerialPortInfo& p) { return p.port == real && bears(p); };
  if (std::any_of(ports.begin(), ports.end(), named)) return asked;
  if (std::count_if(ports.begin(), ports.end(), bears) == 1)
    return std::find_if(ports.begin(), ports.end(), bears)->port;
  return unless_of_another(ports, usb_serial, asked);
}

namespace {

bool only_one_bears(const std::vector<SerialPortInfo>& ports, const std::string& usb_serial) {
  return std::count_if(ports.begin(), ports.end(),
                       [&](const SerialPortInfo& p) { return p.usb_serial == usb_serial; }) <= 1;
}

}  // namespace

void ConverterNumber::opened(const std::vector<SerialPortInfo>& ports,
                             const std::string& usb_serial) {
  if (decided_) return;
  decided_ = true;
  if (only_one_bears(ports, usb_serial)) number_ = usb_serial;
}

std::string ConverterNumber::find(const std::vector<SerialPortInfo>& ports,
                                  const std::string& asked) const {
  if (!only_one_bears(ports, number_)) shared_.store(true, std::memory_order_relaxed);
  return shared_.load(std::memory_order_relaxed) ? unless_of_another(ports, number_, asked)
                                                 : port_with_serial(ports, number_, asked);
}

std::string SerialPort::find() const {
  return converter_.known() ? converter_.find(list_serial_ports(), port_) : port_;
}

std::unique_ptr<SerialLink> SerialPort::open(const LineSettings& settings, DeviceStatus* status) {
  if (settings.baud == 0 || settings.stop_bits < 1 || settings.stop_bits > 2) {
    *status = DeviceStatus::unsupported;
    return nullptr;
  }
  const std::string found = find();
  if (found.empty()) {
    *status = DeviceStatus::not_found;
    return nullptr;
  }
  const fs::path real = resolved(found);
  UniqueFd tty;
  *status = open_tty(real, settings, &tty);
  if (*status != DeviceStatus::ok) return nullptr;
  UniqueFd wake(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (!wake.valid()) {
    *status = DeviceStatus::failed;
    return nullptr;
  }
  if (!converter_.decided()) {
    const std::vector<SerialPortInfo> ports = list_serial_ports();
    const auto same = [&](const SerialPortInfo& p) { return p.port == real.string(); };
    if (const auto port = std::find_if(ports.begin(), ports.end(), same); port != ports.end())
      converter_.opened(ports, port->usb_serial);
  }
  auto line = std::make_unique<FdLine>(std::move(tty), std::move(wake), settings);
  line->discard_input();
  return line;
}

Duration SerialPort::latency_timer() const {
  const std::optional<int> ms = read_latency_timer_ms(find());
  return Duration::milliseconds(ms.value_or(0));
}

}  // namespace vergence
