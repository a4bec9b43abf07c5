#include "app/config/configuration.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <set>
#include <sstream>
#include <utility>

#include <fmt/format.h>

#include "app/config/schema.hpp"
#include "app/config/yaml_file.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/nearest.hpp"

namespace vergence::app {

namespace {

// A configuration is a tree of a few dozen leaves; aliases could unfold a small file into billions.
constexpr std::size_t kMaxEntries = 10'000;
constexpr int kDeepest = 8;

/// One value of the user: a leaf of the YAML tree, list items by number.
struct Entry {
  // Full key, such as cameras.0.serial.
  std::string name;
  // Text of the scalar.
  std::string value;
  // False for an empty group or list.
  bool scalar = true;
  // Source for messages: file:line, or the --set argument.
  std::string origin;
};

/// Unfolds a YAML tree into entries. `origin`: for every entry instead of its file:line; empty: by
/// file and line.
// NOLINTNEXTLINE(misc-no-recursion): down to kDeepest
void flatten(const YamlFile& file, const YAML::Node& node, const std::string& name,
             const std::string& origin, std::vector<Entry>* entries, int depth = 0) {
  const std::string here = origin.empty() ? file.at(node) : origin;
  if (depth > kDeepest)
    throw InputError(here + ": \"" + name.substr(0, 60) +
                     "\" is nested too deeply; see docs/configuration.md");
  if (entries->size() >= kMaxEntries)
    throw InputError(here + ": too many values; check that this is the right file");
  if (node.IsMap() && node.size() > 0) {
    for (const auto& item : node) {
      if (!item.first.IsScalar())
        throw InputError(here + ": a list or a group is used as a key; write `key: value`");
      flatten(file, item.second,
              name.empty() ? item.first.Scalar() : name + "." + item.first.Scalar(), origin,
              entries, depth + 1);
    }
  } else if (node.IsSequence() && node.size() > 0) {
    std::size_t index = 0;
    for (const auto& item : node)
      flatten(file, item, name + "." + std::to_string(index++), origin, entries, depth + 1);
  } else {
    const bool scalar = node.IsScalar() || node.IsNull();
    entries->push_back({name, node.IsScalar() ? node.Scalar() : std::string(), scalar, here});
  }
}

void add_file(const YamlFile& file, std::vector<Entry>* entries) {
  if (file.root().IsNull()) return;
  if (!file.root().IsMap())
    file.fail(file.root(),
              "is not a configuration; write `key: value`, with a space after the colon");
  flatten(file, file.root(), "", "", entries);
  std::set<std::string_view> names;
  for (const Entry& entry : *entries)
    if (!names.insert(entry.name).second)
      throw InputError(entry.origin + ": the key \"" + entry.name.substr(0, 120) +
                       "\" is given twice; remove one");
}

/// A list, a group or a quoted text is YAML; any other value is taken as it stands, so that nothing
/// in it needs quoting twice.
void add_argument(const std::string& argument, std::vector<Entry>* entries) {
  const auto equals = argument.find('=');
  const std::string origin = "--set " + argument.substr(0, 120);
  if (equals == std::string::npos || equals == 0)
    throw InputError(origin + ": KEY=VALUE is expected, as in --set odometry.features=400");
  const std::string name = argument.substr(0, equals), value = argument.substr(equals + 1);
  const bool yaml =
      !value.empty() && std::string_view("[{\"'").find(value.front()) != std::string_view::npos;
  if (!yaml) {
    entries->push_back({name, value, true, origin});
    return;
  }
  const YamlFile file = YamlFile::parse(value, origin);
  flatten(file, file.root(), name, origin, entries);
}

bool is_group(const std::string& name) {
  const auto& groups = schema();
  return std::ranges::any_of(groups,
                             [&](const Group& g) { return !g.name.empty() && g.name == name; });
}

const Key* find_key(const std::string& name) {
  for (const Group& group : schema())
    for (const Key& key : group.keys)
      if (key.name == name) return &key;
  return nullptr;
}

std::string last_part(const std::string& name) { return name.substr(name.rfind('.') + 1); }

/// The nearest known key by its whole name; else the one whose last part is nearest (the group was
/// forgotten).
std::string suggestion(const std::string& name) {
  // Keys that are often looked for in the wrong group, with those that set the same thing.
  constexpr std::array<std::pair<std::string_view, std::string_view>, 7> kElsewhere{
      {{"rate", "trigger.rate"},
       {"fps", "trigger.rate"},
       {"frame_rate", "trigger.rate"},
       {"baseline", "rig.nominal.baseline_m"},
       {"baseline_m", "rig.nominal.baseline_m"},
       {"format", "cameras.N.pixel_format"},
       {"exposure", "cameras.N.exposure_us"}}};
  if (name.find(':') != std::string::npos)
    return "; a colon needs a space after it, as in `name: van`";
  if (name.starts_with("cameras.") && name.size() > 8) {
    if (name[8] < '0' || name[8] > '9')
      return "; cameras is a list with one item for each camera, as in `- {driver: v4l2}`";
    if (name.find_first_of("0123", 8) != 8 || (name.size() > 9 && name[9] != '.'))
      return fmt::format("; a rig has at most {} cameras, numbered from 0", kMaxCameras);
    for (const auto& [key, instead] : kElsewhere)
      if (last_part(name) == key) return fmt::format("; did you mean \"{}\"?", instead);
  }
  std::vector<std::string> names, last_parts;
  for (const Group& group : schema())
    for (const Key& key : group.keys) {
      names.push_back(key.name);
      last_parts.push_back(last_part(key.name));
    }
  const auto near = nearest(name, names);
  // A key of another group with exactly this name is more likely meant than one spelled similarly.
  const std::string part = last_part(name);
  const auto same = std::ranges::find(last_parts, part);
  if (same != last_parts.end() && !(near && edit_distance(name, *near) <= 1) &&
      part.find_first_not_of("0123456789") != std::string::npos) {
    std::string found;
    for (const std::string& known : names)
      if (last_part(known) == part) found += (found.empty() ? "\"" : " or \"") + known + "\"";
    return "; did you mean " + found + "?";
  }
  if (near) return "; did you mean \"" + *near + "\"?";
  if (const auto near_part = nearest(part, last_parts)) {
    const auto index = std::ranges::find(last_parts, *near_part) - last_parts.begin();
    return "; did you mean \"" + names[static_cast<std::size_t>(index)] + "\"?";
  }
  return "; docs/configuration.md lists all keys";
}

[[noreturn]] void refuse_unknown(const Entry& entry) {
  const std::string shown = entry.name.substr(0, 120);
  for (auto dot = entry.name.find('.'); dot != std::string::npos;
       dot = entry.name.find('.', dot + 1))
    if (find_key(entry.name.substr(0, dot)) != nullptr)
      throw InputError(entry.origin + ": " + entry.name.substr(0, dot) +
                       " takes one value, not a group or a list");
  // The items of a list have the same keys: the table has item 0's.
  std::string in_table = entry.name;
  if (in_table.starts_with("cameras.") && in_table.size() > 8) in_table[8] = '0';
  const std::string why = new_name(Renamed::Kind::key, in_table);
  throw InputError(entry.origin + ": unknown key \"" + shown + "\"" +
                   (why.empty() ? suggestion(entry.name) : why));
}

/// Suggests a keyword instead of one that the key does not have; empty if nothing is close.
std::string value_suggestion(const std::string& value, const Key& key) {
  const std::string why = new_name(Renamed::Kind::value, key.name + " " + value);
  return why.empty() ? did_you_mean(value, key.words)
                     : fmt::format("; \"{}\"{}", value, why.substr(4));
}

/// The rest of a message "it must be …".
std::string allowed(const Key& key) {
  const std::string range = range_text(key);
  return range.rfind("from ", 0) == 0 ? range + " on" : "in " + range;
}

std::string with_unit(const Key& key) { return key.unit.empty() ? "" : " " + key.unit; }

template <class Number>
Number parse_number(const Entry& entry, const Key& key, const char* kind) {
  Number value{};
  const char* end = entry.value.data() + entry.value.size();
  const auto [stop, error] = std::from_chars(entry.value.data(), end, value);
  if (error != std::errc() || stop != end)
    throw InputError(fmt::format("{}: {} is \"{}\", not {}; it must be {}{}", entry.origin,
                                 key.name, entry.value.substr(0, 60), kind, allowed(key),
                                 with_unit(key)));
  // Written so that a NaN is refused.
  if (!(static_cast<double>(value) >= key.least && static_cast<double>(value) <= key.most))
    throw InputError(fmt::format("{}: {} is {}; it must be {}{}", entry.origin, key.name,
                                 entry.value.substr(0, 60), allowed(key), with_unit(key)));
  return value;
}

/// Maps YAML 1.1 booleans to the keywords on and off.
std::string as_switch(const std::string& value, const std::vector<std::string>& words) {
  const auto is_choice = [&words](const char* word) {
    return std::ranges::find(words, word) != words.end();
  };
  if (!is_choice("on") || !is_choice("off")) return value;
  std::string lower = value;
  std::ranges::transform(lower, lower.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  if (lower == "true" || lower == "yes" || lower == "on") return "on";
  if (lower == "false" || lower == "no" || lower == "off") return "off";
  return value;
}

void apply(const Entry& entry, Configuration* configuration) {
  if (is_group(entry.name)) {
    if (entry.scalar && !entry.value.empty())
      throw InputError(
          entry.origin + ": " + entry.name +
          " is a group of keys, not a value; set one of its keys (docs/configuration.md)");
    return;
  }
  const Key* key = find_key(entry.name);
  if (key == nullptr) refuse_unknown(entry);
  if (!entry.scalar)
    throw InputError(entry.origin + ": " + entry.name + " takes one value, not a group or a list");
  switch (key->type) {
    case KeyType::integer:
      key->set(*configuration, parse_number<std::int64_t>(entry, *key, "an integer"));
      break;
    case KeyType::number:
      key->set(*configuration, parse_number<double>(entry, *key, "a number"));
      break;
    case KeyType::text:
      if (!key->words.empty()) {
        const std::string value = as_switch(entry.value, key->words);
        const bool unset = value.empty() && to_text(key->get(Configuration{})).empty();
        if (!unset && std::ranges::find(key->words, value) == key->words.end())
          throw InputError(fmt::format("{}: {} is \"{}\"; it must be one of {}{}", entry.origin,
                                       key->name, entry.value.substr(0, 60), range_text(*key),
                                       value_suggestion(entry.value, *key)));
        key->set(*configuration, value);
        break;
      }
      if (static_cast<double>(entry.value.size()) > key->most)
        throw InputError(fmt::format("{}: {} is longer than the limit of {} bytes; shorten it",
                                     entry.origin, key->name, key->most));
      key->set(*configuration, entry.value);
      break;
  }
}

/// The faults that stand as groups, `faults.N.NAME`, become texts of one line: `KIND@SECONDS
/// NAME=NUMBER …`.
std::vector<Entry> with_faults_as_text(const std::vector<Entry>& entries) {
  std::vector<Entry> out;
  // The keys are `faults.N`, then the name; the last value of a name is used.
  std::map<std::string, std::map<std::string, Entry>> faults;
  for (const Entry& entry : entries) {
    const auto dot = entry.name.find('.', 7);
    if (!entry.name.starts_with("faults.") || dot == std::string::npos) {
      out.push_back(entry);
    } else {
      if (!entry.scalar || entry.value.find_first_of(" =@") != std::string::npos)
        throw InputError(entry.origin + ": " + entry.name.substr(0, 120) +
                         " takes one number or keyword");
      faults[entry.name.substr(0, dot)].insert_or_assign(entry.name.substr(dot + 1), entry);
    }
  }
  for (const auto& [name, parts] : faults) {
    const std::string& origin = parts.begin()->second.origin;
    if (!parts.contains("kind") || !parts.contains("at"))
      throw InputError(
          origin + ": " + name +
          " needs `kind` and `at`, as in {at: 42, kind: knock, camera: 1, pitch_deg: 0.2}");
    std::string text = parts.at("kind").value + "@" + parts.at("at").value;
    for (const auto& [key, entry] : parts)
      if (key != "kind" && key != "at") text += " " + key + "=" + entry.value;
    out.push_back({name, text, true, origin});
  }
  return out;
}

/// The camera that an entry `cameras.N.options` or `cameras.N.options.NAME` is for; nullopt: it is
/// for another key. *name: NAME, empty for all of them.
std::optional<std::size_t> camera_of_options(const Entry& entry, std::string* name) {
  constexpr std::string_view kList = "cameras.", kGroup = ".options";
  const auto at = entry.name.find(kGroup);
  if (!entry.name.starts_with(kList) || at != kList.size() + 1) return std::nullopt;
  const auto after = at + kGroup.size();
  const std::size_t camera = static_cast<std::size_t>(entry.name[kList.size()] - '0');
  if (camera >= kMaxCameras) return std::nullopt;
  if (entry.name.size() == after) {
    name->clear();
    return camera;
  }
  if (entry.name[after] != '.') return std::nullopt;
  *name = entry.name.substr(after + 1);
  return camera;
}

/// After every other key: which options there are is the driver's matter.
void apply_camera_options(const std::vector<Entry>& entries, Configuration* configuration) {
  for (const Entry& entry : entries) {
    std::string name;
    const auto camera = camera_of_options(entry, &name);
    if (!camera) continue;
    CameraSettings& settings = configuration->cameras[*camera];
    std::string why;
    if (name.empty() && !entry.scalar)
      settings.options = {};
    else if (name.empty())
      why = set_camera_options(entry.value, &settings);
    else if (!entry.scalar || entry.value.empty() ||
             entry.value.find_first_of(" =") != std::string::npos)
      why = name.substr(0, 120) + " takes one number or keyword";
    else
      why = set_camera_option(name, entry.value, &settings);
    if (!why.empty())
      throw InputError(fmt::format("{}: cameras.{}.options: {}", entry.origin, *camera, why));
  }
}

/// `record: [poses, images]` switches its words on.
std::vector<Entry> with_record_as_switches(std::vector<Entry> entries) {
  constexpr std::string_view kGroup = "record.";
  std::vector<std::string> words;
  for (const Group& group : schema())
    for (const Key& key : group.keys)
      if (key.name.starts_with(kGroup) && !key.words.empty())
        words.push_back(key.name.substr(kGroup.size()));
  for (Entry& entry : entries) {
    const bool item =
        entry.name.starts_with(kGroup) && entry.name.size() > kGroup.size() &&
        entry.name.find_first_not_of("0123456789", kGroup.size()) == std::string::npos;
    if (!item) continue;
    if (!entry.scalar || std::ranges::find(words, entry.value) == words.end())
      throw InputError(fmt::format("{}: record lists \"{}\"; its values are {}{}", entry.origin,
                                   entry.value.substr(0, 60), fmt::join(words, ", "),
                                   did_you_mean(entry.value, words)));
    entry.name = std::string(kGroup) + entry.value;
    entry.value = "on";
  }
  return entries;
}

/// Keys of `odometry.preset` come first: a key that is given goes before it. The last
/// preset counts; one that is none is refused with the other values.
std::vector<Entry> with_preset(std::vector<Entry> entries) {
  const auto preset = std::find_if(entries.rbegin(), entries.rend(), [](const Entry& entry) {
    return entry.name == "odometry.preset";
  });
  if (preset == entries.rend() || preset->value != "small") return entries;
  std::vector<Entry> all;
  for (const auto& [key, value] : {std::pair{"odometry.features", "250"},
                                   {"odometry.window_keyframes", "8"},
                                   {"calibration.max_frames", "100"},
                                   {"calibration.max_observations", "50000"}})
    all.push_back({key, value, true, preset->origin});
  all.insert(all.end(), entries.begin(), entries.end());
  return all;
}

Configuration from_entries(const std::vector<Entry>& given, const std::string& name) {
  const std::vector<Entry> entries =
      with_preset(with_record_as_switches(with_faults_as_text(given)));
  Configuration configuration;
  for (const Entry& entry : entries)
    if (std::string option; !camera_of_options(entry, &option)) apply(entry, &configuration);
  apply_camera_options(entries, &configuration);
  if (const std::string message = find_contradiction(configuration); !message.empty())
    throw InputError(name + ": " + message);
  return configuration;
}

Configuration load(const std::optional<YamlFile>& file, const std::vector<std::string>& set) {
  std::vector<Entry> entries;
  if (file) add_file(*file, &entries);
  for (const std::string& argument : set) add_argument(argument, &entries);
  return from_entries(entries, file ? file->name() : "--set");
}

// Maximum number of bytes of an input text that a message repeats.
constexpr std::size_t kMaxShown = 60;

std::string no_such_option(const std::string& name, const CameraSettings& camera) {
  std::vector<std::string> names;
  for (const OptionRow& row : option_rows(camera.options)) names.push_back(row.name);
  return fmt::format("there is no option \"{}\"; {} cameras have {}{}", name.substr(0, kMaxShown),
                     camera.driver, fmt::join(names, ", "), did_you_mean(name, names));
}

}  // namespace

Configuration load_configuration(const std::optional<std::filesystem::path>& file,
                                 const std::vector<std::string>& set) {
  Configuration configuration =
      load(file ? std::optional(YamlFile::read(*file)) : std::nullopt, set);
  if (file) configuration.folder = file->parent_path();
  return configuration;
}

Configuration parse_configuration(std::string_view yaml, const std::string& name,
                                  const std::vector<std::string>& set) {
  return load(YamlFile::parse(yaml, name), set);
}

std::vector<std::pair<std::string, std::string>> changed_settings(const Configuration& c) {
  const Configuration defaults;
  std::vector<std::pair<std::string, std::string>> changed;
  for (const Group& group : schema())
    for (const Key& key : group.keys)
      if (std::string value = to_text(key.get(c)); value != to_text(key.get(defaults)))
        changed.emplace_back(key.name, std::move(value));
  return changed;
}

std::string canonical_text(const Configuration& configuration) {
  std::vector<std::string> lines;
  for (const Group& group : schema())
    for (const Key& key : group.keys)
      lines.push_back(key.name + "=" + to_text(key.get(configuration)) + "\n");
  std::ranges::sort(lines);
  std::string text;
  for (const std::string& line : lines) text += line;
  return text;
}

std::string configuration_hash(const Configuration& configuration) {
  // Offset basis and prime are those of the 64-bit FNV-1a hash.
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const char c : canonical_text(configuration))
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  return fmt::format("{:016x}", hash);
}

std::string set_camera_option(const std::string& name, const std::string& value,
                              CameraSettings* camera) {
  if (std::holds_alternative<std::monostate>(camera->options)) {
    const auto begin = default_options(camera->driver);
    if (!begin) return {};
    camera->options = *begin;
  }
  if (set_option(name, value, &camera->options)) return {};
  const OptionRow* row = find_option(camera->options, name);
  if (row == nullptr) return no_such_option(name, *camera);
  return fmt::format("{} is \"{}\"; it takes {}", name.substr(0, kMaxShown),
                     value.substr(0, kMaxShown), row->values);
}

std::string set_camera_options(const std::string& text, CameraSettings* camera) {
  camera->options = {};
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const auto equals = word.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == word.size())
      return fmt::format(
          "\"{}\" is not an option; write NAME=VALUE, as in packet_size=9000, or a group "
          "{{packet_size: 9000}}",
          word.substr(0, kMaxShown));
    if (std::string why =
            set_camera_option(word.substr(0, equals), word.substr(equals + 1), camera);
        !why.empty())
      return why;
  }
  return {};
}

}  // namespace vergence::app
