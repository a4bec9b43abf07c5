#include <algorithm>

#include <fmt/format.h>

#include "app/config/schema.hpp"

namespace vergence::app {
namespace {

constexpr std::string_view kOpening = R"(# Configuration

Every key that `vergence` understands, with its default. Nothing has to be set: without a configuration the defaults act.
This page is written from the table that the program checks its input with (`app/config/schema*.cpp`).

A configuration is a YAML file. Keys stand in groups:

```yaml
rig: {name: van}
odometry:
  features: 400
  band_px: 3
threads: 2
```

One key can be set on the command line, with any command that runs, as often as needed; the last one wins, over the file too.
Dots stand for groups, numbers for the items of a list:

```sh
vergence replay DATA --format folder --out session --set odometry.features=400 --set odometry.band_px=3
```

`--threads N` and `--seed N` are short for `--set threads=N` and `--set odometry.seed=N`.

A key that does not exist is an error that names the nearest one that does; so is a value of the wrong type or outside its range,
a key that is given twice, and two keys that contradict each other. The sentence names the file and the line; the program exits with 2.

Units stand in the column `unit`; pixels are those of the image as it was taken. `summary.json` of a session holds `configuration_hash`, equal for
equal values of all keys however they were written.
)";

std::string cell(const std::string& text) { return text.empty() ? "–" : text; }

std::string default_text(const Key& key) {
  const std::string text = to_text(key.get(Configuration{}));
  return text.empty() ? "empty" : "`" + text + "`";
}

std::string_view type_text(KeyType type) {
  switch (type) {
    case KeyType::integer:
      return "integer";
    case KeyType::number:
      return "number";
    case KeyType::text:
      return "text";
  }
  return "";
}

/// The items of a list have the same keys: item 0 stands for all, as N.
std::string documented_name(const Group& group, const Key& key) {
  if (group.list.empty()) return key.name;
  const std::string first = group.list + "0";
  return key.name.starts_with(first) ? group.list + "N" + key.name.substr(first.size())
                                     : std::string();
}

}  // namespace

std::string configuration_document() {
  std::string page(kOpening);
  for (const Group& group : schema()) {
    page += group.name.empty() ? std::string("\n## Without a group\n\n")
                               : "\n## `" + group.name + "`\n\n";
    page += group.meaning + "\n\n";
    page += "| key | default | type | unit | range | meaning |\n|---|---|---|---|---|---|\n";
    for (const Key& key : group.keys) {
      const std::string name = documented_name(group, key);
      if (name.empty()) continue;
      page += fmt::format("| `{}` | {} | {} | {} | {} | {} |\n", name, default_text(key),
                          type_text(key.type), cell(key.unit), range_text(key), key.meaning);
    }
  }
  return page;
}

}  // namespace vergence::app
