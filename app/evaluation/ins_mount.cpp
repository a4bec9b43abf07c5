#include "app/evaluation/ins_mount.hpp"

#include <array>
#include <cmath>
#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/datasets/text_file.hpp"
#include "core/comparison/comparison.hpp"
#include "core/math/angle.hpp"

namespace vergence::app {
namespace {

using Json = nlohmann::ordered_json;

/// Nothing: no three finite numbers.
std::optional<Vec3> vector_of(const Json& mount, const char* key) {
  const auto found = mount.find(key);
  if (found == mount.end() || !found->is_array() || found->size() != 3) return std::nullopt;
  Vec3 v;
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(*found)[k].is_number()) return std::nullopt;
    v[static_cast<int>(k)] = (*found)[k].get<double>();
  }
  return v.allFinite() ? std::optional(v) : std::nullopt;
}

/// The mount of a session's summary. Nothing: there is none, as of a drive without an INS or one
/// that was cut off.
std::optional<InsMount> mount_in(const std::filesystem::path& summary) {
  constexpr std::size_t kLargest = std::size_t{1} << 26U;
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(summary, ignored)) return std::nullopt;
  const Json all = Json::parse(read_text(summary, kLargest), nullptr, false);
  const Json mount = all.is_object() ? all.value("/earth/mount"_json_pointer, Json()) : Json();
  if (!mount.is_object()) return std::nullopt;
  const auto arm = vector_of(mount, "lever_arm_m"), turn = vector_of(mount, "boresight_deg");
  if (!arm || !turn) return std::nullopt;
  std::string source = summary.string();
  if (const auto said = mount.find("source"); said != mount.end() && said->is_string())
    source += ": " + said->get<std::string>();
  return InsMount{mount_of(*arm, *turn * kRadiansPerDegree), source, false};
}

}  // namespace

InsMount ins_mount_of(const std::filesystem::path& estimate,
                      const std::filesystem::path& readings) {
  std::error_code ignored;
  for (const std::filesystem::path& path : {estimate, readings}) {
    const bool folder = std::filesystem::is_directory(path, ignored);
    if (auto mount = mount_in((folder ? path : path.parent_path()) / "summary.json")) return *mount;
  }
  return {mount_of(Vec3::Zero(), Vec3::Zero()), "nobody: the axes alone", true};
}

Json ins_mount_json(const InsMount& mount) {
  const Vec3& arm = mount.T_ins_left.t;
  const Vec3 turn = boresight_of(mount.T_ins_left.R) * kDegreesPerRadian;
  return {{"lever_arm_m", {arm.x(), arm.y(), arm.z()}},
          {"boresight_deg", {turn.x(), turn.y(), turn.z()}},
          {"source", mount.source}};
}

std::string ins_mount_text(const InsMount& mount) {
  if (mount.axes_only)
    return "nobody says how the camera sits on the INS: it is taken to look along the INS's x, at "
           "its place; --estimate-mount finds more\n";
  return fmt::format("the INS is brought to the left camera by {}\n", mount.source);
}

}  // namespace vergence::app
