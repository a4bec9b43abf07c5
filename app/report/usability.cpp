#include "app/report/usability.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include <fmt/format.h>

#include "app/report/advice.hpp"

namespace vergence::app::report {
namespace {

/// Reasons that time alone may end.
bool is_waiting(std::string_view reason) {
  constexpr std::array kWaiting{"unverified_calibration", "unconfirmed",          "uncalibrated",
                                "needs_motion",           "needs_near_structure", "needs_texture"};
  return std::find(kWaiting.begin(), kWaiting.end(), reason) != kWaiting.end();
}

struct Main {
  std::string_view word;
  std::size_t frames = 0;
};

/// The reason of most frames that are not ok; one that is no waiting goes before, where it is that
/// of a quarter of them or more. Of frames that were not read, the kind of most events.
Main main_reason(const Session& s, const Analysis& a) {
  std::array<Main, 2> most{};  // of those that do not wait, of those that do
  for (std::size_t i = 0; i < std::min(s.reasons.size(), a.by_reason.size()); ++i) {
    Main& main = most[is_waiting(s.reasons[i]) ? 1 : 0];
    if (!s.reasons[i].empty() && a.by_reason[i] > main.frames)
      main = {s.reasons[i], a.by_reason[i]};
  }
  Main main = 4 * most[0].frames >= a.read      ? most[0]
              : most[0].frames > most[1].frames ? most[0]
                                                : most[1];
  for (const Advice& skip : skip_advice()) {
    const auto count = static_cast<std::size_t>(std::count_if(
        s.events.begin(), s.events.end(), [&skip](const Event& e) { return e.kind == skip.word; }));
    if (count > main.frames) main = {skip.word, count};
  }
  return main;
}

/// Frames that a calibration can be confirmed from: those that moved. A vehicle that stands tells
/// nothing of its rig.
std::size_t moving_frames(const Session& s, const Analysis& a) {
  constexpr double kStep = 0.1;  // of the baseline; EuRoC's excerpt moves by 0.12 a frame
  const double least = kStep * number_at(s.summary, "calibration.baseline_m").value_or(0);
  if (!(least > 0)) return a.read;
  std::size_t count = 0;
  for (std::size_t i = 1; i < a.distance_m.size(); ++i)
    if (a.distance_m[i] - a.distance_m[i - 1] >= least) ++count;
  return count;
}

/// Why no calibration was taken, where the drive sought one in vain.
std::string_view rejection(const Session& s) {
  std::string_view why;
  for (const CalibrationRow& row : s.calibrations) {
    if (row.accepted) return {};
    if (!row.kept && !row.reason.empty()) why = row.reason;
  }
  return why;
}

}  // namespace

Usability usability_of(const Session& s, const Analysis& a) {
  if (!a.ok_share || a.ok > 0) return {};
  std::size_t waiting = 0;
  for (const Frame& f : s.frames)
    if (f.status == PoseStatus::degraded && is_waiting(s.reasons[f.reason])) ++waiting;
  const std::string_view rejected = rejection(s);
  if (waiting > 0 && waiting == a.degraded && moving_frames(s, a) < kFramesToConfirm &&
      a.lost <= a.read / 10 && a.skipped <= a.read)
    return {Use::unverified,
            fmt::format("unverified: the drive ended after {} frames, before it could confirm its "
                        "calibration, which takes some {} in motion",
                        a.read, kFramesToConfirm),
            std::string(rejected)};
  const Main main = main_reason(s, a);
  const bool posed = a.degraded > 0;
  Usability u{Use::nothing, "", std::string(advice_for(main.word))};
  u.reason = posed ? fmt::format("not one of {} frames is ok", a.read + a.skipped)
                   : "there never was a pose";
  if (main.frames > 0)
    u.reason += fmt::format(": {} ({} of {} frames)", main.word, main.frames, a.read + a.skipped);
  if (!rejected.empty()) {
    u.reason += fmt::format("; no calibration was found: {}", rejected);
    u.advice = "";
  }
  return u;
}

}  // namespace vergence::app::report
