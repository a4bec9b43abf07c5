#pragma once
#include <cstdint>

#include <CLI/App.hpp>

#include "app/config/configuration.hpp"

namespace vergence::app {

/// Options of every command that runs: `--set KEY=VALUE` (repeatable), `--threads N`, `--seed N`,
/// `--quiet`.
struct CommonOptions {
  std::vector<std::string> set{};
  std::optional<int> threads{};
  std::optional<std::uint64_t> seed{};
  bool quiet = false;

  /// Declares the options on a subcommand. This object must outlive the parsing.
  void declare(CLI::App& command);
  /// Declares only `--set`, or only `--quiet`.
  void declare_set(CLI::App& command);
  void declare_quiet(CLI::App& command);
  /// load_configuration() with --threads and --seed as the last --set. `before` has KEY=VALUE that
  /// `set` overrides. Throws InputError.
  [[nodiscard]] Configuration configuration(const std::optional<std::filesystem::path>& file,
                                            const std::vector<std::string>& before = {}) const;
};

/// Declares an option. The help text shows it under the heading `group`, its value as `type`.
template <class Value>
CLI::Option* add_option(CLI::App& command, const char* name, Value& value, const char* help,
                        const char* type, const char* group = "Options") {
  return command.add_option(name, value, help)->type_name(type)->group(group);
}

/// Declares a flag in the same way.
inline CLI::Option* add_flag(CLI::App& command, const char* name, bool& value, const char* help,
                             const char* group = "Options") {
  return command.add_flag(name, value, help)->group(group);
}

/// Accepts one of the values, and names them in the help and in the message for another one.
[[nodiscard]] CLI::Validator one_of(std::vector<std::string> values);

/// Accepts a number from `least` to `most`, both included.
[[nodiscard]] CLI::Validator in_range(double least, double most, const char* unit);

/// Last lines of the help of commands that write a session.
extern const char* const kSessionExitCodes;

/// Adds `--print-memory` and `--live-page` to a command that writes a session.
void declare_session_options(CLI::App& command, bool* memory, bool* page);

/// Adds `--left-topic` and `--right-topic` to a command that reads a bag's images.
void declare_image_topics(CLI::App& command, std::string* left, std::string* right);

}  // namespace vergence::app
