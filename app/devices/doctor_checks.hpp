#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "app/config/configuration.hpp"
#include "app/devices/inventory.hpp"

/// The checks of `vergence doctor`.
namespace vergence::app {

enum class FindingState : std::uint8_t {
  ok,
  advice,   // works, and could be better or surer
  problem,  // a drive would fail, or lose images
};
[[nodiscard]] const char* to_string(FindingState) noexcept;

struct Finding {
  std::string check;  // name, as in docs/deployment.md
  FindingState state = FindingState::ok;
  std::string message;
  std::vector<std::string> fix;  // commands as they are typed, the lasting one last
};

/// Returns true if a driver talks to a device: it is neither empty nor `none` nor `mock`.
[[nodiscard]] bool is_real_driver(const std::string& driver);

struct CheckContext {
  const Machine& machine;
  const Inventory& inventory;
  const Configuration* drive = nullptr;  // null: only what is plugged in is checked
  std::filesystem::path out = ".";       // where sessions go

  /// Requirements where no configuration is given: no cameras, no INS, no trigger.
  [[nodiscard]] const Configuration& needs() const;
};

/// All checks; those about devices that are neither there nor asked for have no finding. Problems
/// first, then advice.
[[nodiscard]] std::vector<Finding> run_checks(const CheckContext& context);

/// The found camera that a configuration means: by serial or place; an empty serial is the next
/// that no other entry names. Null: none. One for each camera of the configuration.
[[nodiscard]] std::vector<const DeviceInfo*> match_cameras(const CheckContext& context);

}  // namespace vergence::app
