#include "app/recording/session_description.hpp"

#include <array>

#include <nlohmann/json.hpp>

#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

constexpr std::array<const char*, 3> kTrust{"given", "state_file", "none"};
constexpr std::array<const char*, 2> kAdoption{"after_fixed_frames", "when_ready"};

template <class Enum, std::size_t N>
Enum to_enum(const std::array<const char*, N>& words, const std::string& word,
             const std::string& name) {
  for (std::size_t i = 0; i < N; ++i)
    if (word == words[i]) return static_cast<Enum>(i);
  throw InputError(name + ": the description of the recorded session has \"" + word.substr(0, 40) +
                   "\", which is not a known value; the file is damaged");
}

/// Calls each(key, value) for all members that JSON has in the same form.
template <class Description, class Each>
void for_each_member(Description& d, const Each& each) {
  each("program", d.program), each("calibration", d.calibration), each("nominal", d.nominal);
  each("cause", d.cause), each("source", d.source), each("ins", d.ins);
  each("mount_source", d.mount_source), each("settings", d.settings), each("cameras", d.cameras);
}

}  // namespace

std::string to_json(const SessionDescription& d) {
  nlohmann::json json{{"version", SessionDescription::kVersion},
                      {"trust", kTrust[static_cast<std::size_t>(d.trust)]},
                      {"adoption", kAdoption[static_cast<std::size_t>(d.adoption)]}};
  for_each_member(d, [&](const char* key, const auto& value) { json[key] = value; });
  // Names need not be UTF-8.
  return json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace);
}

SessionDescription parse_session_description(std::string_view json, const std::string& name) {
  try {
    const auto j = nlohmann::json::parse(json);
    if (const int version = j.at("version"); version != SessionDescription::kVersion)
      throw InputError(
          "{}: is a recording of version {}; this program reads version {}; replay it with the "
          "program that made it ({})",
          name, version, SessionDescription::kVersion, j.value("program", "of an unknown version"));
    SessionDescription d;
    for_each_member(d, [&](const char* key, auto& value) { j.at(key).get_to(value); });
    d.trust = to_enum<CalibrationTrust>(kTrust, j.at("trust"), name);
    d.adoption = to_enum<Adoption>(kAdoption, j.at("adoption"), name);
    return d;
  } catch (const nlohmann::json::exception& e) {
    throw InputError(name + ": the description of the recorded session cannot be read (" +
                     std::string(e.what()) + "); the file is damaged");
  }
}

}  // namespace vergence::app
