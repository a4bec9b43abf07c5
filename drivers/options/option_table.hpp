#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/types/time.hpp"

namespace vergence {

// Syntax of option values.

/// Parses a text that is one finite number.
[[nodiscard]] std::optional<double> parse_number(std::string_view text);
/// Parses on, yes, true; off, no, false.
[[nodiscard]] std::optional<bool> parse_switch(std::string_view text);
/// Shortest text that is parsed as the same number.
[[nodiscard]] std::string shortest_text(double value);

/// Documentation of one option.
struct OptionRow {
  /// Name; `feature.NAME` stands for any name after the dot.
  std::string name;
  /// Unit and permitted values, as in `µs, 0 to 10000` or `on, off`.
  std::string values;
  /// Description of the default; empty if there is none.
  std::string fallback;
  /// Description of the option.
  std::string meaning;
};

/// Options of one kind of camera: a row for each member of the struct `Options`, in the order of
/// the documentation.
///
///     const std::vector<std::pair<std::string, At>> instants{{"start", At::start},
///                                                            {"end", At::end}};
///     static const auto table = OptionTable<Options>()
///         .number("delay_us", &Options::delay, {0, 10000}, "µs", "computed", "Pause …")
///         .choice("stamp_at", &Options::stamp, instants, "start", "Which instant …");
///     Options o;
///     const bool known = table.set("delay_us", "12.5", &o);  // o.delay is 12.5 µs
///
/// A completed table is constant.
template <class Options>
class OptionTable {
 public:
  /// Both ends are permitted. If `step` is not 0, values are multiples of it.
  struct Range {
    double least = 0, most = 0, step = 0;
  };

  /// Adds a member that is a number in the option's unit, a Duration, or an optional of these.
  /// Integral members take whole numbers only. If `fallback` is null, the struct's default is
  /// shown.
  template <class Field>
  OptionTable& number(const char* name, Field Options::*field, Range range, const char* unit,
                      const char* fallback, const char* meaning) {
    std::string values = unit;
    if (!values.empty()) values += ", ";
    values += shortest_text(range.least) + " to " + shortest_text(range.most);
    if (range.step > 0) values += " in steps of " + shortest_text(range.step);
    const double scale = scale_of(unit);
    return add(
        {name, values, "", meaning}, fallback,
        [field, range, scale](std::string_view text, Options* o) {
          const auto v = parse_number(text);
          if (!v || !(*v >= range.least && *v <= range.most)) return false;
          if (range.step > 0 && std::fmod(*v, range.step) != 0) return false;
          return assign(*v, scale, &(o->*field));
        },
        [field, scale](const Options& o) { return format_number(o.*field, scale); });
  }

  /// Adds a member with a few named values.
  template <class Field, class Value>
  OptionTable& choice(const char* name, Field Options::*field,
                      std::vector<std::pair<std::string, Value>> words, const char* fallback,
                      const char* meaning) {
    std::string values;
    for (const auto& word : words) values += (values.empty() ? "" : ", ") + word.first;
    return add(
        {name, values, "", meaning}, fallback,
        [field, words](std::string_view text, Options* o) {
          const auto is = [&](const auto& word) { return word.first == text; };
          const auto word = std::find_if(words.begin(), words.end(), is);
          if (word != words.end()) o->*field = word->second;
          return word != words.end();
        },
        [field, words](const Options& o) -> std::string {
          for (const auto& [word, value] : words)
            if (o.*field == value) return word;
          return {};
        });
  }

  /// Adds a bool or an optional bool.
  template <class Field>
  OptionTable& on_off(const char* name, Field Options::*field, const char* fallback,
                      const char* meaning) {
    return add(
        {name, "on, off", "", meaning}, fallback,
        [field](std::string_view text, Options* o) {
          const std::optional<bool> on = parse_switch(text);
          if (on) o->*field = *on;
          return on.has_value();
        },
        [field](const Options& o) -> std::string {
          const std::optional<bool> on = o.*field;
          return !on ? "" : *on ? "on" : "off";
        });
  }

  /// Adds a name of the device, which must not be empty.
  OptionTable& text(const char* name, std::string Options::*field, const char* values,
                    const char* fallback, const char* meaning) {
    return add(
        {name, values, "", meaning}, fallback,
        [field](std::string_view text, Options* o) {
          if (!text.empty()) o->*field = text;
          return !text.empty();
        },
        [field](const Options& o) { return o.*field; });
  }

