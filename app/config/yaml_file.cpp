#include "app/config/yaml_file.hpp"

#include <array>
#include <cctype>
#include <cmath>
#include <sstream>

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include "app/runtime/errors.hpp"
#include "app/runtime/nearest.hpp"
#include "app/runtime/text_input.hpp"

namespace vergence::app {
namespace {

/// A scalar as it may stand in a message.
std::string shown(const std::string& scalar) {
  // Number of bytes that suffice to recognise the scalar.
  constexpr std::size_t kShown = 60;
  return scalar.size() <= kShown ? scalar : fmt::format("{}…", scalar.substr(0, kShown));
}

/// Looks at the first two documents of a text without building them.
class DocumentCounter final : public YAML::EventHandler {
 public:
  explicit DocumentCounter(const std::string& text) : in_(text), parser_(in_) {
    while (count < 2 && parser_.HandleNextDocument(*this)) {
    }
  }
  int count = 0;
  std::array<YAML::Mark, 2> start{};

  void OnDocumentStart(const YAML::Mark& mark) override {
    start[static_cast<std::size_t>(count++)] = mark;
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& /*mark*/, YAML::anchor_t /*anchor*/) override {}
  void OnAlias(const YAML::Mark& /*mark*/, YAML::anchor_t /*anchor*/) override {}
  void OnScalar(const YAML::Mark& /*mark*/, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                const std::string& /*value*/) override {}
  void OnSequenceStart(const YAML::Mark& /*mark*/, const std::string& /*tag*/,
                       YAML::anchor_t /*anchor*/, YAML::EmitterStyle::value /*style*/) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark& /*mark*/, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                  YAML::EmitterStyle::value /*style*/) override {}
  void OnMapEnd() override {}

 private:
  std::istringstream in_;
  YAML::Parser parser_;
};

/// At a comma or bracket that nothing opened yaml-cpp 0.7 finds empty documents without end, each
/// at the same place: LoadAll() never comes back.
void check_documents(const std::string& text, const std::string& name) {
  const DocumentCounter documents(text);
  if (documents.count < 2) return;
  if (documents.start[0].pos == documents.start[1].pos)
    throw InputError("{}:{}: is not YAML: a value is expected", name, documents.start[0].line + 1);
  throw InputError(name + ": holds several YAML documents; remove the lines `---` between them");
}

/// ` is "VALUE"`, as a part of a message.
std::string is_value(const YAML::Node& node) {
  return node.IsScalar() ? " is \"" + shown(node.Scalar()) + "\"" : " is a list or a group";
}

/// Explains an error of yaml-cpp, whose own words name the grammar's rules, and the usual fix.
std::string explain(const YAML::Exception& error, const std::string& text) {
  using Explanation = std::pair<std::string_view, std::string_view>;
  constexpr std::string_view kIndentation =
      "the indentation does not match the lines above; indent the keys of a group, and the items "
      "of a list, by the same number of spaces";
  constexpr std::string_view kOpen =
      "a `{` or `[` is not closed, or a comma is missing; close it, and separate its items by "
      "commas";
  constexpr std::array kExplanations{
      Explanation{
          "illegal map value",
          "a second `key: value` on one line, or a line that is indented too far; write one key "
          "per line, indented as its neighbours are, and put a text with a colon in quotes"},
      Explanation{"end of map not found", kIndentation},
      Explanation{"end of sequence not found", kIndentation},
      Explanation{"illegal block entry", kIndentation},
      Explanation{"end of map flow not found", kOpen},
      Explanation{"end of sequence flow not found", kOpen},
      Explanation{"illegal flow end", "a `}` or `]` that nothing opens; remove it"},
      Explanation{"the referenced anchor is not defined",
                  "a value that begins with `*` is a reference; put the value in quotes"},
      Explanation{"unknown token",
                  "a value begins with a character that YAML reserves, such as @ or %; put the "
                  "value in quotes"}};
  if (!error.mark.is_null()) {
    std::istringstream lines(text);
    std::string line;
    for (int i = 0; i <= error.mark.line; ++i) std::getline(lines, line);
    if (line.substr(0, line.find_first_not_of(" \t")).find('\t') != std::string::npos)
      return "the line is indented by a tab; use spaces";
  }
  const auto* const known = std::ranges::find_if(
      kExplanations, [&](const Explanation& e) { return e.first == error.msg; });
  return known != kExplanations.end()
             ? std::string(known->second)
             : error.msg + "; check indentation, quotes, brackets and the space after each colon";
}

}  // namespace

