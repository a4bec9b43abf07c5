#include "drivers/options/options.hpp"

#include <type_traits>

namespace vergence {
namespace {

const OptionTable<gige::Options>& table_of(const gige::Options&) { return gige::option_table(); }
const OptionTable<iidc::Options>& table_of(const iidc::Options&) { return iidc::option_table(); }
const OptionTable<v4l2::Options>& table_of(const v4l2::Options&) { return v4l2::option_table(); }

/// What `use` gives for the options' kind; `none` where there is no kind.
template <class Variant, class Result, class Use>
Result with_kind(Variant& options, Result none, const Use& use) {
  return std::visit(
      [&](auto& kind) -> Result {
        if constexpr (std::is_same_v<std::decay_t<decltype(kind)>, std::monostate>)
          return none;
        else
          return use(table_of(kind), kind);
      },
      options);
}

}  // namespace

std::optional<CameraOptions> default_options(std::string_view driver) {
  if (driver == "gige") return gige::Options{};
  if (driver == "iidc-usb" || driver == "iidc-1394") return iidc::Options{};
  if (driver == "v4l2") return v4l2::Options{};
  return std::nullopt;
}

bool set_option(std::string_view name, std::string_view text, CameraOptions* options) {
  return with_kind(*options, false,
                   [&](const auto& table, auto& kind) { return table.set(name, text, &kind); });
}

const std::vector<OptionRow>& option_rows(const CameraOptions& options) {
  static const std::vector<OptionRow> none;
  return *with_kind(options, &none, [](const auto& table, const auto&) { return &table.rows(); });
}

const OptionRow* find_option(const CameraOptions& options, std::string_view name) {
  return with_kind(options, static_cast<const OptionRow*>(nullptr),
                   [&](const auto& table, const auto&) { return table.find(name); });
}

std::string options_text(const CameraOptions& options) {
  return with_kind(options, std::string(),
                   [](const auto& table, const auto& kind) { return table.text_of(kind); });
}

}  // namespace vergence
