#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <yaml-cpp/node/node.h>

namespace vergence::app {

/// One YAML document from outside, and the messages about it.
///
/// Errors  InputError with file:line: not readable, larger than kLargestYaml, not YAML, more than
///         one document.
class YamlFile {
 public:
  [[nodiscard]] static YamlFile read(const std::filesystem::path& path);
  /// `name` stands for the file in error messages.
  [[nodiscard]] static YamlFile parse(std::string_view text, std::string name);

  /// Null for an empty file.
  [[nodiscard]] const YAML::Node& root() const noexcept { return root_; }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  /// `file:line` of a node, lines from 1; the file alone where the node has no place.
  [[nodiscard]] std::string at(const YAML::Node& node) const;
  /// Throws InputError: `file:line: message`.
  [[noreturn]] void fail(const YAML::Node& node, const std::string& message) const;

  /// Refuses what is no map, a key that is given twice and a key that is not known, naming the
  /// nearest known one. `what` says whose keys they are: `camera 1`.
  void check_keys(const YAML::Node& map, const std::string& what,
                  const std::vector<std::string>& known) const;

  // The value of a node; `field` names it in the message when it is no such thing.
  [[nodiscard]] double number(const YAML::Node& node, const std::string& field) const;  // finite
  [[nodiscard]] std::int64_t integer(const YAML::Node& node, const std::string& field,
                                     std::int64_t least, std::int64_t most) const;
  [[nodiscard]] std::string text(const YAML::Node& node, const std::string& field) const;
  /// A list of finite numbers whose count is in [least, most].
  [[nodiscard]] std::vector<double> numbers(const YAML::Node& node, const std::string& field,
                                            std::size_t least, std::size_t most) const;

 private:
  YAML::Node root_;
  std::string name_;
};

inline constexpr std::uintmax_t kLargestYaml =
    1U << 20;  // bytes: hundreds of times a long configuration

/// A text in double quotes, whatever is in it.
[[nodiscard]] std::string double_quoted(std::string_view text);

}  // namespace vergence::app
