#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iterator>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "app/config/camera_options.hpp"
#include "app/config/schema.hpp"

/// The groups that schema() is made of, and what builds one. One source for each kind of group:
/// schema_rig.cpp, schema_ins.cpp, schema_estimator.cpp, schema_mock.cpp, schema_session.cpp.
namespace vergence::app::groups {

/// Rows whose values are fields of one part of the configuration. `part` gives that part, of a
/// Configuration const or not.
template <class Settings>
class Rows {
 public:
  template <class Part>
  Rows(std::string prefix, std::string meaning, Part part)
      : prefix_(std::move(prefix)),
        part_([part](Configuration& c) -> Settings& { return part(c); }),
        const_part_([part](const Configuration& c) -> const Settings& { return part(c); }) {
    group_.name = prefix_.substr(0, prefix_.find('.'));
    group_.meaning = std::move(meaning);
  }

  /// Any integral field.
  template <class Integer>
  Rows& integer(const char* name, Integer Settings::*field, std::int64_t least, std::int64_t most,
                const char* unit, const char* meaning) {
    add(
        name, KeyType::integer, static_cast<double>(least), static_cast<double>(most), unit,
        meaning,
        [field](Settings& s, const KeyValue& v) {
          s.*field = static_cast<Integer>(std::get<std::int64_t>(v));
        },
        [field](const Settings& s) -> KeyValue { return static_cast<std::int64_t>(s.*field); });
    return *this;
  }

  Rows& number(const char* name, double Settings::*field, double least, double most,
               const char* unit, const char* meaning) {
    add(
        name, KeyType::number, least, most, unit, meaning,
        [field](Settings& s, const KeyValue& v) { s.*field = std::get<double>(v); },
        [field](const Settings& s) -> KeyValue { return s.*field; });
    return *this;
  }

  /// A list: one key for each number, `name.0` and so on.
  template <std::size_t N>
  Rows& numbers(const char* name, std::array<double, N> Settings::*field, double least, double most,
                const char* unit, const std::array<const char*, N>& meanings) {
    for (std::size_t i = 0; i < N; ++i)
      add(
          name + ("." + std::to_string(i)), KeyType::number, least, most, unit, meanings[i],
          [field, i](Settings& s, const KeyValue& v) { (s.*field)[i] = std::get<double>(v); },
          [field, i](const Settings& s) -> KeyValue { return (s.*field)[i]; });
    return *this;
  }

  Rows& text(const char* name, std::string Settings::*field, std::size_t longest,
             const char* meaning) {
    add(
        name, KeyType::text, 0, static_cast<double>(longest), "", meaning,
        [field](Settings& s, const KeyValue& v) { s.*field = std::get<std::string>(v); },
        [field](const Settings& s) -> KeyValue { return s.*field; });
    return *this;
  }

  /// A number that is chosen by its word: the first stands for 0.
  Rows& choice(const char* name, int Settings::*field, const std::vector<std::string>& words,
               const char* meaning) {
    add(
        name, KeyType::text, 0, 0, "", meaning,
        [field, words](Settings& s, const KeyValue& v) {
          s.*field = static_cast<int>(
              std::find(words.begin(), words.end(), std::get<std::string>(v)) - words.begin());
        },
        [field, words](const Settings& s) -> KeyValue {
          return words[static_cast<std::size_t>(s.*field)];
        });
    group_.keys.back().words = words;
    return *this;
  }

  /// One of the values of an enumeration, by its word.
  template <class Enum>
  Rows& choice(const char* name, Enum Settings::*field,
               const std::vector<std::pair<std::string, Enum>>& choices, const char* meaning) {
    add(
        name, KeyType::text, 0, 0, "", meaning,
        [field, choices](Settings& s, const KeyValue& v) {
          for (const auto& [word, value] : choices)
            if (word == std::get<std::string>(v)) s.*field = value;
        },
        [field, choices](const Settings& s) -> KeyValue {
          for (const auto& [word, value] : choices)
            if (value == s.*field) return word;
          return std::string();
        });
    for (const auto& [word, value] : choices) group_.keys.back().words.push_back(word);
    return *this;
  }

  /// A text that is one of a few words.
  Rows& word(const char* name, std::string Settings::*field, std::vector<std::string> words,
             const char* meaning) {
    text(name, field, 0, meaning);
    group_.keys.back().words = std::move(words);
    return *this;
  }

  /// The options of a camera's driver, as one text.
  Rows& options(const char* name, CameraOptions Settings::*field, std::size_t longest,
                const char* meaning) {
    add(
        name, KeyType::text, 0, static_cast<double>(longest), "", meaning,
        [](Settings& s, const KeyValue& v) {
          (void)set_camera_options(std::get<std::string>(v), &s);
        },
        [field](const Settings& s) -> KeyValue { return options_text(s.*field); });
    return *this;
  }

  /// The rows of another part, behind these.
  Rows& also(Group&& other) {
    std::move(other.keys.begin(), other.keys.end(), std::back_inserter(group_.keys));
    return *this;
  }

  [[nodiscard]] Group done() { return std::move(group_); }

 private:
  void add(const std::string& name, KeyType type, double least, double most, const char* unit,
           const char* meaning, std::function<void(Settings&, const KeyValue&)> set,
           std::function<KeyValue(const Settings&)> get) {
    group_.keys.push_back({prefix_ + "." + name,
                           type,
                           unit,
                           least,
                           most,
                           meaning,
                           [part = part_, set = std::move(set)](
                               Configuration& c, const KeyValue& v) { set(part(c), v); },
                           [part = const_part_, get = std::move(get)](const Configuration& c) {
                             return get(part(c));
                           },
                           {}});
  }

  std::string prefix_;
  std::function<Settings&(Configuration&)> part_;
  std::function<const Settings&(const Configuration&)> const_part_;
  Group group_;
};

// schema_rig.cpp: cameras and what makes them expose.
[[nodiscard]] Group rig();
[[nodiscard]] Group cameras();
[[nodiscard]] Group exposure();
[[nodiscard]] Group trigger();
[[nodiscard]] Group sync();
// schema_ins.cpp: the reference.
[[nodiscard]] Group ins();
[[nodiscard]] Group comparison();
// schema_estimator.cpp: what computes.
[[nodiscard]] Group odometry();
[[nodiscard]] Group calibration_options();
[[nodiscard]] Group monitor();
// schema_mock.cpp: the simulated rig.
[[nodiscard]] Group mock();
[[nodiscard]] Group faults();
// schema_session.cpp: what a session reads, writes and publishes, and how it is scheduled.
[[nodiscard]] Group general();
[[nodiscard]] Group kitti_raw();
[[nodiscard]] Group record();
[[nodiscard]] Group publish();
[[nodiscard]] Group realtime();

}  // namespace vergence::app::groups
