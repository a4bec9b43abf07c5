#include "drivers/mock/faults.hpp"

#include <charconv>
#include <sstream>
#include <stdexcept>

#include "core/math/angle.hpp"

namespace vergence::mock {
namespace {

/// One day in s.
constexpr double kLongest = 86400;
constexpr FaultParameter kCamera{"camera", -1, -1, 3, "camera index from 0; -1: all"};
constexpr FaultParameter kCamera1{"camera", 1, 0, 3, "camera index from 0"};
constexpr FaultParameter kDuration{"duration_s", 5, 0, kLongest, "duration; 0: to the end"};
constexpr FaultParameter kForGood{"duration_s", 0, 0, kLongest, "duration; 0: to the end"};
constexpr FaultParameter kShare{"share", 0.1, 0, 1, "share of the frames, random"};
constexpr FaultParameter kPitch{"pitch_deg", 0, -45, 45,
                                "rotation about the camera's x axis (right)"};
constexpr FaultParameter kYaw{"yaw_deg", 0, -45, 45, "rotation about its y axis (down)"};
constexpr FaultParameter kRoll{"roll_deg", 0, -45, 45, "rotation about its z axis (forward)"};
constexpr FaultParameter kX{"x_m", 0, -1, 1, "translation along its x axis"};
constexpr FaultParameter kY{"y_m", 0, -1, 1, "translation along its y axis"};
constexpr FaultParameter kZ{"z_m", 0, -1, 1, "translation along its z axis"};

constexpr FaultParameter kKnock[] = {kCamera1, kPitch, kYaw, kRoll, kX, kY, kZ};
constexpr FaultParameter kDrift[] = {
    kCamera1, kPitch,
    kYaw,     kRoll,
    kX,       kY,
    kZ,       {"duration_s", 60, 1, kLongest, "duration of the change, which then remains"}};
constexpr FaultParameter kLag[] = {kCamera1, kForGood};
constexpr FaultParameter kSwap[] = {kForGood};
constexpr FaultParameter kOccluder[] = {
    {"ahead_m", 1.2, -200, 200,
     "distance from the left camera to its nearest face; negative: behind"},
    {"left_m", 0, -50, 50, "lateral offset of its centre, to the left"},
    {"turn_deg", 0, -180, 180, "heading relative to the vehicle, to the left; 90: across the road"},
    {"speed_mps", 0, -40, 40,
     "along its own heading, relative to the vehicle; 0: it moves with the rig"},
    kDuration};
constexpr FaultParameter kCover[] = {kCamera, kDuration};
constexpr FaultParameter kNight[] = {{"factor", 0.02, 0, 1, "brightness relative to daylight"},
                                     kDuration};
constexpr FaultParameter kExposure[] = {
    kCamera, {"factor", 3, 0, 100, "brightness relative to the setting"}, kDuration};
constexpr FaultParameter kLose[] = {kCamera, kShare, kDuration};
constexpr FaultParameter kLate[] = {
    kCamera, kShare, {"delay_s", 0.2, 0, 10, "additional delay"}, kDuration};
constexpr FaultParameter kBreakPairs[] = {{"share", 1, 0, 1, "share of the pulses, random"},
                                          kDuration};
constexpr FaultParameter kMissed[] = {kCamera1,
                                      {"pulses", 1, 1, 1e6, "number of consecutive pulses"}};
constexpr FaultParameter kBoardDisconnected[] = {
    kDuration,
    {"powered", 0, 0, 1,
     "1: separate supply, pulses continue; 0: stops and restarts with the link"}};
constexpr FaultParameter kReboot[] = {
    {"duration_s", 0.5, 0.01, kLongest, "time until it pulses again"}};
constexpr FaultParameter kDurationOnly[] = {kDuration};
constexpr FaultParameter kPositionJump[] = {
    {"east_m", 100, -1e5, 1e5, "jump towards east"},
    {"north_m", 0, -1e5, 1e5, "jump towards north"},
    {"up_m", 0, -1e4, 1e4, "jump upwards"},
    {"duration_s", 0, 0, kLongest, "time until it jumps back; 0: permanent"}};
constexpr FaultParameter kTimeJump[] = {
    {"camera", -1, -1, 3, "camera index of the clock; -1: the INS"},
    {"jump_s", 1, -kLongest, kLongest, "jump forward; negative: back"}};

constexpr FaultRow kRows[] = {
    {FaultKind::knock, "knock", "A camera is knocked: its pose changes abruptly and permanently.",
     kKnock},
    {FaultKind::drift, "drift", "A camera rotates or moves steadily, like a mount that warms up.",
     kDrift},
    {FaultKind::recalibrate, "recalibrate", "A recalibration is requested, as with SIGUSR1.", {}},
    {FaultKind::lag, "lag",
     "A camera is a frame late: the previous image with this one's counter and stamp.", kLag},
    {FaultKind::swap_cables, "swap_cables",
     "The cables of cameras 0 and 1 are swapped; the ground truth is not.", kSwap},
    {FaultKind::occluder, "occluder", "A bus (12 × 2.5 × 3.2 m) covers part of the view.",
     kOccluder},
    {FaultKind::cover, "cover", "A lens is covered: black images.", kCover},
    {FaultKind::night, "night", "Darkness for every camera.", kNight},
    {FaultKind::exposure, "exposure", "The brightness of the images changes.", kExposure},
    {FaultKind::camera_disconnected, "camera_gone",
     "A camera is unplugged; after a reconnect its counter starts at 0.", kCover},
    {FaultKind::lose_frames, "lose_frames", "Frames are lost; the counter shows the gaps.", kLose},
    {FaultKind::late_frames, "late_frames",
     "Frames arrive late; frames in transit are lost when their camera disconnects.", kLate},
    {FaultKind::duplicate_frames, "duplicate_frames", "Frames arrive twice.", kLose},
    {FaultKind::break_pairs, "break_pairs",
     "One randomly chosen camera's image of a pulse is lost.", kBreakPairs},
    {FaultKind::missed_trigger, "missed_trigger",
     "A camera does not see a pulse: it exposes nothing and does not count it.", kMissed},
    {FaultKind::board_disconnected, "board_gone",
     "The serial link to the trigger board is unplugged.", kBoardDisconnected},
    {FaultKind::board_reboot, "board_reboot",
     "The trigger board restarts: pulses stop; counter and clock begin at 0.", kReboot},
    {FaultKind::ins_disconnected, "ins_gone", "The INS sends nothing; at 0 s it starts late.",
     kDurationOnly},
    {FaultKind::no_fix, "no_fix", "The satellite receiver has no position.", kDurationOnly},
    {FaultKind::position_jump, "position_jump", "The position of the INS jumps.", kPositionJump},
    {FaultKind::time_jump, "time_jump", "A device's clock is set.", kTimeJump},
    {FaultKind::disk_full, "disk_full",
     "The session's disk is full: lines wait in memory, up to 1 MB per file.", kDurationOnly},
};

double number(std::string_view text, const std::string& what) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size())
    throw std::invalid_argument(what + " is \"" + std::string(text.substr(0, 40)) +
                                "\", not a number");
  return value;
}

