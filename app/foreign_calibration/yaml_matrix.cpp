#include "app/foreign_calibration/yaml_matrix.hpp"

#include <limits>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

namespace vergence::app {
namespace {

std::size_t count(const YamlFile& file, const YAML::Node& node, const std::string& field) {
  constexpr std::int64_t kMost = 1000;
  return static_cast<std::size_t>(file.integer(node, field, 0, kMost));
}

/// The list behind `{rows, cols, data}`, whose sizes must be its own.
YAML::Node data_of(const YamlFile& file, const YAML::Node& node, const std::string& field,
                   std::size_t* rows, std::size_t* columns) {
  *rows = count(file, need(file, node, "rows", field + ".rows"), field + ".rows");
  *columns = count(file, need(file, node, "cols", field + ".cols"), field + ".cols");
  const YAML::Node data = need(file, node, "data", field + ".data");
  if (!data.IsSequence() || data.size() != *rows * *columns)
    file.fail(data,
              fmt::format("{}.data is not a list of {} x {} numbers", field, *rows, *columns));
  return data;
}

}  // namespace

YAML::Node need(const YamlFile& file, const YAML::Node& map, const std::string& key,
                const std::string& field) {
  if (!map.IsMap()) file.fail(map, fmt::format("{} is missing: there is no group of keys", field));
  const YAML::Node node = map[key];
  if (!node) file.fail(map, field + " is missing");
  return node;
}

YAML::Node first_of(const YAML::Node& map, std::span<const char* const> keys, std::string* found) {
  for (const char* key : keys)
    if (const YAML::Node node = map[key]) {
      *found = key;
      return node;
    }
  return YAML::Node(YAML::NodeType::Undefined);
}

std::vector<double> read_matrix(const YamlFile& file, const YAML::Node& node,
                                const std::string& field, std::size_t rows, std::size_t columns) {
  const auto wrong = [&] {
    file.fail(node, fmt::format("{} is not a matrix of {} x {} numbers", field, rows, columns));
  };
  if (node.IsMap()) {
    std::size_t r = 0, c = 0;
    const YAML::Node data = data_of(file, node, field, &r, &c);
    if (r != rows || c != columns)
      file.fail(node, fmt::format("{} is {} x {}; it needs {} x {}", field, r, c, rows, columns));
    return file.numbers(data, field + ".data", rows * columns, rows * columns);
  }
  if (!node.IsSequence() || node.size() != rows) wrong();
  std::vector<double> values;
  for (const auto& row : node) {
    if (!row.IsSequence() || row.size() != columns) wrong();
    const auto numbers = file.numbers(row, field, columns, columns);
    values.insert(values.end(), numbers.begin(), numbers.end());
  }
  return values;
}

std::vector<double> read_vector(const YamlFile& file, const YAML::Node& node,
                                const std::string& field, std::size_t least, std::size_t most) {
  if (!node.IsMap()) return file.numbers(node, field, least, most);
  std::size_t rows = 0, columns = 0;
  const YAML::Node data = data_of(file, node, field, &rows, &columns);
  if (rows != 1 && columns != 1 && rows * columns != 0)
    file.fail(node,
              fmt::format("{} is {} x {}; it needs to be a row or a column", field, rows, columns));
  return file.numbers(data, field + ".data", least, most);
}

int read_side(const YamlFile& file, const YAML::Node& node, const std::string& field) {
  return static_cast<int>(file.integer(node, field, 1, std::numeric_limits<int>::max()));
}

std::string number_list(std::span<const double> values) {
  return fmt::format("[{}]", fmt::join(values, ", "));
}

}  // namespace vergence::app
