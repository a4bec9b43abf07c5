#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "drivers/options/gige_options.hpp"
#include "drivers/options/iidc_options.hpp"
#include "drivers/options/option_table.hpp"
#include "drivers/options/v4l2_options.hpp"

namespace vergence {

/// Options of one kind of camera, in that kind's own type; monostate: as it begins.
///
///     CameraConfiguration c;
///     c.options = gige::Options{.packet_size = 9000};
///
/// Threads  Values. Memory: ordinary. Errors: statuses; the message is made where the text came
///          from.
using CameraOptions = std::variant<std::monostate, gige::Options, iidc::Options, v4l2::Options>;

/// The options that cameras of a driver (`gige`, `iidc-usb`, …) begin with. Nothing: its cameras
/// have none.
[[nodiscard]] std::optional<CameraOptions> default_options(std::string_view driver);

/// Sets one from its text. False: there is no option of that name, or it does not take that value
/// (find_option()); *options is as it was.
[[nodiscard]] bool set_option(std::string_view name, std::string_view text, CameraOptions* options);

/// Rows of the kind that `options` holds; empty without a kind.
[[nodiscard]] const std::vector<OptionRow>& option_rows(const CameraOptions& options);
/// The row of a name; null: there is none.
[[nodiscard]] const OptionRow* find_option(const CameraOptions& options, std::string_view name);
/// `NAME=VALUE …` of those that are not as they begin, by name: equal options, equal text.
[[nodiscard]] std::string options_text(const CameraOptions& options);

/// Reads a driver's own options from a configuration and checks them. Without a kind they are as
/// they begin.
///
/// False: *error says which option cannot be, or that they are of another kind of camera; *options
/// is as it was. `cameras`: who they should be for, `GigE cameras`.
template <class Options>
[[nodiscard]] bool parse_options(const CameraOptions& given, const OptionTable<Options>& table,
                                 const char* cameras, Options* options, std::string* error) {
  if (std::holds_alternative<std::monostate>(given)) {
    *options = {};
    return true;
  }
  const auto* own = std::get_if<Options>(&given);
  if (own == nullptr) {
    *error = std::string("these options are of another kind of camera; these are ") + cameras;
    return false;
  }
  if (const OptionRow* row = table.find_impossible(*own); row != nullptr) {
    *error = "the option " + row->name + " takes " + row->values;
    return false;
  }
  *options = *own;
  return true;
}

}  // namespace vergence
