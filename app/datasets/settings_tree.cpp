#include "app/datasets/settings_tree.hpp"

#include <algorithm>
#include <sstream>
#include <string_view>

#include <yaml-cpp/yaml.h>

#include "app/datasets/decimal.hpp"
#include "app/datasets/text_file.hpp"

namespace vergence::app {
namespace {

bool begins_number(std::string_view word) {
  double ignored = 0;
  return parse_number(word.substr(0, word.find_first_of(" \t")), &ignored);
}

/// Converts numbers separated by blanks, commas or semicolons to a YAML list.
std::string as_list(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return c == ',' || c == ';'; }, ' ');
  std::istringstream words(text);
  std::string list;
  for (std::string word; words >> word;) list += (list.empty() ? "[" : ", ") + word;
  return list + "]";
}

/// Converts a value of another syntax: a number, a list of numbers, or text.
std::string as_yaml(std::string_view value) {
  value = trimmed(value);
  if (value.starts_with('[') || value.starts_with('{')) return std::string(value);
  const bool several = value.find_first_of(" \t,\n") != std::string_view::npos;
  if (begins_number(value) && several) return as_list(std::string(value));
  return begins_number(value) ? std::string(value) : double_quoted(value);
}

/// OpenCV's XML: elements become keys, an element with text only its value. `depth`: of nesting, at
/// most as deep as such files are.
// NOLINTNEXTLINE(misc-no-recursion): down to kDeepest
std::string from_xml(std::string_view* rest, std::string_view end, int depth) {
  constexpr int kDeepest = 20;
  std::string map;
  std::string_view text;
  while (!rest->empty()) {
    const std::size_t open = rest->find('<');
    text = map.empty() ? rest->substr(0, open) : text;
    if (open == std::string_view::npos) break;
    const std::size_t close = rest->find('>', open);
    if (close == std::string_view::npos) break;
    const std::string_view tag = rest->substr(open + 1, close - open - 1);
    rest->remove_prefix(close + 1);
    if (tag.starts_with('?') || tag.starts_with('!') || tag.ends_with('/')) continue;
    if (tag.starts_with('/')) {
      if (tag.substr(1) == end) break;
      continue;
    }
    const std::string_view name = tag.substr(0, tag.find_first_of(" \t\r\n"));
    if (depth == kDeepest) break;
    const std::string inner = from_xml(rest, name, depth + 1);
    map += (map.empty() ? "" : ", ") + double_quoted(name) + ": " + inner;
  }
  return map.empty() ? as_yaml(text) : "{" + map + "}";
}

/// Converts an ini: sections become groups; an entry is `key = value`, or a key with its numbers in
/// the next lines.
std::string from_ini(std::string_view text) {
  std::string yaml, indent, key, numbers;
  const auto add = [&](std::string_view name, const std::string& value) {
    yaml.append(indent).append(double_quoted(name)).append(": ").append(value).append("\n");
  };
  const auto finish = [&] {
    if (!key.empty() && !numbers.empty()) add(key, as_yaml(numbers));
    key.clear(), numbers.clear();
  };
  Lines lines(text);
  for (std::string_view line; lines.next(&line);) {
    if (line.starts_with(';')) continue;
    if (begins_number(line)) {
      numbers.append(line).append(" ");
      continue;
    }
    finish();
    if (line.starts_with('[') && line.ends_with(']')) {
      indent.clear();
      add(line.substr(1, line.size() - 2), "");
      indent = "  ";
    } else if (const std::size_t equals = line.find('='); equals != std::string_view::npos) {
      add(trimmed(line.substr(0, equals)), as_yaml(line.substr(equals + 1)));
    } else {
      key = line;
    }
  }
  finish();
  return yaml;
}

bool is_ini(std::string_view text) {
  Lines lines(text);
  std::string_view line;
  return lines.next(&line) && line.starts_with('[') && line.ends_with(']') && line.size() > 2 &&
         !begins_number(line.substr(1)) && line.find_first_of(",{\"") == std::string_view::npos;
}

/// OpenCV's header and tabs are not valid YAML 1.2. They are replaced by blanks, so that line
/// numbers stay the same.
void replace_invalid_yaml(std::string* text) {
  if (text->starts_with("\xEF\xBB\xBF")) text->erase(0, 3);
  if (text->starts_with("%YAML"))
    std::fill(text->begin(),
              text->begin() + static_cast<std::ptrdiff_t>(std::min(text->find('\n'), text->size())),
              ' ');
  std::ranges::replace(*text, '\t', ' ');
}

}  // namespace

std::vector<YamlFile> settings_trees(std::string text, const std::string& name) {
  replace_invalid_yaml(&text);
  std::string_view rest = text;
  rest.remove_prefix(std::min(rest.find_first_not_of(" \r\n"), rest.size()));
  if (rest.starts_with('<'))
    text = from_xml(&rest, "", 0);
  else if (is_ini(rest))
    text = from_ini(rest);
  if (text.starts_with("---")) text.replace(0, 3, 3, ' ');
  std::vector<YamlFile> trees;
  // The document follows as many line feeds as precede it in the file, so that line numbers are
  // right.
  std::string document;
  constexpr std::size_t kMaxDocuments = 16;
  rest = text;
  for (std::size_t documents = 1;; ++documents) {
    if (documents > kMaxDocuments)
      refuse(name, 0, "has more documents (---) than a calibration has");
    const std::size_t end = std::min(rest.find("\n---"), rest.size());
    document.append(rest.substr(0, end));
    YamlFile tree = YamlFile::parse(document, name);
    if (!tree.root().IsNull()) trees.push_back(std::move(tree));
    if (end == rest.size()) return trees;
    document.assign(static_cast<std::size_t>(std::ranges::count(document, '\n')) + 1, '\n');
    rest.remove_prefix(std::min(rest.find('\n', end + 1), rest.size()));
  }
}

}  // namespace vergence::app
