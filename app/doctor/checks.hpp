#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/doctor/inventory.hpp"
#include "app/doctor/machine.hpp"
#include "app/doctor/needs.hpp"

/// What `vergence doctor` looks at. Every check is a function of what it is given and of the
/// machine's files.
namespace vergence::app {

enum class FindingState : std::uint8_t {
  ok,
  advice,   // works, and could be better or surer
  problem,  // a drive would fail, or lose images
};
[[nodiscard]] const char* to_string(FindingState) noexcept;

struct Finding {
  std::string check;  // which, as in docs/doctor.md
  FindingState state = FindingState::ok;
  std::string sentence;
  std::vector<std::string>
      mend;  // commands as they are typed, the lasting one last; empty: none, or nothing to mend
};

/// What the checks look at.
struct CheckContext {
  const Machine& machine;
  const Inventory& inventory;
  const Needs& needs;
  std::filesystem::path out = ".";           // where sessions go
  std::filesystem::path configuration = {};  // the file that `needs` are of; empty: none

  /// The configuration is the service's, which is installed: not this user is to drive with it.
  [[nodiscard]] bool is_of_service() const;
  /// A key of the service, `LimitRTPRIO`, as unit and drop-ins have it; nothing: no word of it.
  [[nodiscard]] std::optional<std::string> service_setting(const std::string& key) const;
};

/// All checks; those about devices that neither are there nor are asked for say nothing. Problems
/// first, then advice, then what is well.
[[nodiscard]] std::vector<Finding> run_checks(const CheckContext& context);

// The checks by what they are about; each appends its findings in any order.
void check_cameras(
    const CheckContext& context,
    std::vector<Finding>* findings);  // asked for and there, permissions, media controllers
void check_network(const CheckContext& context, std::vector<Finding>* findings);  // GigE Vision
void check_usb(const CheckContext& context,
               std::vector<Finding>* findings);  // memory, budget, sleep
void check_firewire(const CheckContext& context, std::vector<Finding>* findings);  // stack, budget
void check_serial(const CheckContext& context,
                  std::vector<Finding>* findings);  // permissions, latency timer, ModemManager
void check_system(const CheckContext& context,
                  std::vector<Finding>* findings);  // limits, governor, clocks, disk

/// The found camera that a configuration means: by serial or place; an empty serial is the next
/// that no other entry names. Null: none. One entry for each of needs.cameras.
[[nodiscard]] std::vector<const FoundCamera*> match_cameras(const CheckContext& context);

}  // namespace vergence::app
