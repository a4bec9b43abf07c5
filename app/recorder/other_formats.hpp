#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "app/recorder/earth_figures.hpp"
#include "app/recorder/recorder.hpp"
#include "core/comparison/geodesy.hpp"

/// The drive once more, in forms that other programs read: what `--also` asks for.
namespace vergence::app {

enum class OtherFormat : std::uint8_t {
  kitti,    // trajectory.kitti: T_world_left, twelve numbers a line, a line a pose
  enu,      // trajectory_enu.tum: T_enu_left
  geojson,  // drive.geojson: the path on the earth, a line for every stretch of one status
  kml,      // drive.kml: the same
};

/// Words with commas between them. InputError: a word that is none, or none at all.
[[nodiscard]] std::vector<OtherFormat> parse_other_formats(std::string_view words);

/// Writes them into the session's folder from the totals' trajectory and statuses. All but `kitti`
/// need a placement: without one nothing is written and a sentence says so. → sentences for the
/// user; what could not be written is a fault.
[[nodiscard]] std::vector<std::string> write_other_formats(const std::filesystem::path& session,
                                                           const std::vector<OtherFormat>& formats,
                                                           const SessionTotals& totals,
                                                           const EarthFigures& earth,
                                                           std::vector<std::string>* faults);

}  // namespace vergence::app
