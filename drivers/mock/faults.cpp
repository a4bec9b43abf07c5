#include "drivers/mock/faults.hpp"

#include <charconv>
#include <sstream>
#include <stdexcept>

#include "core/math/angle.hpp"

namespace vergence::mock {
namespace {

constexpr double kLongest = 86400;  // s: a day
constexpr FaultParameter kCamera{"camera", -1, -1, 3, "which camera, from 0; -1: every one"};
constexpr FaultParameter kCamera1{"camera", 1, 0, 3, "which camera, from 0"};
constexpr FaultParameter kDuration{"duration_s", 5, 0, kLongest, "for how long; 0: to the end"};
constexpr FaultParameter kForGood{"duration_s", 0, 0, kLongest, "for how long; 0: to the end"};
constexpr FaultParameter kShare{"share", 0.1, 0, 1, "of the frames, drawn at random"};
constexpr FaultParameter kPitch{"pitch_deg", 0, -45, 45, "turn about the camera's x axis (right)"};
constexpr FaultParameter kYaw{"yaw_deg", 0, -45, 45, "turn about its y axis (down)"};
constexpr FaultParameter kRoll{"roll_deg", 0, -45, 45, "turn about its z axis (forward)"};
constexpr FaultParameter kX{"x_m", 0, -1, 1, "shift along its x axis"};
constexpr FaultParameter kY{"y_m", 0, -1, 1, "shift along its y axis"};
constexpr FaultParameter kZ{"z_m", 0, -1, 1, "shift along its z axis"};

constexpr FaultParameter kKnock[] = {kCamera1, kPitch, kYaw, kRoll, kX, kY, kZ};
constexpr FaultParameter kDrift[] = {
    kCamera1, kPitch, kYaw, kRoll,
    kX,       kY,     kZ,   {"duration_s", 60, 1, kLongest, "how long it takes; then it stays"}};
constexpr FaultParameter kLag[] = {kCamera1, kForGood};
constexpr FaultParameter kSwap[] = {kForGood};
constexpr FaultParameter kOccluder[] = {
    {"ahead_m", 1.2, -200, 200,
     "from the left camera to its nearest face, ahead; negative: behind"},
    {"left_m", 0, -50, 50, "its middle, to the left of the vehicle's"},
    {"turn_deg", 0, -180, 180,
     "its heading against the vehicle's, to the left; 90: it stands across"},
    {"speed_mps", 0, -40, 40,
     "along its own heading, relative to the vehicle; 0: it moves with the rig"},
    kDuration};
constexpr FaultParameter kCover[] = {kCamera, kDuration};
constexpr FaultParameter kNight[] = {{"factor", 0.02, 0, 1, "brightness against daylight"},
                                     kDuration};
constexpr FaultParameter kExposure[] = {
    kCamera, {"factor", 3, 0, 100, "brightness against what was set"}, kDuration};
constexpr FaultParameter kLose[] = {kCamera, kShare, kDuration};
constexpr FaultParameter kLate[] = {
    kCamera, kShare, {"delay_s", 0.2, 0, 10, "later than usual by this"}, kDuration};
constexpr FaultParameter kBreakPairs[] = {{"share", 1, 0, 1, "of the pulses, drawn at random"},
                                          kDuration};
constexpr FaultParameter kMissed[] = {kCamera1, {"pulses", 1, 1, 1e6, "one after the other"}};
constexpr FaultParameter kBoardGone[] = {
    kDuration,
    {"powered", 0, 0, 1,
     "1: it has a supply of its own and pulses on; 0: it stops with the line and restarts"}};
constexpr FaultParameter kReboot[] = {{"duration_s", 0.5, 0.01, kLongest, "until it pulses again"}};
constexpr FaultParameter kInsGone[] = {kDuration};
constexpr FaultParameter kPositionJump[] = {
    {"east_m", 100, -1e5, 1e5, "towards east"},
    {"north_m", 0, -1e5, 1e5, "towards north"},
    {"up_m", 0, -1e4, 1e4, "upwards"},
    {"duration_s", 0, 0, kLongest, "then it jumps back; 0: it stays"}};
constexpr FaultParameter kTimeJump[] = {
    {"camera", -1, -1, 3, "whose clock; -1: the INS's"},
    {"jump_s", 1, -kLongest, kLongest, "forward, or back if negative"}};

constexpr FaultRow kRows[] = {
    {FaultKind::knock, "knock", "A camera is knocked out of its place and stays so.", kKnock},
    {FaultKind::drift, "drift", "A camera turns or moves evenly, as a mount that warms up.",
     kDrift},
    {FaultKind::recalibrate,
     "recalibrate",
     "A recalibration is requested, as with SIGUSR1; nothing happens to the devices.",
     {}},
    {FaultKind::lag, "lag",
     "A camera is a frame late: the previous image with this one's counter and stamp.", kLag},
    {FaultKind::swap_cables, "swap_cables",
     "The cables of cameras 0 and 1 are swapped; the ground truth is not.", kSwap},
    {FaultKind::occluder, "occluder", "A bus (12 × 2.5 × 3.2 m) is in the way.", kOccluder},
    {FaultKind::cover, "cover", "A lens is covered: black pictures.", kCover},
    {FaultKind::night, "night", "It gets dark for every camera.", kNight},
    {FaultKind::exposure, "exposure", "The brightness of the pictures changes.", kExposure},
    {FaultKind::camera_gone, "camera_gone",
     "A camera is unplugged; if it comes back it counts from 0 again.", kCover},
    {FaultKind::lose_frames, "lose_frames", "Frames never arrive; the counter shows the gaps.",
     kLose},
    {FaultKind::late_frames, "late_frames",
     "Frames arrive late; those on the way as their camera goes are lost.", kLate},
    {FaultKind::duplicate_frames, "duplicate_frames", "Frames arrive twice.", kLose},
    {FaultKind::break_pairs, "break_pairs",
     "Of a pulse one camera's image, drawn at random, never arrives.", kBreakPairs},
    {FaultKind::missed_trigger, "missed_trigger",
     "A camera does not see a pulse: it exposes nothing and does not count it.", kMissed},
    {FaultKind::board_gone, "board_gone", "The line to the trigger board is unplugged.",
     kBoardGone},
    {FaultKind::board_reboot, "board_reboot",
     "The trigger board restarts: pulses stop; counter and clock begin at 0.", kReboot},
    {FaultKind::ins_gone, "ins_gone", "The INS is silent; at 0 it starts late.", kInsGone},
    {FaultKind::no_fix, "no_fix", "The satellite receiver has no position.", kInsGone},
    {FaultKind::position_jump, "position_jump", "The INS's position leaps.", kPositionJump},
    {FaultKind::time_jump, "time_jump", "A device's clock is set.", kTimeJump},
    {FaultKind::disk_full, "disk_full",
     "The session's disk is full: lines wait in memory, up to 1 MB per file.", kInsGone},
};

double number(std::string_view text, const std::string& what) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size())
    throw std::invalid_argument(what + " is \"" + std::string(text.substr(0, 40)) +
                                "\", not a number");
  return value;
}

const FaultRow& row_of(const std::string& kind) {
  for (const FaultRow& row : kRows)
    if (kind == row.name) return row;
  std::string known;
  for (const FaultRow& row : kRows) known += std::string(known.empty() ? "" : ", ") + row.name;
  throw std::invalid_argument("there is no fault \"" + kind.substr(0, 40) + "\"; there are " +
                              known);
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

std::string text_of(double value) {
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
  const FaultRow& row = row_of(kind);
  if (!(at_s >= 0 && at_s <= kLongest))
    throw std::invalid_argument(kind + " must be at 0 … 86400 s of the drive");
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
      throw std::invalid_argument(kind + "'s " + name + " is " + text_of(value) +
                                  "; it must be in " + text_of(known->least) + " … " +
                                  text_of(known->most));
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
      table += " | `" + std::string(p.name) + "` | " + text_of(p.fallback) + " | " +
               text_of(p.least) + " … " + text_of(p.most) + " | " + p.meaning + " |\n";
      first = false;
    }
  }
  return table;
}

}  // namespace vergence::mock
