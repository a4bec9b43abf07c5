#include "app/recorder/time_figures.hpp"

#include <array>
#include <cmath>

#include <nlohmann/json.hpp>

namespace vergence::app {
namespace {

using Json = nlohmann::ordered_json;

/// Three digits after the point: nanoseconds of microseconds, and a thousandth of a ppm.
double rounded(double value) { return std::round(value * 1e3) / 1e3; }

Json counters(const std::vector<std::pair<const char*, std::uint64_t>>& all) {
  Json json = Json::object();
  for (const auto& [name, count] : all) json[name] = count;
  return json;
}

Json clock_json(const ClockFigures& c) {
  Json json = {{"device", c.device},
               {"stamps", c.stamps},
               {"drift_ppm", rounded(c.drift_ppm)},
               {"error_us", rounded(c.error_us)},
               {"worst_error_us", rounded(c.worst_error_us)}};
  if (!c.pings) return json;
  const ClockFigures::Pings& p = *c.pings;
  json["pings"] = {{"asked", p.asked},
                   {"answered", p.answered},
                   {"rtt_least_us", rounded(p.rtt_least_us)},
                   {"rtt_median_us", rounded(p.rtt_median_us)},
                   {"rtt_most_us", rounded(p.rtt_most_us)},
                   {"pps_locked", p.pps_locked},
                   {"pps_age_s", p.pps_age_s >= 0 ? Json(rounded(p.pps_age_s)) : Json()}};
  return json;
}

Json pairing_json(const PairingFigures& p) {
  Json cameras = Json::array();
  bool all = p.can_be_proven;
  for (const CameraPairing& c : p.cameras) {
    all = all && c.proven;
    cameras.push_back({{"proven", p.can_be_proven && c.proven},
                       {"acquisitions", c.acquisitions},
                       {"losses", counters(c.losses)}});
  }
  return {{"mode", p.mode},
          {"sentence", p.sentence},
          {"can_be_proven", p.can_be_proven},
          {"proven", all},
          {"worst_acquisition_s", rounded(p.worst_acquisition_s)},
          {"pauses", p.pauses},
          {"pauses_refused", p.pauses_refused},
          {"sets", counters(p.sets)},
          {"cameras", cameras}};
}

Json latency_json(const TimeFigures& f) {
  if (f.latency.count() == 0) return nullptr;
  constexpr std::array<double, 16> kEdges{1,  2,  3,  5,   7,   10,  15,  20,
                                          30, 50, 70, 100, 150, 200, 500, 1000};  // ms
  Json edges = Json::array(), counts = Json::array();
  std::uint64_t below = 0;
  for (const double edge : kEdges) {
    const std::uint64_t until = f.latency.below(edge);
    edges.push_back(edge);
    counts.push_back(until - below);
    below = until;
  }
  counts.push_back(f.latency.count() - below);  // beyond the last edge
  return {{"mean", rounded(f.latency.mean())},
          {"p50", rounded(f.latency.percentile(0.5))},
          {"p99", rounded(f.latency.percentile(0.99))},
          {"p99_9", rounded(f.latency.percentile(0.999))},
          {"max", rounded(f.latency.max())},
          {"virtual", f.latency_is_virtual},
          {"edges", edges},
          {"counts", counts}};
}

}  // namespace

nlohmann::ordered_json time_json(const TimeFigures& f) {
  Json clocks = Json::array();
  for (const ClockFigures& c : f.clocks) clocks.push_back(clock_json(c));
  Json utc, satellites;
  if (f.utc.readings > 0)
    utc = {{"readings", f.utc.readings},
           {"host_ahead_s", f.utc.host_ahead_s},
           {"least_s", f.utc.least_s},
           {"most_s", f.utc.most_s}};
  if (f.satellites.readings > 0)
    satellites = {{"readings", f.satellites.readings},
                  {"without_fix", f.satellites.without_fix},
                  {"least", f.satellites.least},
                  {"most", f.satellites.most}};
  return {{"clocks", clocks},
          {"clock_resets", f.clock_resets},
          {"worst_stamp_error_us", rounded(f.worst_stamp_error_us)},
          {"pairing", pairing_json(f.pairing)},
          {"board", counters(f.board)},
          {"ins", counters(f.ins)},
          {"latency_ms", latency_json(f)},
          {"utc", utc},
          {"satellites", satellites}};
}

}  // namespace vergence::app
