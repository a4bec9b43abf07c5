#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "app/config/configuration.hpp"

namespace vergence::app {

enum class KeyType : std::uint8_t { integer, number, text };

using KeyValue = std::variant<std::int64_t, double, std::string>;  // by KeyType, in its order

/// One key of the configuration: what the parser checks, the hash covers and docs/configuration.md
/// shows.
struct Key {
  std::string name;  // dotted: odometry.features
  KeyType type = KeyType::integer;
  std::string unit;            // empty: none
  double least = 0, most = 0;  // both allowed; of a text: its length in bytes
  std::string meaning;         // one message for a person who has never seen the key
  std::function<void(Configuration&, const KeyValue&)> set;
  std::function<KeyValue(const Configuration&)> get;
  std::vector<std::string> words{};  // of a text that is one of a few; empty: any
};

/// A group of keys (the part of the name before the first dot), or the keys without a group (empty
/// name).
struct Group {
  std::string name;
  std::string meaning;
  std::vector<Key> keys;
  std::string list{};  // `cameras.`: keys go on with the item's number; the documentation shows
                       // item 0 as N. Empty: no list
};

/// All groups in the order of the documentation. A new group is a member of Configuration and a
/// table in one of schema_*.cpp.
[[nodiscard]] const std::vector<Group>& schema();

/// Finds contradictions that no single row shows (two keys that contradict each other, one that
/// would be ignored): the message, empty if valid.
[[nodiscard]] std::string find_contradiction(const Configuration& configuration);

/// The shortest text that reads back as the same value.
[[nodiscard]] std::string to_text(const KeyValue& value);
/// `50 … 1000`, `hold, estimate`.
[[nodiscard]] std::string range_text(const Key& key);

/// docs/configuration.md, from the table.
[[nodiscard]] std::string configuration_document();

}  // namespace vergence::app