  /// Adds all settings of the device by its own names, each an option of `prefix` and name.
  OptionTable& others(const char* prefix,
                      std::vector<std::pair<std::string, std::string>> Options::*field,
                      const char* values, const char* meaning) {
    others_ = Others{prefix, field};
    rows_.push_back({std::string(prefix) + "NAME", values, "", meaning});
    return *this;
  }

  [[nodiscard]] const std::vector<OptionRow>& rows() const noexcept { return rows_; }

  /// Row of an option; null if there is none.
  [[nodiscard]] const OptionRow* find(std::string_view name) const {
    for (const Entry& e : entries_)
      if (rows_[e.row].name == name) return &rows_[e.row];
    return is_other(name) ? &rows_.back() : nullptr;
  }

  /// Sets an option. Returns false, with *options unchanged, for an unknown name or an invalid
  /// value.
  [[nodiscard]] bool set(std::string_view name, std::string_view text, Options* options) const {
    for (const Entry& e : entries_)
      if (rows_[e.row].name == name) return e.set(text, options);
    if (!is_other(name) || text.empty()) return false;
    auto& others = options->*others_->field;
    const std::string own(name.substr(others_->prefix.size()));
    std::erase_if(others, [&own](const auto& given) { return given.first == own; });
    others.emplace_back(own, text);
    return true;
  }

  /// Options that differ from their defaults, sorted by name: `NAME=VALUE …`. Equal options give
  /// equal text.
  [[nodiscard]] std::string to_text(const Options& options) const {
    std::vector<std::string> given;
    const Options begin{};
    for (const Entry& e : entries_)
      if (const std::string value = e.get(options); value != e.get(begin))
        given.push_back(rows_[e.row].name + "=" + value);
    if (others_)
      for (const auto& [name, value] : options.*others_->field)
        given.push_back(others_->prefix + name + "=" + value);
    std::sort(given.begin(), given.end());
    std::string all;
    for (const std::string& one : given) all += (all.empty() ? "" : " ") + one;
    return all;
  }

  /// First option with an invalid value; null if all are valid.
  [[nodiscard]] const OptionRow* find_impossible(const Options& options) const {
    const Options begin{};
    Options copy;
    for (const Entry& e : entries_) {
      const std::string value = e.get(options);
      if (value != e.get(begin) && !e.set(value, &copy)) return &rows_[e.row];
    }
    return nullptr;
  }

 private:
  struct Entry {
    std::size_t row = 0;
    std::function<bool(std::string_view, Options*)> set;
    std::function<std::string(const Options&)> get;
  };
  struct Others {
    std::string prefix;
    std::vector<std::pair<std::string, std::string>> Options::*field;
  };

  template <class Set, class Get>
  OptionTable& add(OptionRow row, const char* fallback, Set set, Get get) {
    row.fallback = fallback != nullptr ? fallback : get(Options{});
    entries_.push_back({rows_.size(), std::move(set), std::move(get)});
    rows_.push_back(std::move(row));
    return *this;
  }

  [[nodiscard]] bool is_other(std::string_view name) const {
    return others_ && name.starts_with(others_->prefix) && name.size() > others_->prefix.size();
  }

  /// Nanoseconds per unit of a Duration.
  static double scale_of(std::string_view unit) { return unit == "ms" ? 1e6 : 1e3; }

  template <class Field>
  static bool assign(double value, double scale, Field* field) {
    if constexpr (std::is_same_v<Field, Duration>) {
      *field = Duration::nanoseconds(std::llround(value * scale));
    } else if constexpr (std::is_integral_v<Field>) {
      if (value != std::floor(value)) return false;
      *field = static_cast<Field>(value);
    } else if constexpr (std::is_floating_point_v<Field>) {
      *field = value;
    } else {
      typename Field::value_type inner{};
      if (!assign(value, scale, &inner)) return false;
      *field = inner;
    }
    return true;
  }

  template <class Field>
  static std::string format_number(const Field& field, double scale) {
    if constexpr (std::is_same_v<Field, Duration>)
      return shortest_text(static_cast<double>(field.ns()) / scale);
    else if constexpr (std::is_arithmetic_v<Field>)
      return shortest_text(static_cast<double>(field));
    else
      return field ? format_number(*field, scale) : std::string();
  }

  std::vector<Entry> entries_;
  std::vector<OptionRow> rows_;
  std::optional<Others> others_;
};

}  // namespace vergence
