#include "app/doctor/devices_report.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace vergence::app {
namespace {

using Json = nlohmann::ordered_json;
using Row = std::vector<std::string>;

/// Rows with their columns aligned.
std::string table(const std::vector<Row>& rows) {
  std::vector<std::size_t> widths;
  for (const Row& row : rows)
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (widths.size() <= i) widths.push_back(0);
      widths[i] = std::max(widths[i], columns(row[i]));
    }
  std::string text;
  for (const Row& row : rows) {
    std::string line = " ";
    for (std::size_t i = 0; i < row.size(); ++i) line += " " + padded(row[i], widths[i]) + " ";
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

std::string usb_ids(const SerialPortInfo& info) {
  return info.usb_vendor == 0 ? ""
                              : fmt::format("{:04x}:{:04x}", info.usb_vendor, info.usb_product);
}

std::string cameras_text(const Inventory& inventory, const Terminal& t) {
  if (inventory.cameras() == 0) return {};
  std::vector<Row> rows;
  for (const DriverFindings& d : inventory.drivers)
    for (const FoundCamera& c : d.cameras) {
      const std::string model =
          harmless(c.info.model) +
          (c.also.empty()
               ? ""
               : fmt::format(" (also {})", harmless(fmt::format("{}", fmt::join(c.also, ", ")))));
      rows.push_back({d.name, c.info.serial.empty() ? "?" : harmless(c.info.serial), model,
                      harmless(c.info.place)});
    }
  return t.in(Terminal::Ink::bold, "Cameras") + "\n" + table(rows) + "\n";
}

std::string ports_text(const Inventory& inventory, const Terminal& t) {
  if (inventory.ports.empty()) return {};
  std::vector<Row> rows;
  for (const FoundPort& p : inventory.ports)
    rows.push_back({p.info.port, usb_ids(p.info), harmless(p.info.usb_serial),
                    p.device.empty() ? to_phrase(p.kind) : harmless(p.device),
                    p.info.latency_timer_ms
                        ? fmt::format("latency timer {} ms", *p.info.latency_timer_ms)
                        : ""});
  return t.in(Terminal::Ink::bold, "Serial ports") + "\n" + table(rows) + "\n";
}

std::string paste_text(const Inventory& inventory, const Terminal& t) {
  std::string text;
  for (const DriverFindings& d : inventory.drivers)
    for (const FoundCamera& c : d.cameras)
      if (!c.info.serial.empty() || d.name == "gige") text += "    - " + camera_line(c.info) + "\n";
  if (!text.empty()) text = "  cameras:\n" + text;
  for (const FoundPort& p : inventory.ports)
    if (!p.configuration.empty()) text += "  " + p.configuration + "\n";
  return text.empty() ? ""
                      : t.in(Terminal::Ink::bold, "For the configuration") + "\n" + text + "\n";
}

/// One line a driver, its sentence beside it.
std::string notes_text(const Inventory& inventory, const Terminal& t) {
  std::string text;
  constexpr std::size_t kName = 14;
  const auto note = [&](const std::string& name, const std::string& sentence) {
    std::string head = "  " + padded(name, kName - 2);
    for (const std::string& line : wrapped(sentence, t.width - kName)) {
      text += head + line + "\n";
      head = std::string(kName, ' ');
    }
  };
  for (const DriverFindings& d : inventory.drivers) {
    if (!d.cameras.empty() && d.note.empty()) continue;
    note(d.name, d.note.empty() ? "none" : harmless(d.note));
  }
  if (inventory.ports.empty()) note("serial", "no port");
  return text.empty() ? "" : t.in(Terminal::Ink::bold, "Not found") + "\n" + text;
}

Json number_or_null(const std::optional<int>& n) { return n ? Json(*n) : Json(nullptr); }

}  // namespace

std::string devices_text(const Inventory& inventory, const Terminal& t) {
  std::string text = cameras_text(inventory, t) + ports_text(inventory, t) +
                     paste_text(inventory, t) + notes_text(inventory, t);
  while (text.ends_with("\n\n")) text.pop_back();
  return text;
}

std::string devices_json(const Inventory& inventory, const std::string& rules) {
  Json cameras = Json::array(), drivers = Json::array(), ports = Json::array();
  for (const DriverFindings& d : inventory.drivers) {
    drivers.push_back({{"name", d.name},
                       {"meaning", d.meaning},
                       {"found", d.cameras.size()},
                       {"answered", d.answered},
                       {"note", d.note}});
    for (const FoundCamera& c : d.cameras)
      cameras.push_back({{"driver", d.name},
                         {"serial", c.info.serial},
                         {"model", c.info.model},
                         {"place", c.info.place},
                         {"also", c.also},
                         {"configuration", camera_line(c.info)}});
  }
  for (const FoundPort& p : inventory.ports)
    ports.push_back({{"port", p.info.port},
                     {"by_id", p.by_id},
                     {"kind", to_key(p.kind)},
                     {"usb_ids", usb_ids(p.info)},
                     {"usb_serial", p.info.usb_serial},
                     {"description", p.info.description},
                     {"latency_timer_ms", number_or_null(p.info.latency_timer_ms)},
                     {"device", p.device},
                     {"configuration", p.configuration}});
  Json all{{"cameras", cameras}, {"serial_ports", ports}, {"drivers", drivers}};
  if (!rules.empty()) all["udev_rules"] = rules;
  return all.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace vergence::app
