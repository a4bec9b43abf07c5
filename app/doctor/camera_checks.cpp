#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <sstream>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

#include "app/doctor/checks.hpp"
#include "app/doctor/permissions.hpp"

namespace vergence::app {
namespace {

constexpr std::uint16_t kPointGrey = 0x1E10;

const DriverFindings* findings_of(const Inventory& inventory, const std::string& driver) {
  for (const DriverFindings& d : inventory.drivers)
    if (d.name == driver) return &d;
  return nullptr;
}

bool same_hex(const std::string& a, const std::string& b) {
  return a.size() == b.size() &&
         std::equal(a.begin(), a.end(), b.begin(), [](unsigned char x, unsigned char y) {
           return std::tolower(x) == std::tolower(y);
         });
}

bool means(const std::string& requested, const FoundCamera& camera) {
  return same_hex(requested, camera.info.serial) || requested == camera.info.place ||
         std::find(camera.also.begin(), camera.also.end(), requested) != camera.also.end();
}

/// Names under /dev/v4l that lead to the node.
bool leads_to(const Machine& machine, const std::string& requested, const std::string& place) {
  std::error_code error;
  const auto real = std::filesystem::canonical(
      machine.root / std::filesystem::path(requested).relative_path(), error);
  return !error && requested.starts_with("/dev/") &&
         real.filename() == std::filesystem::path(place).filename();
}

std::string list_of(const DriverFindings& d) {
  if (d.cameras.empty()) return d.note.empty() ? "none is there" : "none is there: " + d.note;
  std::string text = "there:";
  for (const FoundCamera& c : d.cameras)
    text += fmt::format("{} {}", &c == d.cameras.data() ? "" : ",",
                        c.info.serial.empty() ? c.info.place : c.info.serial);
  return text;
}

/// `the gige camera "123"`, or just of which kind where no serial is asked for.
std::string requested_camera(const CameraNeed& n) {
  return "the " + n.driver + " camera" + (n.serial.empty() ? "" : " " + quoted(n.serial));
}

Finding missing_at_address(const CameraNeed& n, const std::string& who) {
  return {"cameras",
          FindingState::advice,
          fmt::format("{}: no camera at {} answers a broadcast; behind a router that is so, else "
                      "check cable, power and address",
                      who, n.serial),
          {"ping -c 3 " + n.serial}};
}

void check_presence(const CheckContext& p, std::vector<Finding>* findings) {
  if (!p.needs.given) return;
  const auto matched = match_cameras(p);
  std::string present;
  std::map<std::string, std::string> missing;  // by driver
  for (std::size_t k = 0; k < matched.size(); ++k) {
    const CameraNeed& n = p.needs.cameras[k];
    if (n.driver == "mock") continue;
    const std::string who = fmt::format("{}{}", n.key, n.name.empty() ? "" : " (" + n.name + ")");
    if (matched[k] != nullptr) {
      present += fmt::format("{}{} is {} {}", present.empty() ? "" : ", ", who, n.driver,
                             matched[k]->info.serial);
    } else if (n.driver == "gige" && std::count(n.serial.begin(), n.serial.end(), '.') == 3) {
      findings->push_back(missing_at_address(n, who));
    } else {
      std::string& list = missing[n.driver];
      list += fmt::format("{}{}: {}", list.empty() ? "" : ", ", who, requested_camera(n));
    }
  }
  for (const auto& [driver, list] : missing) {
    const DriverFindings* d = findings_of(p.inventory, driver);
    findings->push_back({"cameras",
                         FindingState::problem,
                         fmt::format("not there: {} ({}); check cable, power and serial", list,
                                     d == nullptr ? "no such driver" : list_of(*d)),
                         {}});
  }
  if (!present.empty()) findings->push_back({"cameras", FindingState::ok, present, {}});
}

void check_answers(const CheckContext& p, std::vector<Finding>* findings) {
  for (const DriverFindings& d : p.inventory.drivers)
    if (!d.answered)
      findings->push_back(
          {"cameras", FindingState::problem, d.name + ": " + d.note, {"sudo dmesg | tail -30"}});
}

/// Nodes of everything that looks like a camera of a kind that is asked for; without a
/// configuration of every kind.
std::vector<std::string> camera_nodes(const CheckContext& p) {
  const auto asked = [&p](const char* driver) {
    return !p.needs.given || !p.needs.of(driver).empty();
  };
  std::vector<std::string> nodes;
  if (asked("v4l2"))
    for (const std::string& name : p.machine.names("/sys/class/video4linux"))
      if (name.starts_with("video") && p.machine.exists("/dev/" + name))
        nodes.push_back("/dev/" + name);
  if (asked("iidc-usb"))
    for (const UsbDevice& d : p.inventory.usb)
      if (d.vendor == kPointGrey) nodes.push_back(d.node());
  if (asked("iidc-1394"))
    for (const iidc::FirewireNode& n : p.inventory.firewire) nodes.push_back(n.device);
  return nodes;
}

/// The text of media_advice(): the chain in its first line, then what is wrong with it, each as
/// `WHAT: media-ctl …`.
Finding finding_of_media(const std::string& advice, FindingState when_wrong) {
  std::istringstream lines(advice);
  Finding f{"media_chain", FindingState::ok, {}, {}};
  std::getline(lines, f.sentence);
  constexpr std::string_view kCommand = ": media-ctl";
  for (std::string line; std::getline(lines, line);) {
    const auto colon = line.find(kCommand);
    const auto first = line.find_first_not_of(' ');
    if (colon == std::string::npos || line.compare(first, 9, "all of it") == 0) continue;
    f.state = when_wrong;
    f.sentence += "; " + line.substr(first, colon - first);
    f.mend.push_back(line.substr(colon + 2));
  }
  return f;
}

void check_media(const CheckContext& p, std::vector<Finding>* findings) {
  const auto matched = match_cameras(p);
  for (const DriverFindings& d : p.inventory.drivers)
    for (const FoundCamera& c : d.cameras) {
      if (c.media.empty()) continue;
      const bool requested = std::find(matched.begin(), matched.end(), &c) != matched.end();
      findings->push_back(
          finding_of_media(c.media, requested ? FindingState::problem : FindingState::advice));
    }
}

}  // namespace

std::vector<const FoundCamera*> match_cameras(const CheckContext& p) {
  std::vector<const FoundCamera*> matched(p.needs.cameras.size(), nullptr);
  const auto taken = [&](const FoundCamera* c) {
    return std::find(matched.begin(), matched.end(), c) != matched.end();
  };
  for (const bool named : {true, false})  // those that name one first: the others take what is left
    for (std::size_t k = 0; k < matched.size(); ++k) {
      const CameraNeed& n = p.needs.cameras[k];
      const DriverFindings* d = findings_of(p.inventory, n.driver);
      if (d == nullptr || n.serial.empty() == named) continue;
      for (const FoundCamera& c : d->cameras)
        if (!taken(&c) &&
            (!named || means(n.serial, c) || leads_to(p.machine, n.serial, c.info.place))) {
          matched[k] = &c;
          break;
        }
    }
  return matched;
}

void check_cameras(const CheckContext& p, std::vector<Finding>* findings) {
  check_answers(p, findings);
  check_presence(p, findings);
  check_nodes(p, {"camera_permission", "video", camera_nodes(p)}, findings);
  check_media(p, findings);
}

}  // namespace vergence::app
