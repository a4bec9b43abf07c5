#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <yaml-cpp/node/node.h>

namespace vergence::app {

/// YAML document from outside, and the error messages about it. Throws InputError with file:line if
/// it is unreadable, larger than kLargestYaml, not YAML, or more than one document.
class YamlFile {
 public:
  [[nodiscard]] static YamlFile read(const std::filesystem::path& path);
  /// `name` replaces the file in error messages.
  [[nodiscard]] static YamlFile parse(std::string_view text, std::string name);

  /// Null if the file is empty.
  [[nodiscard]] const YAML::Node& root() const noexcept { return root_; }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  /// Position `file:line` of a node, lines from 1; the file only if the node has no position.
  [[nodiscard]] std::string at(const YAML::Node& node) const;
  /// Throws InputError: `file:line: message`.
  [[noreturn]] void fail(const YAML::Node& node, const std::string& message) const;
  /// Same with a formatted message.
  template <class First, class... Rest>
  [[noreturn]] void fail(const YAML::Node& node, fmt::format_string<First, Rest...> message,
                         First&& first, Rest&&... rest) const {
    fail(node, fmt::format(message, std::forward<First>(first), std::forward<Rest>(rest)...));
  }

  /// Refuses anything but a map, duplicate keys and unknown keys, naming the nearest known one.
  /// `what` names the owner of the keys, such as `camera 1`.
  void check_keys(const YAML::Node& map, const std::string& what,
                  const std::vector<std::string>& known) const;

  // Each returns the value of a node; `field` names it in the error message. Numbers are finite.
  [[nodiscard]] double number(const YAML::Node& node, const std::string& field) const;
  [[nodiscard]] std::int64_t integer(const YAML::Node& node, const std::string& field,
                                     std::int64_t least, std::int64_t most) const;
  [[nodiscard]] std::string text(const YAML::Node& node, const std::string& field) const;
  /// List of finite numbers whose count is in [least, most].
  [[nodiscard]] std::vector<double> numbers(const YAML::Node& node, const std::string& field,
                                            std::size_t least, std::size_t most) const;

 private:
  YAML::Node root_;
  std::string name_;
};

/// In bytes: hundreds of times a long configuration.
inline constexpr std::uintmax_t kLargestYaml = 1U << 20;

/// Encodes any text in double quotes.
[[nodiscard]] std::string double_quoted(std::string_view text);
/// Encodes a text: plain where no reader takes it for another value, else in double quotes.
[[nodiscard]] std::string yaml_scalar(const std::string& text);

}  // namespace vergence::app
