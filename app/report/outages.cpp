#include "app/report/outages.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "app/report/svg.hpp"
#include "core/types/calibration.hpp"

namespace vergence::app::report {
namespace {

constexpr std::size_t kBoard = kMaxCameras, kSomeCamera = kMaxCameras + 1,
                      kDevices = kMaxCameras + 2;  // bits of Outage::devices
constexpr double kAtOnce = 1.0;  // s: between what one cable does to several devices
constexpr double kLong = 2.0;    // s: the motion across a shorter hole is carried on

std::uint32_t bit(std::size_t device) { return std::uint32_t{1} << device; }

/// The device of an event by its sentence, `camera 1 is gone; …`.
std::size_t device_of(const Event& e) {
  if (e.kind.starts_with("board")) return kBoard;
  constexpr std::string_view kBegin = "camera ";
  if (!e.sentence.starts_with(kBegin)) return kSomeCamera;
  std::size_t camera = 0;
  const char* end = e.sentence.data() + e.sentence.size();
  const auto [at, error] = std::from_chars(e.sentence.data() + kBegin.size(), end, camera);
  return error == std::errc{} && camera < kMaxCameras ? camera : kSomeCamera;
}

bool at_once(Stamp a, Stamp b) {
  return seconds_between(std::min(a, b), std::max(a, b)) <= kAtOnce;
}

bool at_once(const Outage& a, const Outage& b) {
  if (a.to.has_value() != b.to.has_value() || !at_once(a.from, b.from)) return false;
  return !a.to || at_once(*a.to, *b.to);
}

/// One of each device, by their begin.
std::vector<Outage> of_single_devices(std::span<const Event> events) {
  std::array<std::optional<Stamp>, kDevices> gone{};
  std::vector<Outage> outages;
  for (const Event& e : events) {
    const bool begins = e.kind == "camera_gone" || e.kind == "board_gone";
    if (!begins && e.kind != "camera_back" && e.kind != "board_back") continue;
    const std::size_t device = device_of(e);
    if (begins && !gone[device]) gone[device] = e.stamp;
    if (begins || !gone[device]) continue;
    outages.push_back({bit(device), *gone[device], std::max(*gone[device], e.stamp)});
    gone[device].reset();
  }
  for (std::size_t device = 0; device < kDevices; ++device)
    if (gone[device]) outages.push_back({bit(device), *gone[device], std::nullopt});
  std::stable_sort(outages.begin(), outages.end(),
                   [](const Outage& a, const Outage& b) { return a.from < b.from; });
  return outages;
}

/// An outage of other devices at the same time among the newest; nullptr: there is none.
Outage* at_once_with(const Outage& o, std::vector<Outage>* outages) {
  const std::size_t n = outages->size();
  for (std::size_t i = n; i > 0 && i + kDevices > n; --i) {
    Outage& other = (*outages)[i - 1];
    if ((other.devices & o.devices) == 0 && at_once(other, o)) return &other;
  }
  return nullptr;
}

/// Names of devices, and whether they are several.
std::pair<std::string, bool> names_of(std::uint32_t devices) {
  std::string names;
  int cameras = 0;
  for (std::size_t k = 0; k < kMaxCameras; ++k)
    if ((devices & bit(k)) != 0) names += fmt::format("{}{}", cameras++ > 0 ? ", " : "", k);
  if (cameras > 0) names = (cameras > 1 ? "cameras " : "camera ") + names;
  int others = 0;
  for (const auto& [device, name] :
       {std::pair{kSomeCamera, "a camera"}, std::pair{kBoard, "the trigger board"}}) {
    if ((devices & bit(device)) == 0) continue;
    names += (names.empty() ? "" : " and ") + std::string(name);
    ++others;
  }
  return {names, cameras + others > 1};
}

/// When since the first frame, in words; empty without one.
std::string when(const Session& s, Stamp stamp) {
  if (s.frames.empty()) return "";
  const Stamp first = s.frames.front().stamp;
  return duration_text(seconds_between(first, std::max(first, stamp)), 0.1);
}

std::string advice_of(const OutageSum& sum, const Session& s) {
  const std::string from = when(s, sum.from), lasted = duration_text(sum.seconds, 0.1);
  std::string text = gone_sentence(sum.devices);
  text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  if (sum.count > 1) {
    text += fmt::format(" {} times", sum.count);
    text += sum.to ? " for " + lasted + " altogether" : ", the last time to the end";
    if (!from.empty()) text += ", first at " + from;
  } else {
    if (sum.to) text += " for " + lasted;
    if (!from.empty()) text += " from " + from + (sum.to ? " on" : "");
    if (!sum.to) text += " to the end";
  }
  return text + (names_of(sum.devices).second ? ": check their cables and power."
                                              : ": check its cable and power.");
}

/// Of the frames that were read none is later than what began then.
bool nothing_after(const Session& s, Stamp from) {
  return s.left_out.empty() && (s.frames.empty() || s.frames.back().stamp <= from ||
                                seconds_between(from, s.frames.back().stamp) <= kAtOnce);
}

/// Devices that never came back.
void judge_open(std::span<const Outage> outages, const Session& s, Findings* j) {
  std::uint32_t devices = 0;
  Stamp last{};
  for (const Outage& o : outages) {
    if (o.to) continue;
    last = devices == 0 ? o.from : std::max(last, o.from);
    devices |= o.devices;
  }
  if (devices == 0) return;
  const std::string gone = gone_sentence(devices);
  if (s.frames.empty()) return j->find(Grade::bad, "there never was a frame: " + gone);
  if (nothing_after(s, last))
    return j->find(Grade::bad, "no frame after " + when(s, std::max(last, s.frames.back().stamp)) +
                                   ": " + gone);
  for (const Outage& o : outages)
    if (!o.to)
      j->find(Grade::care, gone_sentence(o.devices) + " from " + when(s, o.from) + " to the end");
}

bool breaks_the_way(const Outage& o, const Session& s, const Analysis& a) {
  const auto first = std::lower_bound(s.frames.begin(), s.frames.end(), o.from,
                                      [](const Frame& f, Stamp stamp) { return f.stamp < stamp; });
  for (auto i = static_cast<std::size_t>(first - s.frames.begin()); i < s.frames.size(); ++i) {
    if (!s.frames[i].posed || (i < a.breaks.size() && a.breaks[i] != 0)) return true;
    if (o.to && s.frames[i].stamp > *o.to && seconds_between(*o.to, s.frames[i].stamp) > kAtOnce)
      return false;
  }
  return false;
}

}  // namespace

std::vector<Outage> outages_of(std::span<const Event> events) {
  std::vector<Outage> outages;
  for (const Outage& o : of_single_devices(events)) {
    Outage* same = at_once_with(o, &outages);
    if (same == nullptr) {
      outages.push_back(o);
      continue;
    }
    same->devices |= o.devices;
    if (o.to) same->to = std::max(*same->to, *o.to);
  }
  return outages;
}

std::vector<OutageSum> summed(std::span<const Outage> outages) {
  std::vector<OutageSum> sums;
  for (const Outage& o : outages) {
    auto sum = std::find_if(sums.begin(), sums.end(),
                            [&o](const OutageSum& s) { return s.devices == o.devices; });
    if (sum == sums.end()) sum = sums.insert(sums.end(), {o.devices, 0, o.from, o.to, 0});
    ++sum->count;
    sum->to = o.to;
    if (o.to) sum->seconds += seconds_between(o.from, *o.to);
  }
  return sums;
}

std::string gone_sentence(std::uint32_t devices) {
  const auto [names, several] = names_of(devices);
  return names + (several ? " were gone" : " was gone");
}

bool break_the_way(std::span<const Outage> outages, const Session& session,
                   const Analysis& analysis) {
  return std::any_of(outages.begin(), outages.end(),
                     [&](const Outage& o) { return breaks_the_way(o, session, analysis); });
}

void judge_outages(std::span<const Outage> outages, const Session& session,
                   const Analysis& analysis, Findings* findings) {
  judge_open(outages, session, findings);
  for (const OutageSum& sum : summed(outages)) findings->advise(advice_of(sum, session));
  const auto worst =
      std::max_element(outages.begin(), outages.end(), [](const Outage& a, const Outage& b) {
        return (a.to ? seconds_between(a.from, *a.to) : 0) <
               (b.to ? seconds_between(b.from, *b.to) : 0);
      });
  if (worst == outages.end() || !worst->to) return;
  const double seconds = seconds_between(worst->from, *worst->to);
  if (seconds > kLong && breaks_the_way(*worst, session, analysis))
    findings->find(Grade::care,
                   gone_sentence(worst->devices) + " for " + duration_text(seconds, 0.1));
}

}  // namespace vergence::app::report
