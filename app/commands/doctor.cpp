#include <algorithm>
#include <iostream>

#include "app/command_line/common_options.hpp"
#include "app/commands/commands.hpp"
#include "app/devices/inventory_report.hpp"
#include "app/devices/rig_settings.hpp"

namespace vergence::app {
namespace {

struct DoctorArguments {
  std::string configuration, out = ".";
  std::vector<std::string> set;
  bool json = false;
};

ExitCode examine_machine(const DoctorArguments& a) {
  std::optional<Configuration> drive;
  if (!a.configuration.empty()) drive = load_configuration(a.configuration, a.set);
  InventoryOptions options;
  // Without a configuration all drivers are examined.
  for (int k = 0; drive && k < camera_count(*drive); ++k)
    options.drivers.push_back(drive->cameras[static_cast<std::size_t>(k)].driver);
  const Machine machine = Machine::here();
  const Inventory inventory = make_inventory(machine, options);
  const std::vector<Finding> findings =
      run_checks({machine, inventory, drive ? &*drive : nullptr, a.out});
  std::cout << (a.json ? doctor_json(findings) : doctor_text(findings, drive.has_value()));
  const bool any = std::ranges::any_of(
      findings, [](const Finding& f) { return f.state == FindingState::problem; });
  return any ? ExitCode::not_usable : ExitCode::done;
}

}  // namespace

void add_doctor(CLI::App& root, ExitCode* exit_code) {
  const auto a = std::make_shared<DoctorArguments>();
  CLI::App* command = root.add_subcommand(
      "doctor", "Check machine and devices against a configuration and print fixes");
  add_option(*command, "CONFIG", a->configuration,
             "Configuration to check; without it, check what is connected", "FILE");
  add_option(*command, "--set", a->set, "Set a configuration key; repeatable", "KEY=VALUE")
      ->allow_extra_args(false);
  add_option(*command, "--session-dir", a->out, "Check free space in this directory [current]",
             "DIR");
  command->add_flag("--json", a->json, "Print JSON (docs/deployment.md)");
  command->footer(
      "Example: vergence doctor app/config/gige.yaml --session-dir /data\n"
      "Exit codes: 0 no problem; 1 at least one problem; 2 the configuration cannot be read.");
  command->callback([a, exit_code] {
    if (a->configuration.empty() && !a->set.empty())
      throw InputError("--set changes a configuration; name one: vergence doctor CONFIG --set …");
    *exit_code = examine_machine(*a);
  });
}

}  // namespace vergence::app
