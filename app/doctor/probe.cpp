#include "app/doctor/probe.hpp"

#include <fmt/format.h>

#include "app/runtime/ins_drivers.hpp"

namespace vergence::app {
namespace {

bool is_ins(FoundPort* port) {
  for (const InsDriverRow& row : ins_driver_rows()) {
    const auto driver = row.make(InsRequest{});
    DeviceStatus status = DeviceStatus::ok;
    const auto device = driver->open(port->info.port, &status);
    if (device == nullptr) continue;
    const DeviceInfo& who = device->info();
    port->device = fmt::format("{} {}, {}", row.name, who.serial, who.model);
    port->configuration = fmt::format("ins: {{driver: {}, port: {}}}", row.name, port->name());
    return true;
  }
  return false;
}

}  // namespace

void probe(FoundPort* port) {
  if (port->kind == SerialKind::built_in) return;
  (void)is_ins(port);
}

}  // namespace vergence::app
