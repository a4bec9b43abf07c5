#include "app/report/time_section.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "app/report/plots.hpp"
#include "app/report/svg.hpp"
#include "app/report/tables.hpp"

namespace vergence::app::report {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMostRows = 24;

const Json* part_of(const Json& json, const char* name) {
  if (!json.is_object()) return nullptr;
  const auto it = json.find(name);
  return it == json.end() ? nullptr : &*it;
}

/// Microseconds as a person reads them: `7.3 µs`, `2.1 ms`.
std::string short_time(double us) {
  if (std::abs(us) < 100) return fmt::format("{:.1f} µs", us);
  if (std::abs(us) < 1000) return fmt::format("{:.0f} µs", us);
  return fmt::format("{:.1f} ms", us * 1e-3);
}

std::string time_cell(const Json& json, const char* path) {
  const auto us = number_at(json, path);
  return us && *us > 0 ? short_time(*us) : "–";
}

std::string cells(const std::vector<std::string>& values) {
  std::string row = "<tr>";
  for (std::size_t i = 0; i < values.size(); ++i)
    row += i == 0 ? fmt::format("<th scope=\"row\">{}</th>", escape(values[i]))
                  : fmt::format("<td class=\"n\">{}</td>", escape(values[i]));
  return row + "</tr>\n";
}

std::string head(const std::vector<std::string>& names) {
  std::string row = "<tr>";
  for (std::size_t i = 0; i < names.size(); ++i)
    row +=
        fmt::format("<th scope=\"col\"{}>{}</th>", i == 0 ? "" : " class=\"n\"", escape(names[i]));
  return row + "</tr>\n";
}

std::string pairing_words(const Json& pairing) {
  std::string words = text_at(pairing, "sentence");
  if (words.empty()) return "";
  words[0] =
      static_cast<char>(words[0] >= 'a' && words[0] <= 'z' ? words[0] - 'a' + 'A' : words[0]);
  words += '.';
  const auto flag = [&](const char* name) {
    const Json* at = part_of(pairing, name);
    return at != nullptr && at->is_boolean() && at->get<bool>();
  };
  if (flag("can_be_proven")) {
    if (!flag("proven")) words += " At the end it was not proven.";
    if (const auto s = number_at(pairing, "worst_acquisition_s"); s && *s > 0)
      words += fmt::format(" The proof took {:.2f} s at most.", *s);
    if (const auto n = number_at(pairing, "sets.unproven"); n && *n > 0)
      words += fmt::format(" {:.0f} sets contradicted it.", *n);
  }
  return "<p>" + escape(words, 600) + "</p>\n";
}

std::string clocks_table(const Json& time) {
  const Json* clocks = part_of(time, "clocks");
  if (clocks == nullptr || !clocks->is_array() || clocks->empty()) return "";
  const bool pings = std::any_of(clocks->begin(), clocks->end(),
                                 [](const Json& c) { return part_of(c, "pings") != nullptr; });
  std::vector<std::string> names{"clock", "drift", "error bound, end", "worst"};
  if (pings) names.insert(names.end(), {"round trip", "PPS"});
  std::string table = "<h3>Clocks against the host's</h3><table class=\"clocks\">" + head(names);
  for (std::size_t i = 0; i < std::min(clocks->size(), kMostRows); ++i) {
    const Json& c = (*clocks)[i];
    const auto drift = number_at(c, "drift_ppm");
    std::vector<std::string> row{text_at(c, "device"),
                                 drift && *drift != 0 ? fmt::format("{:+.1f} ppm", *drift) : "–",
                                 time_cell(c, "error_us"), time_cell(c, "worst_error_us")};
    if (pings) {
      const Json* p = part_of(c, "pings");
      const Json* locked = p != nullptr ? part_of(*p, "pps_locked") : nullptr;
      row.push_back(p == nullptr ? "" : time_cell(*p, "rtt_median_us"));
      row.emplace_back(locked == nullptr                             ? ""
                       : locked->is_boolean() && locked->get<bool>() ? "locked"
                                                                     : "no");
    }
    table += cells(row);
  }
  table += "</table>\n";
  if (const auto worst = number_at(time, "worst_stamp_error_us"); worst && *worst > 0)
    table += fmt::format(
        "<p class=\"soft\">Images are stamped to {} at worst, after the first second.</p>\n",
        short_time(*worst));
  if (const auto resets = number_at(time, "clock_resets"); resets && *resets > 0)
    table += fmt::format("<p>Clocks that were found set: {:.0f}.</p>\n", *resets);
  return table;
}

std::string words_of(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

/// Classes as rows, cameras as columns; classes that never occurred are left out.
std::string losses_table(const Json& pairing) {
  const Json* cameras = part_of(pairing, "cameras");
  if (cameras == nullptr || !cameras->is_array() || cameras->empty() || cameras->size() > 8)
    return "";
  const Json* first = part_of((*cameras)[0], "losses");
  if (first == nullptr || !first->is_object()) return "";
  std::vector<std::string> names{"of camera"};
  for (std::size_t k = 0; k < cameras->size(); ++k) names.push_back(fmt::format("{}", k));
  std::string rows;
  std::size_t count = 0;
  for (const auto& [name, unused] : first->items()) {
    if (++count > kMostRows) break;
    std::vector<std::string> row{words_of(name.substr(0, 40))};
    double sum = 0;
    for (const Json& camera : *cameras) {
      const Json* losses = part_of(camera, "losses");
      const auto n = losses != nullptr ? number_at(*losses, name) : std::nullopt;
      sum += n.value_or(0);
      row.push_back(n ? fmt::format("{:.0f}", *n) : "–");
    }
    if (sum > 0) rows += cells(row);
  }
  if (rows.empty()) return "<p>No frame was lost, late, doubled or without its pulse.</p>\n";
  return "<h3>Frames that are in no set, or came otherwise than they should</h3><table "
         "class=\"clocks\">" +
         head(names) + rows + "</table>\n";
}

/// What was lost on a device's line; nothing when nothing was.
std::string line_words(const Json& time, const char* device, const char* name) {
  const Json* counters = part_of(time, device);
  if (counters == nullptr || !counters->is_object()) return "";
  std::string words;
  std::size_t count = 0;
  for (const auto& [key, value] : counters->items()) {
    if (++count > kMostRows) break;
    if (key == "pulses" || key == "starts" || !value.is_number() || value.get<double>() <= 0)
      continue;
    words += fmt::format("{}{} {:.0f}", words.empty() ? "" : ", ", words_of(key.substr(0, 40)),
                         value.get<double>());
  }
  return words.empty() ? "" : fmt::format("<p>{}: {}.</p>\n", name, escape(words, 400));
}

std::string utc_words(const Json& time) {
  const auto ahead = number_at(time, "utc.host_ahead_s");
  if (!ahead) return "";
  const auto least = number_at(time, "utc.least_s").value_or(*ahead),
             most = number_at(time, "utc.most_s").value_or(*ahead);
  return fmt::format(
      "<p>The session's stamps were {:.4f} s {} the INS's UTC ({:.4f} to {:.4f} s); they follow "
      "the host's clock of the day as it was at the start.</p>\n",
      std::abs(*ahead), *ahead < 0 ? "behind" : "ahead of", least, most);
}

struct Bar {
  double from = 0, to = 0, count = 0;  // ms; the last has no end
};

/// Bars between the first and the last that is not empty.
std::vector<Bar> bars_of(const Json& latency) {
  const Json *edges = part_of(latency, "edges"), *counts = part_of(latency, "counts");
  const auto numbers = [](const Json* j) {
    return j != nullptr && j->is_array() &&
           std::all_of(j->begin(), j->end(), [](const Json& n) { return n.is_number(); });
  };
  if (!numbers(edges) || !numbers(counts) || counts->size() != edges->size() + 1 ||
      edges->size() > 64)
    return {};
  std::vector<Bar> bars;
  for (std::size_t i = 0; i < counts->size(); ++i) {
    const double from = i == 0 ? 0 : (*edges)[i - 1].get<double>(),
                 to = i < edges->size() ? (*edges)[i].get<double>() : kNone;
    bars.push_back({from, to, (*counts)[i].get<double>()});
  }
  const auto filled = [](const Bar& b) { return b.count > 0 && std::isfinite(b.count); };
  const auto first = std::find_if(bars.begin(), bars.end(), filled);
  const auto last = std::find_if(bars.rbegin(), bars.rend(), filled);
  if (first == bars.end()) return {};
  return {first, last.base()};
}

std::string latency_picture(const std::vector<Bar>& bars) {
  constexpr double kLeft = 46, kRight = kPlotWidth - 8, kTop = 10, kBottom = kPlotHeight - 38;
  double most = 1;
  for (const Bar& b : bars) most = std::max(most, b.count);
  Svg svg(kPlotWidth, kPlotHeight,
          "How many poses came how many milliseconds after the middle of their exposure");
  for (const double t : nice_ticks(0, most, 4)) {
    const double y = kBottom - t / most * (kBottom - kTop);
    svg.line("tick", kLeft, y, kRight, y);
    svg.text("", Anchor::end, kLeft - 5, y + 4, grouped(static_cast<std::size_t>(t)));
  }
  const double width = (kRight - kLeft) / static_cast<double>(bars.size());
  for (std::size_t i = 0; i < bars.size(); ++i) {
    const double x = kLeft + width * static_cast<double>(i);
    if (bars[i].count > 0) {
      const double height = std::max(1.0, bars[i].count / most * (kBottom - kTop));
      svg.rect("f-ours", x + 1, kBottom - height, width - 2, height);
    }
    svg.text("", Anchor::middle, x, kBottom + 20, fmt::format("{:g}", bars[i].from));
  }
  if (std::isfinite(bars.back().to))
    svg.text("", Anchor::end, kRight + 6, kBottom + 20, fmt::format("{:g}", bars.back().to));
  svg.line("axis", kLeft, kBottom, kRight, kBottom);
  svg.text("", Anchor::middle, (kLeft + kRight) / 2, kBottom + 36,
           "from the middle of the exposure to the pose, ms");
  return std::move(svg).finish();
}

}  // namespace

TimeSection time_section(const Session& session) {
  TimeSection section;
  const Json* time = part_of(session.summary, "time");
  if (time == nullptr || !time->is_object()) return section;
  static const Json kNothing = Json::object();
  const Json* at = part_of(*time, "pairing");
  const Json& pairing = at != nullptr ? *at : kNothing;
  section.body = pairing_words(pairing) + clocks_table(*time) + losses_table(pairing) +
                 line_words(*time, "board", "On the board's line") +
                 line_words(*time, "ins", "On the INS's line") + utc_words(*time);
  const Json* latency = part_of(*time, "latency_ms");
  if (latency == nullptr) return section;
  const std::vector<Bar> bars = bars_of(*latency);
  if (bars.empty()) return section;
  section.latency = latency_picture(bars);
  const auto p50 = number_at(*latency, "p50"), p99 = number_at(*latency, "p99");
  section.caption = "From the exposure to the pose";
  if (p50 && p99)
    section.caption += fmt::format(" · half within {:.0f} ms, 99 % within {:.0f} ms", *p50, *p99);
  const Json* is_virtual = part_of(*latency, "virtual");
  if (is_virtual != nullptr && is_virtual->is_boolean() && is_virtual->get<bool>())
    section.caption += " (devices in virtual time)";
  return section;
}

}  // namespace vergence::app::report