const FaultRow& find_row(const std::string& kind) {
  for (const FaultRow& row : kRows)
    if (kind == row.name) return row;
  std::string known;
  for (const FaultRow& row : kRows) known += std::string(known.empty() ? "" : ", ") + row.name;
  throw std::invalid_argument("unknown fault \"" + kind.substr(0, 40) + "\"; known: " + known);
}

void set(Fault* fault, std::string_view name, double value) {
  if (name == "camera") fault->camera = static_cast<int>(value);
  if (name == "duration_s") fault->duration = Duration::seconds(value);
  if (name == "pitch_deg") fault->turn.x() = value * kRadiansPerDegree;
  if (name == "yaw_deg") fault->turn.y() = value * kRadiansPerDegree;
  if (name == "roll_deg") fault->turn.z() = value * kRadiansPerDegree;
  if (name == "turn_deg") fault->turn.z() = value * kRadiansPerDegree;
  if (name == "x_m" || name == "east_m" || name == "ahead_m") fault->shift.x() = value;
  if (name == "y_m" || name == "north_m" || name == "left_m") fault->shift.y() = value;
  if (name == "speed_mps") fault->speed = value;
  if (name == "z_m" || name == "up_m") fault->shift.z() = value;
  if (name == "factor") fault->factor = value;
  if (name == "share") fault->share = value;
  if (name == "delay_s") fault->delay = value;
  if (name == "jump_s") fault->jump = value;
  if (name == "pulses") fault->pulses = static_cast<int>(value);
  if (name == "powered") fault->powered = value != 0;
}

