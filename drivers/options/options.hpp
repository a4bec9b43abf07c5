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

/// Options of one kind of camera in its own type; monostate stands for the defaults.
///
///     CameraConfiguration c;
///     c.options = gige::Options{.packet_size = 9000};
using CameraOptions = std::variant<std::monostate, gige::Options, iidc::Options, v4l2::Options>;

/// Default options of a driver's cameras (`gige`, `iidc-usb`, …); empty if they have no options.
[[nodiscard]] std::optional<CameraOptions> default_options(std::string_view driver);

/// Sets an option from its text. Returns false, with *options unchanged, for an unknown name or an
/// invalid value (find_option()).
[[nodiscard]] bool set_option(std::string_view name, std::string_view text, CameraOptions* options);

/// Rows of the kind in `options`; empty without a kind.
[[nodiscard]] const std::vector<OptionRow>& option_rows(const CameraOptions& options);
/// Row of an option; null if there is none.
[[nodiscard]] const OptionRow* find_option(const CameraOptions& options, std::string_view name);
/// Options that differ from their defaults as `NAME=VALUE …`, sorted by name; equal options give
/// equal text.
[[nodiscard]] std::string options_text(const CameraOptions& options);

/// Extracts a driver's own options from a configuration and validates them; without a kind returns
/// the defaults. If false, *error names the invalid option or the wrong kind of camera, and
/// *options is unchanged. `cameras` names the kind in messages, as in `GigE cameras`.
template <class Options>
[[nodiscard]] bool parse_options(const CameraOptions& given, const OptionTable<Options>& table,
                                 const char* cameras, Options* options, std::string* error) {
  if (std::holds_alternative<std::monostate>(given)) {
    *options = {};
    return true;
  }
  const auto* own = std::get_if<Options>(&given);
  if (own == nullptr) {
    *error =
        std::string("these options are for another kind of camera; these cameras are ") + cameras;
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
