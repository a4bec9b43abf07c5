#pragma once
#include <filesystem>
#include <string>

#include "app/datasets/stereo_sequence.hpp"

namespace vergence::app {

/// Format by a value of --format or, with `auto`, by the content of `folder`. Throws InputError if
/// unknown.
[[nodiscard]] SequenceFormat sequence_format(const std::string& word,
                                             const std::filesystem::path& folder);
/// Throws InputError if topics are named but the format is not a bag.
void check_topics(SequenceFormat format, const BagTopics& topics);

}  // namespace vergence::app
