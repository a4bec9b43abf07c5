#include "app/recorder/other_formats.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <iterator>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "app/datasets/decimal.hpp"
#include "app/datasets/text_file.hpp"
#include "app/recorder/line_file.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/nearest.hpp"

namespace vergence::app {
namespace {

struct FormatRow {
  const char* word;
  OtherFormat format;
  const char* file;
};
constexpr std::array kFormats{FormatRow{"kitti", OtherFormat::kitti, "trajectory.kitti"},
                              FormatRow{"enu", OtherFormat::enu, "trajectory_enu.tum"},
                              FormatRow{"geojson", OtherFormat::geojson, "drive.geojson"},
                              FormatRow{"kml", OtherFormat::kml, "drive.kml"}};

// The colours of the report's page.
constexpr const char* kGood = "#1a7f37";
constexpr const char* kCare = "#b35900";
constexpr const char* kIns = "#6e7781";

/// A file that is written a piece at a time: a drive of any length is not text in memory.
class Pieces {
 public:
  explicit Pieces(const std::filesystem::path& file) : file_(file) {}
  void add(std::string_view text) {
    (void)file_.append(text);  // what finds no room on the disk is counted there
    if ((waiting_ += text.size()) < kBlock) return;
    waiting_ = 0;
    (void)file_.flush();
  }
  void close(std::vector<std::string>* faults) {
    if (file_.close() && file_.lost_lines() == 0) return;
    faults->push_back(file_.path().string() + ": is not complete (" + std::strerror(file_.fault()) +
                      "); make room on that disk");
  }

