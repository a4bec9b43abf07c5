#include "app/report/outages.hpp"

#include <algorithm>
#include <cctype>
#include <map>
#include <string_view>

#include <fmt/format.h>

#include "app/report/svg.hpp"

namespace vergence::app::report {
namespace {

constexpr double kLong = 2.0;  // s: the motion across a shorter hole is carried on
constexpr double kLag = 1.0;   // s: frames that are under way when a device goes or comes

/// `camera 1` of `camera 1 is gone; …`.
std::string device_of(const Event& e) {
  if (e.kind.starts_with("board")) return "the trigger board";
  constexpr std::string_view kCamera = "camera ";
  const bool named = e.sentence.starts_with(kCamera) && e.sentence.size() > kCamera.size() &&
                     std::isdigit(static_cast<unsigned char>(e.sentence[kCamera.size()])) != 0;
  return named ? e.sentence.substr(0, kCamera.size() + 1) : "a camera";
}

std::string since_start(const Session& s, Stamp stamp) {
  const Stamp first = s.frames.empty() ? stamp : s.frames.front().stamp;
  return duration_text(seconds_between(first, std::max(first, stamp)), 0.1);
}

double seconds_of(const Outage& o) { return o.to ? seconds_between(o.from, *o.to) : 0; }

bool breaks_the_way(const Outage& o, const Session& s, const Analysis& a) {
  const auto first = std::lower_bound(s.frames.begin(), s.frames.end(), o.from,
                                      [](const Frame& f, Stamp stamp) { return f.stamp < stamp; });
  for (auto i = static_cast<std::size_t>(first - s.frames.begin()); i < s.frames.size(); ++i) {
    if (!s.frames[i].posed || (i < a.breaks.size() && a.breaks[i] != 0)) return true;
    if (o.to && s.frames[i].stamp > *o.to && seconds_between(*o.to, s.frames[i].stamp) > kLag)
      return false;
  }
  return false;
}

/// One piece of advice a device, whatever the number of its outages.
void advise_on_devices(std::span<const Outage> outages, const Session& s, Findings* findings) {
  struct DeviceSum {
    std::size_t count = 0;
    double seconds = 0;
    const Outage* first = nullptr;
    bool open = false;
  };
  std::map<std::string, DeviceSum> devices;
  for (const Outage& o : outages) {
    DeviceSum& sum = devices[o.device];
    if (sum.count++ == 0) sum.first = &o;
    sum.seconds += seconds_of(o);
    sum.open = !o.to;
  }
  for (const auto& [device, sum] : devices) {
    std::string text = device + " was gone";
    text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
    if (sum.count > 1) text += fmt::format(" {} times", sum.count);
    if (sum.seconds > 0) text += " for " + duration_text(sum.seconds, 0.1);
    if (!s.frames.empty()) text += " from " + since_start(s, sum.first->from) + " on";
    findings->advise(text + (sum.open ? ", to the end" : "") + ": check its cable and power.");
  }
}

}  // namespace

std::vector<Outage> outages_of(std::span<const Event> events) {
  std::map<std::string, Stamp> gone;
  std::vector<Outage> outages;
  for (const Event& e : events) {
    const bool begins = e.kind == "camera_gone" || e.kind == "board_gone";
    if (!begins && e.kind != "camera_back" && e.kind != "board_back") continue;
    const std::string device = device_of(e);
    const auto open = gone.find(device);
    if (begins) {
      gone.emplace(device, e.stamp);
    } else if (open != gone.end()) {
      outages.push_back({device, open->second, std::max(open->second, e.stamp)});
      gone.erase(open);
    }
  }
  for (const auto& [device, from] : gone) outages.push_back({device, from, std::nullopt});
  std::stable_sort(outages.begin(), outages.end(),
                   [](const Outage& a, const Outage& b) { return a.from < b.from; });
  return outages;
}

bool break_the_way(std::span<const Outage> outages, const Session& session,
                   const Analysis& analysis) {
  return std::any_of(outages.begin(), outages.end(),
                     [&](const Outage& o) { return breaks_the_way(o, session, analysis); });
}

void judge_outages(std::span<const Outage> outages, const Session& session,
                   const Analysis& analysis, Findings* findings) {
  for (const Outage& o : outages) {
    if (o.to) continue;
    // Frames that were left out may be later.
    const bool last = session.left_out.empty() &&
                      (session.frames.empty() || session.frames.back().stamp <= o.from ||
                       seconds_between(o.from, session.frames.back().stamp) <= kLag);
    if (session.frames.empty())
      findings->find(Grade::bad, "there never was a frame: " + o.device + " was gone");
    else if (last)
      findings->find(Grade::bad,
                     "no frame after " +
                         since_start(session, std::max(o.from, session.frames.back().stamp)) +
                         ": " + o.device + " was gone");
    else
      findings->find(Grade::care,
                     o.device + " was gone from " + since_start(session, o.from) + " to the end");
  }
  advise_on_devices(outages, session, findings);
  const auto worst = std::max_element(
      outages.begin(), outages.end(),
      [](const Outage& a, const Outage& b) { return seconds_of(a) < seconds_of(b); });
  if (worst != outages.end() && seconds_of(*worst) > kLong &&
      breaks_the_way(*worst, session, analysis))
    findings->find(Grade::care,
                   worst->device + " was gone for " + duration_text(seconds_of(*worst), 0.1));
}

}  // namespace vergence::app::report
