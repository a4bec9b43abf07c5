#pragma once
#include "app/config/configuration.hpp"
#include "app/devices/inventory.hpp"

/// The checks of `vergence doctor`, of the context and of the machine's files.
namespace vergence::app {

enum class FindingState : std::uint8_t {
  ok,
  /// Works, but could be better or safer.
  advice,
  /// A run would fail or lose images.
  problem,
};
[[nodiscard]] const char* to_string(FindingState) noexcept;

struct Finding {
  /// Name, as in docs/deployment.md.
  std::string check;
  FindingState state = FindingState::ok;
  std::string message;
  /// Commands to type, the permanent one last.
  std::vector<std::string> fix;
};

/// True if a driver accesses a device: not empty, `none` or `mock`.
[[nodiscard]] bool is_real_driver(const std::string& driver);

struct CheckContext {
  const Machine& machine;
  const Inventory& inventory;
  /// Null checks only what is plugged in.
  const Configuration* drive = nullptr;
  /// Parent directory of sessions.
  std::filesystem::path out = ".";

  /// Requirements; without a configuration no cameras, INS or trigger.
  [[nodiscard]] const Configuration& needs() const;
};

/// Runs all checks. Devices that are neither present nor required cause no finding. Problems come
/// first, then advice.
[[nodiscard]] std::vector<Finding> run_checks(const CheckContext& context);

/// The found camera that a configuration means: by serial or place; an empty serial is the next
/// that no other entry names. Null: none. One for each camera of the configuration.
[[nodiscard]] std::vector<const DeviceInfo*> match_cameras(const CheckContext& context);

}  // namespace vergence::app
