#include "app/command_line/program.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <iostream>
#include <string>
#include <string_view>
#include <vector>

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

std::vector<std::string> command_words(CLI::App& root) {
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

/// The command's own name in a hint: `vergence replay --help`.
std::string help_hint(const CLI::App& command) {
  const std::string word = command.get_parent() == nullptr ? "" : " " + command.get_name();
  return "see 'vergence" + word + " --help'";
}

/// CLI11's errors about a command line, as one message.
std::string sentence_for(const CLI::ParseError& error, CLI::App& root) {
  const auto given = root.get_subcommands();
  CLI::App& command = given.empty() ? root : *given.front();
  const std::string who = given.empty() ? "" : command.get_name() + ": ";
  // Unknown arguments are reported first: this is often why something else seems to be missing.
  if (const auto extras = root.remaining(true); !extras.empty()) {
    const std::string& first = extras.front();
    const std::string name = first.substr(0, first.find('='));
    const bool option = name.size() > 1 && name.front() == '-';
    const std::string why = why_withdrawn(Withdrawn::Kind::option, command.get_name() + " " + name);
    return who + (option ? "unknown option " : "unexpected argument ") + "\"" + name + "\"" +
           (option && why.empty() ? did_you_mean(name, option_names(command)) : why) + " (" +
           help_hint(command) + ")";
  }
  return who + error.what() + " (" + help_hint(command) + ")";
}

/// A first word that is no command is answered here: CLI11 would only call it unexpected.
void check_first_word(CLI::App& root, int argc, const char* const* argv) {
  if (argc < 2) throw InputError("no command given; 'vergence --help' lists them");
  const std::string word = argv[1];
  if (!word.empty() && word.front() == '-') return;
  auto words = command_words(root);
  words.insert(words.end(), {"help", "version"});
  if (std::find(words.begin(), words.end(), word) != words.end()) return;
  const std::string why = why_withdrawn(Withdrawn::Kind::command, word);
  throw InputError("unknown command \"" + word + "\"" +
                   (why.empty() ? did_you_mean(word, words) : why) +
                   " ('vergence --help' lists the commands)");
}

/// `help`, `help COMMAND` and `version` as the options that they stand for.
std::vector<const char*> without_words_for_options(int argc, const char* const* argv) {
  std::vector<const char*> words(argv, argv + argc);
  if (argc < 2) return words;
  const std::string_view first = argv[1];
  if (first == "version") words[1] = "--version";
  if (first != "help") return words;
  words.erase(words.begin() + 1);
  words.resize(std::min<std::size_t>(words.size(), 2));
  words.push_back("--help");
  return words;
}

ExitCode parse_and_run(int given, const char* const* given_argv, AddCommands add_commands) {
  const std::vector<const char*> words = without_words_for_options(given, given_argv);
  const int argc = static_cast<int>(words.size());
  const char* const* argv = words.data();
  CLI::App root("Stereo visual odometry with online calibration", "vergence");
  ExitCode exit_code = ExitCode::done;
  root.set_version_flag("--version",
                        "vergence " + std::string(version()) + ", " + features::simd_target());
  root.require_subcommand(1);
  root.footer(
      "Start: vergence replay FOLDER --out DIR. 'vergence COMMAND --help' has options, an example "
      "and\n"
      "exit codes.");
  add_commands(root, {given_argv, static_cast<std::size_t>(given)}, &exit_code);
  check_first_word(root, argc, argv);
  try {
    root.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    root.exit(asked, std::cout, std::cerr);
    return ExitCode::done;
  } catch (const CLI::ParseError& error) {
    throw InputError(sentence_for(error, root));
  }
  return exit_code;
}

/// A thread's stack is as large as the limit says, and there is no message after an overflow.
void check_stack() {
  constexpr rlim_t kMin = rlim_t{1} << 20;  // bytes; what is used is below half of it
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
    if (!std::cout) throw InputError("standard output cannot be written; is the disk full?");
    return code;
  } catch (const InputError& error) {
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