YamlFile YamlFile::read(const std::filesystem::path& path) {
  return parse(read_bytes(path, kLargestYaml), path.string());
}

YamlFile YamlFile::parse(std::string_view text, std::string name) {
  YamlFile file;
  file.name_ = std::move(name);
  try {
    const std::string whole(text);
    check_documents(whole, file.name_);
    file.root_.reset(YAML::Load(whole));
  } catch (const YAML::Exception& error) {
    const bool has_line = !error.mark.is_null() && !file.name_.starts_with("--");
    const std::string line = has_line ? ":" + std::to_string(error.mark.line + 1) : "";
    throw InputError(file.name_ + line + ": is not YAML: " + explain(error, std::string(text)));
  }
  return file;
}

std::string YamlFile::at(const YAML::Node& node) const {
  const YAML::Mark mark = node.IsDefined() ? node.Mark() : YAML::Mark::null_mark();
  return mark.is_null() ? name_ : name_ + ":" + std::to_string(mark.line + 1);
}

void YamlFile::fail(const YAML::Node& node, const std::string& message) const {
  throw InputError(at(node) + ": " + message);
}

void YamlFile::check_keys(const YAML::Node& map, const std::string& what,
                          const std::vector<std::string>& known) const {
  if (!map.IsMap())
    fail(map, what + " is not a group of keys; write `key: value`, with a space after the colon");
  std::vector<std::string> seen;
  for (const auto& item : map) {
    if (!item.first.IsScalar())
      fail(item.first, what + " has a list or a group as a key; write `key: value`");
    const std::string& key = item.first.Scalar();
    if (std::ranges::find(known, key) == known.end())
      fail(item.first, "{} has the unknown key \"{}\"{}", what, shown(key),
           did_you_mean(key, known));
    if (std::ranges::find(seen, key) != seen.end())
      fail(item.first, "{} has the key \"{}\" twice; remove one", what, key);
    seen.push_back(key);
  }
}

double YamlFile::number(const YAML::Node& node, const std::string& field) const {
  double value = 0;
  if (!node.IsScalar() || !parse_whole(node.Scalar(), &value) || !std::isfinite(value))
    fail(node, field + is_value(node) + ", not a finite number");
  return value;
}

std::int64_t YamlFile::integer(const YAML::Node& node, const std::string& field, std::int64_t least,
                               std::int64_t most) const {
  std::int64_t value = 0;
  if (!node.IsScalar() || !parse_whole(node.Scalar(), &value))
    fail(node, field + is_value(node) + ", not an integer");
  if (value < least || value > most)
    fail(node, "{} is {}; it must be in {} … {}", field, value, least, most);
  return value;
}

std::string YamlFile::text(const YAML::Node& node, const std::string& field) const {
  if (node.IsNull()) return {};
  if (!node.IsScalar())
    fail(node, field + " is not a text; a list or a group is not possible here");
  return node.Scalar();
}

std::vector<double> YamlFile::numbers(const YAML::Node& node, const std::string& field,
                                      std::size_t least, std::size_t most) const {
  const std::string requested =
      least == most ? std::to_string(least) : fmt::format("{} to {}", least, most);
  if (!node.IsSequence()) fail(node, "{} is not a list of {} numbers", field, requested);
  if (node.size() < least || node.size() > most)
    fail(node, "{} has {} numbers; it needs {}", field, node.size(), requested);
  std::vector<double> values;
  values.reserve(node.size());
  for (const auto& item : node) values.push_back(number(item, field));
  return values;
}

std::string double_quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\')
      out += std::string("\\") + c;
    else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      out += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    else
      out += c;
  }
  return out + "\"";
}

std::string yaml_scalar(const std::string& text) {
  const auto is_plain = [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.';
  };
  const bool letter_first =
      !text.empty() && std::isalpha(static_cast<unsigned char>(text.front())) != 0;
  // YAML 1.1 reads `yes`, `off` and the like as booleans.
  bool flag = false;
  const bool other =
      YAML::convert<bool>::decode(YAML::Node(text), flag) || YAML::IsNullString(text);
  return letter_first && std::ranges::all_of(text, is_plain) && !other ? text : double_quoted(text);
}

}  // namespace vergence::app
