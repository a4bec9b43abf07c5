#include <gtest/gtest.h>
#include <openssl/evp.h>

#include <array>
#include <map>
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "app/recording/messages.hpp"
#include "app/ros2/dds_node.hpp"

namespace vergence::app::ros2 {
namespace {

/// A type's description as REP 2016 hashes it, and the types that its fields name.
struct Description {
  std::string json;
  std::vector<std::string> parts;
};

Description describe(const std::string& type, const std::string& fields) {
  static const std::map<std::string, int> kIds{
      {"int8", 2},   {"uint8", 3}, {"int16", 4},  {"uint16", 5},   {"int32", 6},
      {"uint32", 7}, {"int64", 8}, {"uint64", 9}, {"float32", 10}, {"float64", 11},
      {"bool", 15},  {"byte", 16}, {"string", 17}};
  Description out;
  std::istringstream lines(fields);
  for (std::string line; std::getline(lines, line) && !line.empty();) {
    std::istringstream words(line);
    std::string kind, name, nested;
    words >> kind >> name;
    int id = 1, capacity = 0, array = 0;
    if (const std::size_t bracket = kind.find('['); bracket != std::string::npos) {
      const std::string size = kind.substr(bracket + 1, kind.size() - bracket - 2);
      array = size.empty() ? 144 : 48;
      capacity = size.empty() ? 0 : std::stoi(size);
      kind.resize(bracket);
    }
    if (const std::size_t slash = kind.find('/'); slash != std::string::npos) {
      nested = kind.substr(0, slash) + "/msg" + kind.substr(slash);
      out.parts.push_back(nested);
    } else {
      id = kIds.at(kind);
    }
    out.json += fmt::format(
        R"({}{{"name": "{}", "type": {{"type_id": {}, "capacity": {}, "string_capacity": 0, "nested_type_name": "{}"}}}})",
        out.json.empty() ? "" : ", ", name, id + array, capacity, nested);
  }
  out.json = fmt::format(R"({{"type_name": "{}", "fields": [{}]}})", type, out.json);
  return out;
}

/// RIHS01 of a type from the definition that recordings hold.
std::string hash_of(RosType type) {
  std::istringstream definition(ros_definition(type));
  std::map<std::string, Description> described;
  std::string name(ros_type_name(type)), fields;
  for (std::string line; std::getline(definition, line);) {
    if (!line.starts_with("=")) {
      fields += line + "\n";
      continue;
    }
    described[name] = describe(name, fields);
    std::getline(definition, line);
    name = line.substr(5);
    name.insert(name.find('/'), "/msg");
    fields.clear();
  }
  described[name] = describe(name, fields);
  const std::string top(ros_type_name(type));
  std::string parts;
  for (const auto& [part, description] : described)
    if (part != top) parts += (parts.empty() ? "" : ", ") + description.json;
  const std::string text =
      fmt::format(R"({{"type_description": {}, "referenced_type_descriptions": [{}]}})",
                  described.at(top).json, parts);
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  EXPECT_EQ(EVP_Digest(text.data(), text.size(), digest.data(), &size, EVP_sha256(), nullptr), 1);
  return fmt::format("{:02x}", fmt::join(digest.begin(), digest.begin() + size, ""));
}

// Known: std_msgs/msg/String as ROS 2's own recordings have it.
TEST(TypeHash, ofStringIsRos2s) {
  EXPECT_EQ(hash_of(RosType::text),
            "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18");
}

TEST(TypeHash, publishedHashesMatchDefinitions) {
  int published = 0;
  for (int i = 0; i < kRosTypes; ++i) {
    const auto type = static_cast<RosType>(i);
    if (type_hash(type).empty()) continue;
    ++published;
    EXPECT_EQ(hash_of(type), type_hash(type)) << ros_type_name(type);
  }
  EXPECT_EQ(published, 7);
}

}  // namespace
}  // namespace vergence::app::ros2
