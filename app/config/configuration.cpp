#include "app/config/configuration.hpp"

#include <yaml-cpp/yaml.h>

#include <set>
#include <sstream>

#include "app/config/schema.hpp"
#include "app/config/yaml_file.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/nearest.hpp"
#include "app/runtime/text_input.hpp"

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

const Key* find_key(const std::string& name) {
  for (const Group& group : schema())
    for (const Key& key : group.keys)
      if (key.name == name) return &key;
  return nullptr;
}

std::string last_part(const std::string& name) { return name.substr(name.rfind('.') + 1); }

/// Keys of any group with the same last part, because the group was forgotten or confused; else the
/// nearest key.
std::string suggestion(const std::string& name) {
  if (name.find(':') != std::string::npos)
    return "; a colon needs a space after it, as in `name: van`";
  if (name.starts_with("cameras.") &&
      (name.find_first_of("0123", 8) != 8 || name.find('.', 8) != 9))
    return fmt::format(
        "; cameras is a list of at most {} items, numbered from 0, as in `- {{driver: v4l2}}`",
        kMaxCameras);
  std::vector<std::string> names, same;
  for (const Group& group : schema())
    for (const Key& key : group.keys) {
      names.push_back(key.name);
      if (last_part(key.name) == last_part(name)) same.push_back('"' + key.name + '"');
    }
  // The numbers of lists are last parts of many keys.
  constexpr std::size_t kMaxSame = 4;
  if (!same.empty() && same.size() <= kMaxSame)
    return fmt::format("; did you mean {}?", fmt::join(same, " or "));
  const std::string near = did_you_mean(name, names);
  return near.empty() ? "; docs/configuration.md lists all keys" : near;
}

[[noreturn]] void refuse_unknown(const Entry& entry) {
  for (auto dot = entry.name.find('.'); dot != std::string::npos;
       dot = entry.name.find('.', dot + 1))
    if (find_key(entry.name.substr(0, dot)) != nullptr)
      throw InputError(entry.origin + ": " + entry.name.substr(0, dot) +
                       " takes one value, not a group or a list");
  // The items of a list have the same keys: the table has item 0's.
  std::string in_table = entry.name;
  if (in_table.starts_with("cameras.") && in_table.size() > 8) in_table[8] = '0';
  const std::string why = new_name(Renamed::Kind::key, in_table);
  throw InputError(entry.origin + ": unknown key \"" + entry.name.substr(0, 120) + "\"" +
                   (why.empty() ? suggestion(entry.name) : why));
}

template <class Number>
Number parse_number(const Entry& entry, const Key& key, const char* kind) {
  Number value{};
  const bool parsed = parse_whole(entry.value, &value);
  // Written so that a NaN is refused.
  if (parsed && static_cast<double>(value) >= key.least && static_cast<double>(value) <= key.most)
    return value;
  const std::string range = range_text(key), text(entry.value.substr(0, 60));
  throw InputError("{}: {} is {}; it must be {}{}{}", entry.origin, key.name,
                   parsed ? text : fmt::format("\"{}\", not {}", text, kind),
                   range.starts_with("from ") ? range + " on" : "in " + range,
                   key.unit.empty() ? "" : " ", key.unit);
}

/// Maps YAML 1.1 booleans to the keywords on and off.
std::string as_switch(const std::string& value, const std::vector<std::string>& words) {
  const auto is_choice = [&words](const char* word) {
    return std::ranges::find(words, word) != words.end();
  };
  if (!is_choice("on") || !is_choice("off")) return value;
  bool on = false;
  if (!YAML::convert<bool>::decode(YAML::Node(value), on)) return value;
  return on ? "on" : "off";
}

