#pragma once
#include <functional>
#include <variant>

#include "app/config/configuration.hpp"

namespace vergence::app {

enum class KeyType : std::uint8_t { integer, number, text };

/// Alternatives in the order of KeyType.
using KeyValue = std::variant<std::int64_t, double, std::string>;

/// Key of the configuration, used by the parser, the hash and docs/configuration.md.
struct Key {
  /// Dotted name, such as odometry.features.
  std::string name;
  KeyType type = KeyType::integer;
  /// Empty if there is none.
  std::string unit;
  /// Both are permitted; for a text they limit its length in bytes.
  double least = 0, most = 0;
  /// Description for users who do not know the key.
  std::string meaning;
  std::function<void(Configuration&, const KeyValue&)> set;
  std::function<KeyValue(const Configuration&)> get;
  /// Permitted values of a text; empty if any.
  std::vector<std::string> words{};
};

/// Group of keys (the name before the first dot), or the keys without a group (empty name).
struct Group {
  std::string name;
  std::string meaning{};
  std::vector<Key> keys{};
  /// Prefix such as `cameras.` if keys continue with an item's number, which the documentation
  /// shows as N for item 0. Empty if it is no list.
  std::string list{};
};

/// All groups in the order of the documentation. A new group needs a member of Configuration and a
/// table in a schema_*.cpp.
[[nodiscard]] const std::vector<Group>& schema();

/// Finds contradictions between keys, and keys that would be ignored. Returns a message, empty if
/// valid.
[[nodiscard]] std::string find_contradiction(const Configuration& configuration);

/// Shortest text that is parsed as the same value.
[[nodiscard]] std::string to_text(const KeyValue& value);
/// Range such as `50 … 1000` or `hold, estimate`.
[[nodiscard]] std::string range_text(const Key& key);

/// Text of docs/configuration.md behind its opening.
[[nodiscard]] std::string configuration_tables();

}  // namespace vergence::app
