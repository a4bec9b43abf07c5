#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/config/yaml_file.hpp"

/// Matrices and keys of other programs' YAML, whose further keys are none of ours.
namespace vergence::app {

/// The value of a key. InputError: `file:line: FIELD is missing`. `field` is the key with what it
/// belongs to: `cam0.intrinsics`.
[[nodiscard]] YAML::Node need(const YamlFile& file, const YAML::Node& map, const std::string& key,
                              const std::string& field);
/// Nothing (undefined) where no key of these is there; the first that is, else.
[[nodiscard]] YAML::Node first_of(const YAML::Node& map, std::span<const char* const> keys,
                                  std::string* found);

/// `{rows: R, cols: C, data: […]}` or a list of R lists of C, row by row. InputError: another size,
/// numbers that are none or not finite.
[[nodiscard]] std::vector<double> read_matrix(const YamlFile& file, const YAML::Node& node,
                                              const std::string& field, std::size_t rows,
                                              std::size_t columns);
/// The same of a row or a column of `least` to `most` numbers.
[[nodiscard]] std::vector<double> read_vector(const YamlFile& file, const YAML::Node& node,
                                              const std::string& field, std::size_t least,
                                              std::size_t most);
/// Width or height, px.
[[nodiscard]] int read_side(const YamlFile& file, const YAML::Node& node, const std::string& field);

/// `[a, b, c]` with as many digits as give the same doubles again.
[[nodiscard]] std::string number_list(std::span<const double> values);

}  // namespace vergence::app