void apply(const Entry& entry, Configuration* configuration) {
  if (!entry.name.empty() &&
      std::ranges::find(schema(), entry.name, &Group::name) != schema().end()) {
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
  if (key->type == KeyType::integer)
    return key->set(*configuration, parse_number<std::int64_t>(entry, *key, "an integer"));
  if (key->type == KeyType::number)
    return key->set(*configuration, parse_number<double>(entry, *key, "a number"));
  const std::string value = as_switch(entry.value, key->words);
  const bool unset = value.empty() && to_text(key->get(Configuration{})).empty();
  if (!key->words.empty() && !unset && std::ranges::find(key->words, value) == key->words.end()) {
    const std::string why = new_name(Renamed::Kind::value, key->name + " " + value);
    throw InputError("{}: {} is \"{}\"; it must be one of {}{}", entry.origin, key->name,
                     value.substr(0, 60), range_text(*key),
                     why.empty() ? did_you_mean(value, key->words) : why);
  }
  if (key->words.empty() && static_cast<double>(value.size()) > key->most)
    throw InputError("{}: {} is longer than the limit of {} bytes; shorten it", entry.origin,
                     key->name, key->most);
  try {
    key->set(*configuration, value);
  } catch (const InputError& e) {
    throw InputError(entry.origin + ": " + key->name + ": " + e.what());
  }
}

/// The key that takes a text or a group of values, `faults.N` or `cameras.N.options`, of an entry
/// with that name or below it; empty for another one.
std::string text_key(const std::string& name) {
  const auto prefix = [&](std::size_t size) {
    return name.size() == size || name[size] == '.' ? name.substr(0, size) : std::string();
  };
  constexpr std::string_view kOptions = ".options";
  if (name.starts_with("faults.")) return prefix(std::min(name.find('.', 7), name.size()));
  if (name.starts_with("cameras.") && name.find(kOptions) == 9) return prefix(9 + kOptions.size());
  return {};
}

/// Groups that stand for a text of one line: of a camera's options `NAME=VALUE …`, of a fault
/// `KIND@SECONDS NAME=VALUE …`. They come after all other keys, because a camera's driver defines
/// its options.
std::vector<Entry> with_groups_as_text(const std::vector<Entry>& entries) {
  struct Text {
    std::string value, kind, at, origin;
  };
  std::vector<Entry> out;
  std::map<std::string, Text> texts;
  for (const Entry& entry : entries) {
    const std::string key = text_key(entry.name);
    if (key.empty()) {
      out.push_back(entry);
      continue;
    }
    Text& text = texts[key];
    text.origin = entry.origin;
    if (entry.name == key) {
      text.value = entry.value;
      continue;
    }
    const std::string name = entry.name.substr(key.size() + 1);
    if (!entry.scalar || entry.value.empty() ||
        entry.value.find_first_of(" =@") != std::string::npos)
      throw InputError(entry.origin + ": " + key + ": " + name.substr(0, 120) +
                       " takes one number or keyword");
    if (key.starts_with("faults.") && (name == "kind" || name == "at"))
      (name == "kind" ? text.kind : text.at) = entry.value;
    else
      text.value += (text.value.empty() ? "" : " ") + name + "=" + entry.value;
  }
  for (const auto& [key, text] : texts) {
    const bool group = key.starts_with("faults.") && text.value.find('@') == std::string::npos;
    if (group && (text.kind.empty() || text.at.empty()))
      throw InputError(
          text.origin + ": " + key +
          " needs `kind` and `at`, as in {at: 42, kind: knock, camera: 1, pitch_deg: 0.2}");
    const std::string head = group ? text.kind + "@" + text.at : "";
    out.push_back({key,
                   fmt::format("{}{}{}", head, group && !text.value.empty() ? " " : "", text.value),
                   true, text.origin});
  }
  return out;
}

/// `record: [poses, images]` switches these keys on.
std::vector<Entry> with_record_as_switches(std::vector<Entry> entries) {
  constexpr std::string_view kGroup = "record.";
  for (Entry& entry : entries)
    if (entry.name.starts_with(kGroup) && entry.name.size() > kGroup.size() &&
        entry.name.find_first_not_of("0123456789", kGroup.size()) == std::string::npos) {
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

Configuration load(const std::optional<YamlFile>& file, const std::vector<std::string>& set) {
  std::vector<Entry> entries;
  if (file) add_file(*file, &entries);
  for (const std::string& argument : set) add_argument(argument, &entries);
  Configuration configuration;
  for (const Entry& entry : with_preset(with_record_as_switches(with_groups_as_text(entries))))
    apply(entry, &configuration);
  if (const std::string message = find_contradiction(configuration); !message.empty())
    throw InputError((file ? file->name() : "--set") + ": " + message);
  return configuration;
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
  std::set<std::string> lines;
  for (const Group& group : schema())
    for (const Key& key : group.keys)
      lines.insert(key.name + "=" + to_text(key.get(configuration)) + "\n");
  return fmt::format("{}", fmt::join(lines, ""));
}

std::string configuration_hash(const Configuration& configuration) {
  // Offset basis and prime are those of the 64-bit FNV-1a hash.
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const char c : canonical_text(configuration))
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  return fmt::format("{:016x}", hash);
}

void set_camera_options(const std::string& text, CameraSettings* camera) {
  const auto defaults = default_options(camera->driver);
  camera->options = {};
  if (text.empty() || !defaults) return;
  camera->options = *defaults;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    // Maximum number of bytes that a message repeats.
    constexpr std::size_t kShown = 60;
    const auto equals = std::min(word.find('='), word.size());
    const std::string name = word.substr(0, equals),
                      value = word.substr(std::min(equals + 1, word.size()));
    if (name.empty() || value.empty())
      throw InputError(
          "\"{}\" is not an option; write NAME=VALUE, as in packet_size=9000, or a group "
          "{{packet_size: 9000}}",
          word.substr(0, kShown));
    if (set_option(name, value, &camera->options)) continue;
    if (const OptionRow* row = find_option(camera->options, name))
      throw InputError("{} is \"{}\"; it takes {}", name.substr(0, kShown), value.substr(0, kShown),
                       row->values);
    std::vector<std::string> names;
    for (const OptionRow& row : option_rows(camera->options)) names.push_back(row.name);
    throw InputError("there is no option \"{}\"; {} cameras have {}{}", name.substr(0, kShown),
                     camera->driver, fmt::join(names, ", "), did_you_mean(name, names));
  }
}

}  // namespace vergence::app
