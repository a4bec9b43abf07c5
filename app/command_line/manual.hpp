#pragma once
#include <string>

#include <CLI/App.hpp>

/// Manual pages and completion from the same declarations that --help prints, so that none of them
/// can lag behind.
namespace vergence::app {

/// A page for man(1), troff with the man macros: of the program with an empty word, else of that
/// command. InputError: no such command.
[[nodiscard]] std::string manual_page(CLI::App& root, const std::string& word);

/// A script for bash: commands, their options; files elsewhere.
[[nodiscard]] std::string bash_completion(CLI::App& root);

/// `manual [COMMAND]` and `completion`.
void add_manual(CLI::App& root);

}  // namespace vergence::app
