#pragma once
#include <algorithm>
#include <cstdint>

#include "app/devices/doctor_checks.hpp"
#include "tests/support/refusal.hpp"
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
    machine.room_at = [this](const std::filesystem::path&) { return room; };
    machine.clock_synchronised = true;
  }
  FakeMachine(const FakeMachine&) = delete;
  FakeMachine& operator=(const FakeMachine&) = delete;

  void file(const std::string& path, const std::string& text) const {
    (void)folder.write(path.substr(1), text);
  }
  void camera(const std::string& driver, const std::string& serial, const std::string& place) {
    auto at = std::find_if(inventory.drivers.begin(), inventory.drivers.end(),
                           [&](const auto& d) { return d.name == driver; });
    if (at == inventory.drivers.end())
      at = inventory.drivers.insert(at, app::DriverFindings{driver, "", true, {}, ""});
    at->cameras.push_back({driver, serial, "A camera", place});
  }
  /// A camera of 1280 x 960 pixels in the configuration.
  void need(const std::string& driver, const std::string& serial) {
    drive.cameras[cameras++] = {.driver = driver, .serial = serial, .width = 1280, .height = 960};
    given = true;
  }
  [[nodiscard]] app::CheckContext context() const {
    return {machine, inventory, given ? &drive : nullptr, "."};
  }
  /// The findings of one check, the worst first.
  [[nodiscard]] std::vector<app::Finding> of(const std::string& check) const {
    std::vector<app::Finding> some;
    for (app::Finding& f : app::run_checks(context()))
      if (f.check == check) some.push_back(std::move(f));
    return some;
  }

  TemporaryFolder folder;
  app::Machine machine;
  app::Inventory inventory;
  app::Configuration drive;
  /// True if the checks get the configuration.
  bool given = false;
  std::size_t cameras = 0;
  /// Nodes that may not be opened.
  std::vector<std::string> closed;
  /// Group of all nodes.
  std::string group = "video";
  std::optional<app::DiskRoom> room = app::DiskRoom{std::uint64_t{1} << 40};
};

/// A serial port /dev/ttyUSB0 on an adapter with these USB ids.
inline app::FoundPort port(std::uint16_t vendor, std::uint16_t product, const std::string& serial,
                           int latency_ms = 16) {
  app::FoundPort p;
  p.info = {"/dev/ttyUSB0", "FT232R USB UART", vendor, product, serial, latency_ms};
  p.kind = app::serial_kind(vendor, product);
  return p;
}

}  // namespace vergence::test