std::string to_text(double value) {
  std::ostringstream out;
  out << value;
  return out.str();
}

}  // namespace

std::span<const FaultRow> fault_rows() noexcept { return kRows; }
std::string_view to_string(FaultKind kind) noexcept {
  return kRows[static_cast<std::size_t>(kind)].name;
}

Fault make_fault(const std::string& kind, double at_s,
                 const std::vector<std::pair<std::string, double>>& parameters) {
  const FaultRow& row = find_row(kind);
  if (!(at_s >= 0 && at_s <= kLongest))
    throw std::invalid_argument(kind + " must be at 0 … 86400 s");
  Fault fault;
  fault.kind = row.kind;
  fault.at = Duration::seconds(at_s);
  if (row.kind == FaultKind::cover) fault.factor = 0;
  for (const FaultParameter& p : row.parameters) set(&fault, p.name, p.fallback);
  for (const auto& [name, value] : parameters) {
    const FaultParameter* known = nullptr;
    std::string names;
    for (const FaultParameter& p : row.parameters) {
      if (name == p.name) known = &p;
      names += std::string(names.empty() ? "" : ", ") + p.name;
    }
    if (row.parameters.empty()) names = "none";
    if (known == nullptr)
      throw std::invalid_argument(kind + " has no parameter \"" + name.substr(0, 40) +
                                  "\"; it has " + names);
    if (!(value >= known->least && value <= known->most))
      throw std::invalid_argument(kind + "'s " + name + " is " + to_text(value) +
                                  "; it must be in " + to_text(known->least) + " … " +
                                  to_text(known->most));
    if ((name == "camera" || name == "pulses" || name == "powered") &&
        value != static_cast<int>(value))
      throw std::invalid_argument(kind + "'s " + name + " is not a whole number");
    set(&fault, name, value);
  }
  return fault;
}

Fault parse_fault(std::string_view text) {
  std::istringstream words{std::string(text)};
  std::string head;
  words >> head;
  const auto at = head.find('@');
  if (at == std::string::npos || at == 0)
    throw std::invalid_argument(
        "KIND@SECONDS is expected, as in \"knock@42 camera=1 pitch_deg=0.2\"");
  std::vector<std::pair<std::string, double>> parameters;
  for (std::string word; words >> word;) {
    const auto equals = word.find('=');
    if (equals == std::string::npos || equals == 0)
      throw std::invalid_argument(
          "\"" + word.substr(0, 40) +
          "\" is not NAME=NUMBER, as in \"knock@42 camera=1 pitch_deg=0.2\"");
    const std::string name = word.substr(0, equals);
    parameters.emplace_back(name, number(std::string_view(word).substr(equals + 1), name));
  }
  return make_fault(
      head.substr(0, at),
      number(std::string_view(head).substr(at + 1), "the time of " + head.substr(0, at)),
      parameters);
}

std::string fault_document() {
  std::string table =
      "| kind | what happens | parameter | default | range | meaning "
      "|\n|---|---|---|---|---|---|\n";
  for (const FaultRow& row : kRows) {
    if (row.parameters.empty())
      table += "| `" + std::string(row.name) + "` | " + row.meaning + " | – | | | |\n";
    bool first = true;
    for (const FaultParameter& p : row.parameters) {
      table += first ? "| `" + std::string(row.name) + "` | " + row.meaning : std::string("| | ");
      table += " | `" + std::string(p.name) + "` | " + to_text(p.fallback) + " | " +
               to_text(p.least) + " … " + to_text(p.most) + " | " + p.meaning + " |\n";
      first = false;
    }
  }
  return table;
}

}  // namespace vergence::mock