 private:
  static constexpr std::size_t kBlock = std::size_t{1} << 16U;  // bytes
  LineFile file_;
  std::size_t waiting_ = 0;
};

void write_kitti(const std::vector<StampedPose>& poses, Pieces* out) {
  std::string line;
  for (const StampedPose& pose : poses) {
    const Transform& T = pose.T_world_body;
    line.clear();
    for (int row = 0; row < 3; ++row)
      fmt::format_to(std::back_inserter(line), "{}{:.9e} {:.9e} {:.9e} {:.9e}", row > 0 ? " " : "",
                     T.R(row, 0), T.R(row, 1), T.R(row, 2), T.t(row));
    out->add(line + "\n");
  }
}

void write_enu(const std::vector<StampedPose>& poses, const EarthFigures& earth, Pieces* out) {
  for (const StampedPose& pose : poses) {
    const PoseNumbers n =
        PoseNumbers::of(*placement_at(earth.placements, pose.stamp) * pose.T_world_body);
    out->add(fmt::format("{} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
                         format_seconds(pose.stamp.ns()), n.t[0], n.t[1], n.t[2], n.q[0], n.q[1],
                         n.q[2], n.q[3]));
  }
}

/// A stretch of the path that is one line on the map.
struct Stretch {
  std::vector<Geodetic> places{};
  PoseStatus status = PoseStatus::lost;
  Stamp first{}, last{};
};

/// Calls `take` with every stretch of one status and placement. The next one begins where the last
/// one ended, unless poses were lost in between or the drive was placed anew: no one drove the step
/// from one placement to the next.
template <class Take>
void for_each_stretch(const SessionTotals& totals, const EarthFigures& earth, const Take& take) {
  constexpr std::size_t kLongest =
      5000;  // points: map programs draw several lines of that length sooner than one of a day's
  const LocalTangentPlane plane(*earth.origin);
  Stretch now;
  const auto end = [&now, &take] {
    if (now.places.size() > 1) take(now);
    now.places.clear();
  };
  std::size_t next = 0;
  const Transform* T_enu_world = nullptr;
  for (const PoseStatus status : totals.statuses) {
    if (status == PoseStatus::lost || next == totals.trajectory.size()) {
      end();
      continue;
    }
    const StampedPose& pose = totals.trajectory[next++];
    const Transform* before =
        std::exchange(T_enu_world, placement_at(earth.placements, pose.stamp));
    if (T_enu_world != before) end();
    const Geodetic place = plane.to_geodetic(*T_enu_world * pose.T_world_body.t);
    if (!now.places.empty() && (status != now.status || now.places.size() == kLongest)) {
      const Geodetic joint = now.places.back();
      const Stamp at = now.last;
      end();
      now.places.push_back(joint);
      now.first = at;
    }
    if (now.places.empty()) now.first = pose.stamp;
    now.status = status;
    now.last = pose.stamp;
    now.places.push_back(place);
  }
  end();
}

std::vector<Geodetic> ins_way(const SessionTotals& totals, const EarthFigures& earth) {
  std::vector<Geodetic> places;
  places.reserve(totals.reference.size());
  const LocalTangentPlane plane(*earth.origin);
  for (const StampedPose& pose : totals.reference)
    places.push_back(plane.to_geodetic(pose.T_world_body.t));
  return places;
}

/// 1e-8 degrees are a millimetre.
void add_places(const std::vector<Geodetic>& places, const char* form, const char* between,
                Pieces* out) {
  std::string text;
  for (std::size_t i = 0; i < places.size(); ++i) {
    text = i > 0 ? between : "";
    fmt::format_to(std::back_inserter(text), fmt::runtime(form), places[i].longitude_deg,
                   places[i].latitude_deg, places[i].height_m);
    out->add(text);
  }
}

std::string_view status_word(const Stretch& s) { return to_string(s.status); }
const char* colour_of(const Stretch& s) { return s.status == PoseStatus::ok ? kGood : kCare; }

/// RFC 7946; colours by the simplestyle convention, which map programs follow.
void write_geojson(const SessionTotals& totals, const EarthFigures& earth, Pieces* out) {
  const char* between = "";
  const auto line = [&](const std::string& properties, const std::vector<Geodetic>& places) {
    out->add(
        fmt::format("{}\n{{\"type\":\"Feature\",\"properties\":{{{}}},\"geometry\":{{\"type\":"
                    "\"LineString\",\"coordinates\":[",
                    between, properties));
    add_places(places, "[{:.8f},{:.8f},{:.3f}]", ",", out);
    out->add("]}}");
    between = ",";
  };
  out->add("{\"type\":\"FeatureCollection\",\"features\":[");
  if (const auto places = ins_way(totals, earth); places.size() > 1)
    line(fmt::format(R"("name":"INS","stroke":"{}","stroke-width":3)", kIns), places);
  for_each_stretch(totals, earth, [&](const Stretch& s) {
    line(
        fmt::format(
            R"("name":"{0}","status":"{0}","from_stamp_ns":{1},"to_stamp_ns":{2},"stroke":"{3}","stroke-width":3)",
            status_word(s), s.first.ns(), s.last.ns(), colour_of(s)),
        s.places);
  });
  out->add("\n]}\n");
}

/// KML has its colours as alpha, blue, green, red.
std::string kml_colour(std::string_view rgb) {
  return fmt::format("ff{}{}{}", rgb.substr(5, 2), rgb.substr(3, 2), rgb.substr(1, 2));
}

void write_kml(const SessionTotals& totals, const EarthFigures& earth, Pieces* out) {
  const auto line = [&](std::string_view name, const char* colour,
                        const std::vector<Geodetic>& places) {
    out->add(
        fmt::format("<Placemark><name>{}</name><Style><LineStyle><color>{}</color><width>3</"
                    "width></LineStyle></Style>"
                    "<LineString><tessellate>1</tessellate><coordinates>",
                    name, kml_colour(colour)));
    add_places(places, "{:.8f},{:.8f},{:.3f}", " ", out);
    out->add("</coordinates></LineString></Placemark>\n");
  };
  out->add(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<kml "
      "xmlns=\"http://www.opengis.net/kml/2.2\"><Document>\n");
  if (const auto places = ins_way(totals, earth); places.size() > 1) line("INS", kIns, places);
  for_each_stretch(totals, earth,
                   [&](const Stretch& s) { line(status_word(s), colour_of(s), s.places); });
  out->add("</Document></kml>\n");
}

const FormatRow& row_of(OtherFormat format) { return kFormats[static_cast<std::size_t>(format)]; }

/// Why a format cannot be written.
std::string why_not(const SessionTotals& totals) {
  return totals.trajectory.empty() ? "there never was a pose"
                                   : "the drive was never placed on the earth by an INS";
}

/// Nothing where statuses are of the whole drive.
std::optional<std::string> what_is_left_out(OtherFormat format, const SessionTotals& totals) {
  const bool by_status = format == OtherFormat::geojson || format == OtherFormat::kml;
  if (!by_status || totals.statuses_left_out == 0) return std::nullopt;
  return fmt::format(
      "{} ends before the drive: the statuses of its last {} frames had no room; trajectory.tum "
      "has "
      "them all",
      row_of(format).file, totals.statuses_left_out);
}

}  // namespace

std::vector<OtherFormat> parse_other_formats(std::string_view words) {
  std::array<std::string_view, 2 * kFormats.size()> fields;
  const std::size_t count = std::min(split(words, ',', fields), fields.size());
  std::vector<OtherFormat> formats;
  for (std::size_t i = 0; i < count; ++i) {
    const auto found = std::find_if(kFormats.begin(), kFormats.end(),
                                    [&](const FormatRow& r) { return fields[i] == r.word; });
    if (found == kFormats.end())
      throw InputError(fmt::format(
          "--also \"{}\" is not known{}; kitti, enu, geojson and kml are what can be written",
          fields[i], did_you_mean(std::string(fields[i]), {"kitti", "enu", "geojson", "kml"})));
    if (std::find(formats.begin(), formats.end(), found->format) == formats.end())
      formats.push_back(found->format);
  }
  return formats;
}

std::vector<std::string> write_other_formats(const std::filesystem::path& session,
                                             const std::vector<OtherFormat>& formats,
                                             const SessionTotals& totals, const EarthFigures& earth,
                                             std::vector<std::string>* faults) {
  std::vector<std::string> said;
  for (const OtherFormat format : formats) {
    const char* name = row_of(format).file;
    const bool on_earth = format != OtherFormat::kitti;
    if (totals.trajectory.empty() && totals.ok + totals.degraded > 0) {
      faults->push_back(fmt::format("{} is not written: trajectory.tum could not be read back",
                                    (session / name).string()));
      continue;
    }
    if (totals.trajectory.empty() || (on_earth && (earth.placements.empty() || !earth.origin))) {
      said.push_back(fmt::format("{} is not written: {}", name, why_not(totals)));
      continue;
    }
    if (auto sentence = what_is_left_out(format, totals)) said.push_back(*std::move(sentence));
    try {
      Pieces out(session / name);
      if (format == OtherFormat::kitti) write_kitti(totals.trajectory, &out);
      if (format == OtherFormat::enu) write_enu(totals.trajectory, earth, &out);
      if (format == OtherFormat::geojson) write_geojson(totals, earth, &out);
      if (format == OtherFormat::kml) write_kml(totals, earth, &out);
      out.close(faults);
    } catch (const InputError& e) {
      faults->emplace_back(e.what());
    }
  }
  return said;
}

}  // namespace vergence::app
