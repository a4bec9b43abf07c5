#include <fstream>
#include <iostream>

#include "app/command_line/common_options.hpp"
#include "app/commands/commands.hpp"
#include "app/devices/inventory_report.hpp"

namespace vergence::app {
namespace {

struct DevicesArguments {
  bool json = false;
  // Path of the configuration; all connected devices are listed if it is empty.
  std::string rig;
  // Path of the rules; `-` is the standard output.
  std::string rules;
};

void write_rules(const std::string& file, const std::string& rules) {
  const std::string kind = std::filesystem::path(file).extension();
  if (kind == ".yaml" || kind == ".yml")
    throw InputError(file +
                     ": is a configuration, and udev rules would overwrite it; pass it with --rig, "
                     "as in vergence devices --rig " +
                     file + " --write-udev");
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  out << rules;
  out.close();
  if (!out)
    throw InputError(file +
                     ": cannot be written; write to standard output and let sudo do it: vergence "
                     "devices --write-udev | sudo tee " +
                     file);
  std::cerr << "vergence: " << file
            << " written; now: sudo udevadm control --reload && sudo udevadm trigger\n";
}

void list(const DevicesArguments& a, bool rules_asked) {
  std::optional<Configuration> drive;
  if (!a.rig.empty()) drive = load_configuration(a.rig, {});
  if (drive && !rules_asked)
    throw InputError("--rig selects the devices of --write-udev; add --write-udev");
  const Machine machine = Machine::here();
  const Inventory inventory = make_inventory(machine, {});
  std::string rules;
  if (rules_asked) rules = udev_rules(drive ? ports_of_rig(inventory, *drive, machine) : inventory);
  const bool to_stdout = a.rules == "-";
  if (rules_asked && !to_stdout) write_rules(a.rules, rules);
  if (a.json)
    std::cout << devices_json(inventory, to_stdout ? rules : "");
  else if (rules_asked && to_stdout)
    std::cout << rules;
  else
    std::cout << devices_text(inventory);
}

}  // namespace

void add_devices(CLI::App& root, ExitCode* exit_code) {
  const auto a = std::make_shared<DevicesArguments>();
  CLI::App* command = root.add_subcommand(
      "devices",
      "List connected cameras, serial ports and trigger boards as configuration snippets");
  command->add_flag("--json", a->json, "Print JSON (docs/deployment.md)");
  CLI::Option* rules = add_option(*command, "--write-udev", a->rules,
                                  "Write udev rules to FILE, or to standard output", "[FILE]")
                           ->expected(0, 1)
                           ->default_str("-");
  add_option(*command, "--rig", a->rig,
             "With --write-udev: only for the devices of this configuration", "CONFIG");
  command->footer(
      "Example: vergence devices --rig rig.yaml --write-udev | sudo tee "
      "/etc/udev/rules.d/98-vergence-rig.rules\n"
      "Exit codes: 0 success; 2 bad arguments or configuration.");
  command->callback([a, rules, exit_code] {
    if (rules->count() > 0 && a->rules.empty()) a->rules = "-";
    list(*a, rules->count() > 0);
    *exit_code = ExitCode::done;
  });
}

}  // namespace vergence::app
