#include "app/command_line/common_options.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace vergence::app {

const char* const kSessionExitCodes =
    "Exit codes: 0 success; 1 no usable result; 2 bad arguments, configuration or input;\n"
    "3 device missing; 4 session incomplete; 130, 143 stopped by SIGINT, SIGTERM.";

CLI::Validator one_of(std::vector<std::string> values) {
  const std::string list = fmt::format("{}", fmt::join(values, ", "));
  return {[values = std::move(values), list](const std::string& given) {
            return std::ranges::find(values, given) != values.end()
                       ? std::string()
                       : fmt::format("\"{}\" is unknown; use one of {}", given, list);
          },
          "{" + list + "}"};
}

CLI::Validator in_range(double least, double most, const char* unit) {
  return {[=](const std::string& given) {
            double value = 0;
            // Written so that a NaN is refused.
            return CLI::detail::lexical_cast(given, value) && value >= least && value <= most
                       ? std::string()
                       : fmt::format("\"{}\" must be {:g} to {:g} {}", given, least, most, unit);
          },
          ""};
}

void CommonOptions::declare_set(CLI::App& command) {
  // Each --set takes one argument, so that the next word is not read as another KEY=VALUE.
  add_option(command, "--set", set, "Set a configuration key (docs/configuration.md); repeatable",
             "KEY=VALUE")
      ->allow_extra_args(false)
      ->group("Configuration");
}

void CommonOptions::declare_quiet(CLI::App& command) {
  add_flag(command, "--quiet", quiet, "Print no progress line", "Output");
}

void CommonOptions::declare(CLI::App& command) {
  declare_set(command);
  add_option(command, "--threads", threads,
             "Threads of the estimator, 1 or 2; the poses are the same", "N", "Performance")
      ->check(in_range(1, 2, "threads"));
  add_option(command, "--seed", seed,
             "Seed of the random sampling; the same seed gives the same poses", "N", "Performance");
  declare_quiet(command);
}

void declare_session_options(CLI::App& command, bool* memory, bool* page) {
  add_flag(command, "--print-memory", *memory, "Print memory use per component", "Output");
  add_flag(command, "--live-page", *page, "Serve the live page at publish.http [127.0.0.1:8080]",
           "Output");
}

void declare_image_topics(CLI::App& command, std::string* left, std::string* right) {
  add_option(command, "--left-topic", *left, "Bag topic of the left images, if ambiguous", "TOPIC",
             "Input");
  add_option(command, "--right-topic", *right, "Bag topic of the right images, if ambiguous",
             "TOPIC", "Input");
}

Configuration CommonOptions::configuration(const std::optional<std::filesystem::path>& file,
                                           const std::vector<std::string>& before) const {
  std::vector<std::string> all = before;
  all.insert(all.end(), set.begin(), set.end());
  if (threads) all.push_back("threads=" + std::to_string(*threads));
  if (seed) all.push_back("odometry.seed=" + std::to_string(*seed));
  return load_configuration(file, all);
}

}  // namespace vergence::app
