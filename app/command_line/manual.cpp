#include "app/command_line/manual.hpp"

#include <iostream>
#include <iterator>
#include <memory>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "app/runtime/errors.hpp"
#include "app/runtime/version.hpp"

namespace vergence::app {
namespace {

std::vector<CLI::App*> commands_of(CLI::App& root) {
  std::vector<CLI::App*> commands;
  for (CLI::App* command : root.get_subcommands([](CLI::App*) { return true; }))
    commands.push_back(command);
  return commands;
}

/// Text that troff leaves alone: backslashes and dashes escaped, no line that begins as a request.
std::string plain(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n'))
      out += std::string("\\&") + c;
    else
      out += c;
  }
  return out;
}

bool is_flag(const CLI::Option& option) { return option.get_items_expected_max() == 0; }

std::vector<std::string> long_names(CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

/// A paragraph: what is typed, in bold, what stands for it, and what it does.
void describe(const CLI::Option& option, std::string* out) {
  std::string typed;
  for (const std::string& name : option.get_snames())
    typed += (typed.empty() ? "\\-" : ", \\-") + plain(name);
  for (const std::string& name : option.get_lnames())
    typed += (typed.empty() ? "\\-\\-" : ", \\-\\-") + plain(name);
  const bool positional = option.nonpositional() ? false : !option.get_positional();
  if (typed.empty() || positional) typed = plain(option.get_name(true));
  const std::string value = is_flag(option) || option.get_lnames().empty()
                                ? ""
                                : " \\fI" + plain(option.get_type_name()) + "\\fR";
  fmt::format_to(std::back_inserter(*out), ".TP\n\\fB{}\\fR{}\n{}\n", typed, value,
                 plain(option.get_description()));
}

void describe_options(CLI::App& command, std::string* out) {
  *out += ".SH OPTIONS\n";
  for (const CLI::Option* option : command.get_options()) describe(*option, out);
}

constexpr const char* kExit =
    ".SH EXIT STATUS\n.TP\n0\nDone.\n.TP\n1\nDone, but the result is not usable; a sentence says "
    "why.\n.TP\n2\nBad arguments, "
    "configuration or "
    "input; a sentence says what and where.\n.TP\n3\nA device is not "
    "there, or failed and could not be reopened.\n.TP\n4\nDone, but a file of the result is "
    "missing or not whole: the disk is full "
    "or "
    "broken; a sentence says which.\n.TP\n130, 143\nEnded by a signal; the "
    "session "
    "was closed properly.\n";

std::string head(const std::string& name, const std::string& does) {
  std::string title = name;
  for (char& c : title) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  return fmt::format(".TH {} 1 \"\" \"vergence {}\" \"User Commands\"\n.SH NAME\n{} \\- {}\n",
                     plain(title), version(), plain(name), plain(does));
}

}  // namespace

std::string manual_page(CLI::App& root, const std::string& word) {
  if (word.empty()) {
    std::string page =
        head("vergence", root.get_description()) +
        ".SH SYNOPSIS\n\\fBvergence\\fR \\fICOMMAND\\fR [\\fIOPTIONS\\fR]\n.SH COMMANDS\n";
    for (const CLI::App* command : commands_of(root))
      page += fmt::format(".TP\n\\fB{}\\fR\n{}; see vergence\\-{}(1)\n", plain(command->get_name()),
                          plain(command->get_description()), plain(command->get_name()));
    describe_options(root, &page);
    return page + kExit;
  }
  for (CLI::App* command : commands_of(root)) {
    if (command->get_name() != word) continue;
    std::string page = head("vergence-" + word, command->get_description());
    page += fmt::format(".SH SYNOPSIS\n\\fBvergence {}\\fR [\\fIOPTIONS\\fR]", plain(word));
    for (const CLI::Option* option : command->get_options())
      if (option->get_lnames().empty() && option->get_snames().empty())
        page += (option->get_required() ? " \\fI" : " [\\fI") + plain(option->get_name(true)) +
                (option->get_required() ? "\\fR" : "\\fR]");
    page += "\n";
    describe_options(*command, &page);
    return page + kExit + ".SH SEE ALSO\nvergence(1)\n";
  }
  throw InputError("manual: there is no command \"" + word.substr(0, 60) +
                   "\"; 'vergence --help' lists them");
}

std::string bash_completion(CLI::App& root) {
  std::string words, cases;
  for (CLI::App* command : commands_of(root)) {
    words += command->get_name() + " ";
    cases += fmt::format("    {}) options=\"{}\" ;;\n", command->get_name(),
                         fmt::join(long_names(*command), " "));
  }
  words += fmt::format("help version {}", fmt::join(long_names(root), " "));
  return "# bash completion of vergence: source it, or keep it as "
         "/usr/share/bash-completion/completions/vergence\n"
         "_vergence() {\n"
         "  local current=\"${COMP_WORDS[COMP_CWORD]}\" options=\"\"\n"
         "  COMPREPLY=()\n"
         "  if [ \"$COMP_CWORD\" -eq 1 ]; then\n"
         "    COMPREPLY=($(compgen -W \"" +
         words +
         "\" -- \"$current\"))\n"
         "    return\n"
         "  fi\n"
         "  case \"${COMP_WORDS[1]}\" in\n" +
         cases +
         "  esac\n"
         "  case \"$current\" in\n"
         "    -*) COMPREPLY=($(compgen -W \"$options\" -- \"$current\")) ;;\n"
         "  esac\n"
         "}\n"
         "complete -o default -F _vergence vergence\n";
}

void add_manual(CLI::App& root) {
  constexpr const char* kGroup = "For packagers";
  const auto word = std::make_shared<std::string>();
  CLI::App* manual =
      root.add_subcommand("manual", "Print a manual page: of the program, or of a command")
          ->group(kGroup);
  manual->add_option("COMMAND", *word, "Which; the program's own without one");
  manual->callback([&root, word] { std::cout << manual_page(root, *word); });
  root.add_subcommand("completion", "Print the completion of the command line for bash")
      ->group(kGroup)
      ->callback([&root] { std::cout << bash_completion(root); });
}

}  // namespace vergence::app
