#pragma once
#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "app/doctor/checks.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::test {

/// A machine of small files, with a user `driver` who may open everything and has room.
struct FakeMachine {
  FakeMachine() {
    machine.root = folder.path();
    machine.user = "driver";
    machine.may_use = [this](const std::string& node) {
      return std::find(closed.begin(), closed.end(), node) == closed.end();
    };
    machine.group_of = [this](const std::string&) { return group; };
    machine.mode_of = [this](const std::string&) { return mode; };
    machine.room_at = [this](const std::filesystem::path&) { return room; };
    machine.clock_synchronised = true;
  }
  FakeMachine(const FakeMachine&) = delete;
  FakeMachine& operator=(const FakeMachine&) = delete;

  void file(const std::string& path, const std::string& text) const {
    (void)folder.write(path.substr(1), text);
  }
  /// A device on USB at port `1-2`.
  void usb(const std::string& port, const std::string& ids, const std::string& serial) const {
    const std::string at = "/sys/bus/usb/devices/" + port + "/";
    file(at + "idVendor", ids.substr(0, 4) + "\n");
    file(at + "idProduct", ids.substr(5) + "\n");
    file(at + "busnum", "1\n");
    file(at + "devnum", std::to_string(port.back() - '0') + "\n");
    file(at + "speed", "480\n");
    if (!serial.empty()) file(at + "serial", serial + "\n");
  }
  void camera(const std::string& driver, const std::string& serial, const std::string& place) {
    auto at = std::find_if(inventory.drivers.begin(), inventory.drivers.end(),
                           [&](const auto& d) { return d.name == driver; });
    if (at == inventory.drivers.end())
      at = inventory.drivers.insert(at, app::DriverFindings{driver, "", true, {}, ""});
    at->cameras.push_back({{driver, serial, "A camera", place}, {}, ""});
  }
  void need(const std::string& driver, const std::string& serial, int width, int height,
            double rate) {
    app::CameraNeed n;
    n.key = "cameras." + std::to_string(needs.cameras.size());
    n.driver = driver;
    n.serial = serial;
    n.width = width;
    n.height = height;
    n.bytes = 1.0 * width * height;
    n.rate_hz = rate;
    needs.given = true;
    needs.cameras.push_back(n);
  }
  void address(const std::string& name, std::uint32_t a, std::uint32_t mask) {
    machine.addresses.push_back({name, a, mask});
  }
  [[nodiscard]] std::vector<app::Finding> examined() const {
    return app::run_checks({machine, inventory, needs, ".", configuration});
  }
  /// The findings of one check, the worst first.
  [[nodiscard]] std::vector<app::Finding> of(const std::string& check) const {
    std::vector<app::Finding> some;
    for (app::Finding& f : examined())
      if (f.check == check) some.push_back(std::move(f));
    return some;
  }

  TemporaryFolder folder;
  app::Machine machine;
  app::Inventory inventory;
  app::Needs needs;
  std::vector<std::string> closed;  // nodes that may not be opened
  std::string group = "video";      // of all nodes
  unsigned mode = 0660;             // likewise
  std::optional<app::DiskRoom> room = app::DiskRoom{std::uint64_t{1} << 40, 1'000'000};
  std::filesystem::path configuration;  // that `needs` are of
};

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}
/// One of the commands that mend it has that part.
inline bool mends_with(const app::Finding& f, const std::string& part) {
  return std::any_of(f.mend.begin(), f.mend.end(),
                     [&](const std::string& c) { return contains(c, part); });
}

}  // namespace vergence::test
