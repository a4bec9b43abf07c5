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

void declare_also(CLI::App& command, std::optional<std::string>* words) {
  command
      .add_option("--also", *words,
                  "The drive in other forms as well, e.g. kitti,enu,geojson,kml (docs/session.md)")
      ->type_name("WORDS");
}

void declare_image_topics(CLI::App& command, std::string* left, std::string* right) {
  command
      .add_option("--left-topic", *left,
                  "Of a bag: topic of the left images, where names do not say")
      ->type_name("TOPIC");
  command.add_option("--right-topic", *right, "Of a bag: topic of the right images")
      ->type_name("TOPIC");
}

Configuration CommonOptions::configuration(const std::optional<std::filesystem::path>& file) const {
  std::vector<std::string> all = set;
  if (threads) all.push_back("threads=" + std::to_string(*threads));
  if (seed) all.push_back("odometry.seed=" + std::to_string(*seed));
  return load_configuration(file, all);
}

}  // namespace vergence::app
