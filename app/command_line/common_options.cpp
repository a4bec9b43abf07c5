#include "app/command_line/common_options.hpp"

namespace vergence::app {

void CommonOptions::declare(CLI::App& command) {
  command
      .add_option("--set", set,
                  "Set a key of the configuration (docs/configuration.md); as often as needed")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);  // one argument each: the next word is not another KEY=VALUE
  command
      .add_option("--threads", threads, "Threads of the estimator, 1 or 2; the poses are the same")
      ->type_name("N");
  command.add_option("--seed", seed, "Seed of the random sampling; same seed, same poses")
      ->type_name("N");
  command.add_flag("--quiet", quiet, "No progress line");
}

void declare_session_options(CLI::App& command, bool* memory, bool* page) {
  command.add_flag("--print-memory", *memory, "Print what memory is held, by whom");
  command.add_flag("--live-page", *page,
                   "Show the session on a page in a browser: publish.http, 127.0.0.1:8080 unless "
                   "the configuration says otherwise");
}

void declare_image_topics(CLI::App& command, std::string* left, std::string* right) {
  command
      .add_option("--left-topic", *left,
                  "Of a bag: topic of the left images, where names do not say")
      ->type_name("TOPIC");
  command.add_option("--right-topic", *right, "Of a bag: topic of the right images")
      ->type_name("TOPIC");
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
