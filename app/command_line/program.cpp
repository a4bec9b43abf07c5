#include "app/command_line/program.hpp"

#include <sys/resource.h>

#include <cstdio>
#include <exception>
#include <iostream>

#include "app/runtime/nearest.hpp"
#include "app/runtime/terminal_text.hpp"
#include "app/runtime/version.hpp"
#include "core/features/simd_target.hpp"

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

namespace vergence::app {
namespace {

/// One message on one line of stderr. Words of the user's may stand in it: nothing in them may
/// steer a terminal.
void print_error(const std::string& message) {
  std::cerr << "vergence: " << harmless(message) << '\n';
}

std::vector<std::string> command_names(CLI::App& root) {
  std::vector<std::string> words;
  for (const CLI::App* command : root.get_subcommands({})) words.push_back(command->get_name());
  return words;
}

std::vector<std::string> option_names(CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

/// The words of a command: `calibrate target`; of the program: none.
std::string full_name(const CLI::App& command) {
  std::string words;
  for (const CLI::App* c = &command; c->get_parent() != nullptr; c = c->get_parent())
    words = c->get_name() + (words.empty() ? "" : " ") + words;
  return words;
}

/// The command that the words given name; of one with subcommands, the one before the first words
/// that it does not know.
CLI::App& named_command(CLI::App& root) {
  CLI::App* command = &root;
  while (command->remaining().empty() && !command->get_subcommands().empty())
    command = command->get_subcommands().front();
  return *command;
}

/// CLI11's errors about a command line, as one message.
std::string error_message(const CLI::ParseError& error, CLI::App& root) {
  CLI::App& command = named_command(root);
  const std::string words = full_name(command), who = words.empty() ? "" : words + ": ";
  const std::string hint = " (see 'vergence" + (words.empty() ? "" : " " + words) + " --help')";
  // Unknown arguments are reported first: this is often why something else seems to be missing.
  const auto extras = command.remaining();
  if (extras.empty()) return who + error.what() + hint;
  const auto is_option = [](const std::string& word) {
    return word.size() > 1 && word.front() == '-';
  };
  const auto message = [&](const std::string& word, const std::string& why) {
    const std::string name = word.substr(0, word.find('='));
    return who + (is_option(word) ? "unknown option " : "unexpected argument ") + "\"" + name +
           "\"" + why + hint;
  };
  // An option of an earlier version explains the other words.
  for (const bool options : {true, false})
    for (const std::string& word : extras) {
      if (is_option(word) != options) continue;
      std::string why = options ? "" : did_you_mean(word, command_names(command));
      if (why.empty())
        why = new_name(Renamed::Kind::option,
                       words + " " + (options ? word.substr(0, word.find('=')) : "CONFIG"));
      if (!why.empty()) return message(word, why);
    }
  const std::string& first = extras.front();
  return message(first, is_option(first)
                            ? did_you_mean(first.substr(0, first.find('=')), option_names(command))
                            : "");
}

/// A first word that is no command is answered here: CLI11 would only call it unexpected.
void check_command(CLI::App& root, int argc, const char* const* argv) {
  if (argc < 2) throw InputError("no command is given; 'vergence --help' lists the commands");
  const std::string argument = argv[1];
  if (!argument.empty() && argument.front() == '-') return;
  const std::vector<std::string> words = command_names(root);
  if (std::ranges::find(words, argument) != words.end()) return;
  throw InputError("unknown command \"" + argument + "\"" + did_you_mean(argument, words) +
                   " ('vergence --help' lists the commands)");
}

ExitCode parse_and_run(int argc, const char* const* argv, AddCommands add_commands) {
  CLI::App root("Stereo visual odometry with online calibration", "vergence");
  ExitCode exit_code = ExitCode::done;
  root.set_version_flag("--version",
                        "vergence " + std::string(version()) + ", " + features::simd_target());
  root.require_subcommand(1);
  root.footer(
      "Start: vergence replay FOLDER --out DIR. 'vergence COMMAND --help' has options, an example "
      "and\n"
      "exit codes.");
  add_commands(root, {argv, static_cast<std::size_t>(argc)}, &exit_code);
  check_command(root, argc, argv);
  try {
    root.parse(argc, argv);
  } catch (const CLI::Success& asked) {
    root.exit(asked, std::cout, std::cerr);
    return ExitCode::done;
  } catch (const CLI::ParseError& error) {
    throw InputError(error_message(error, root));
  }
  return exit_code;
}

/// A thread's stack is as large as the limit says, and there is no message after an overflow.
void check_stack() {
  // Minimum in bytes; the program uses less than half of it.
  constexpr rlim_t kMin = rlim_t{1} << 20;
  struct rlimit stack {};
  if (::getrlimit(RLIMIT_STACK, &stack) != 0 || stack.rlim_cur >= kMin) return;
  throw InputError("the stack is limited to " + std::to_string(stack.rlim_cur >> 10U) +
                   " kB, and 1024 are needed: raise the limit (ulimit -s)");
}

}  // namespace

ExitCode run_program(int argc, const char* const* argv, AddCommands add_commands) noexcept {
  try {
    check_stack();
    const ExitCode code = parse_and_run(argc, argv, add_commands);
    std::cout.flush();
    if (!std::cout)
      throw InputError("standard output cannot be written; check the free space of the disk");
    return code;
  } catch (const InputError& error) {
    print_error(error.what());
  } catch (const std::invalid_argument& error) {
    // The core rejects inconsistent options and rigs by these two.
    print_error(error.what());
  } catch (const std::length_error& error) {
    print_error(error.what());
  } catch (const DeviceError& error) {
    print_error(error.what());
    return ExitCode::device_failed;
  } catch (const std::bad_alloc&) {
    (void)std::fputs(
        "vergence: not enough memory; close other programs or choose smaller capacities\n", stderr);
  } catch (const std::exception& error) {
    print_error(std::string("internal error: ") + error.what() +
                "; please report it with this output");
  }
  return ExitCode::bad_input;
}

}  // namespace vergence::app
