#include "app/recording/session_description.hpp"

#include <array>

#include <fmt/format.h>
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
  throw InputError(name + ": the description of the recorded session says \"" + word.substr(0, 40) +
                   "\", which no version of this program writes there");
}

}  // namespace

std::string to_json(const SessionDescription& d) {
  // Names need not be UTF-8.
  return nlohmann::json{{"version", SessionDescription::kVersion},
                        {"program", d.program},
                        {"calibration", d.calibration},
                        {"nominal", d.nominal},
                        {"trust", kTrust[static_cast<std::size_t>(d.trust)]},
                        {"cause", d.cause},
                        {"source", d.source},
                        {"adoption", kAdoption[static_cast<std::size_t>(d.adoption)]},
                        {"ins", d.ins},
                        {"mount_source", d.mount_source},
                        {"settings", d.settings},
                        {"cameras", d.cameras}}
      .dump(1, ' ', false, nlohmann::json::error_handler_t::replace);
}

SessionDescription parse_session_description(std::string_view json, const std::string& name) {
  try {
    const auto j = nlohmann::json::parse(json);
    if (const int version = j.at("version"); version != SessionDescription::kVersion)
      throw InputError(
          fmt::format("{}: is a recording of version {}; this program reads version {}; replay it "
                      "with the program that made it ({})",
                      name, version, SessionDescription::kVersion,
                      j.value("program", "of which it says nothing")));
    SessionDescription d;
    j.at("program").get_to(d.program);
    j.at("calibration").get_to(d.calibration);
    j.at("nominal").get_to(d.nominal);
    d.trust = to_enum<CalibrationTrust>(kTrust, j.at("trust"), name);
    j.at("cause").get_to(d.cause);
    j.at("source").get_to(d.source);
    d.adoption = to_enum<Adoption>(kAdoption, j.at("adoption"), name);
    j.at("ins").get_to(d.ins);
    j.at("mount_source").get_to(d.mount_source);
    j.at("settings").get_to(d.settings);
    j.at("cameras").get_to(d.cameras);
    return d;
  } catch (const nlohmann::json::exception& e) {
    throw InputError(name + ": the description of the recorded session cannot be read (" +
                     std::string(e.what()) + "); the file is damaged");
  }
}

}  // namespace vergence::app
