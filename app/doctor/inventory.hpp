#pragma once
#include <string>
#include <vector>

#include "app/doctor/machine.hpp"
#include "app/doctor/serial_kind.hpp"
#include "app/doctor/usb_tree.hpp"
#include "core/types/time.hpp"
#include "drivers/device.hpp"
#include "drivers/iidc/firewire_nodes.hpp"
#include "drivers/serial/serial_port.hpp"

/// What is plugged in.
namespace vergence::app {

struct FoundCamera {
  DeviceInfo info;
  std::vector<std::string> also;  // further nodes of the same device that capture, by their serials
                                  // (a colour camera's infrared image)
  std::string media;  // of V4L2: what media_advice() says; empty: nothing stands before the node
};

/// What one driver found.
struct DriverFindings {
  std::string name, meaning;
  bool answered = true;  // false: it took longer than the limit
  std::vector<FoundCamera> cameras;
  std::string
      note;  // one sentence: why there is none, or what stands in the way; empty: nothing to say
};

struct FoundPort {
  SerialPortInfo info;
  std::string by_id;  // a link that stays when ports are renumbered; empty: none
  SerialKind kind = SerialKind::unknown;
  std::string device;  // who answered, where it was asked: `xsens 07701234, MTI-G-710`; empty:
                       // nobody, or not asked
  std::string configuration;  // line for the configuration; empty: nobody knows

  /// What a configuration should name.
  [[nodiscard]] const std::string& name() const noexcept {
    return by_id.empty() ? info.port : by_id;
  }
};

struct Inventory {
  std::vector<DriverFindings> drivers;
  std::vector<FoundPort> ports;
  std::vector<UsbDevice> usb;
  std::vector<iidc::FirewireNode> firewire;  // cameras

  [[nodiscard]] std::size_t cameras() const noexcept;
};

struct InventoryOptions {
  std::vector<std::string> drivers;  // of cameras, by name; empty: all
  bool probe = false;  // opens serial ports and asks who is there: some boards restart from that
  Duration limit = Duration::seconds(
      8);  // for each driver of cameras; they look at the same time. Longest seen: GigE, 1 s
};

/// Looks for everything.
///
/// Threads  One a driver while it runs; one that does not come back within the limit is left to
///          itself. Memory: ordinary.
/// Time     The limit; with `probe` some seconds a port more.
[[nodiscard]] Inventory take_inventory(const Machine& machine, const InventoryOptions& options);

/// Cameras on the list whose nodes belong to one device become one. A pure function of what was
/// found.
[[nodiscard]] std::vector<FoundCamera> one_entry_a_device(const Machine& machine,
                                                          const std::vector<UsbDevice>& usb,
                                                          const std::vector<DeviceInfo>& found);

/// `{driver: gige, serial: "15021234"}`, as an item of `cameras:`.
[[nodiscard]] std::string camera_line(const DeviceInfo& info);
/// A text in double quotes, as YAML and JSON read it.
[[nodiscard]] std::string quoted(const std::string& text);

}  // namespace vergence::app
