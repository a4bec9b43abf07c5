#pragma once
#include <filesystem>
#include <string>

#include "app/datasets/stereo_sequence.hpp"

namespace vergence::app {

/// A word of --format, or with `auto` what `folder` holds. InputError: none that is known.
[[nodiscard]] SequenceFormat sequence_format(const std::string& word,
                                             const std::filesystem::path& folder);
/// InputError: topics are named, and the format is none of a bag.
void check_topics(SequenceFormat format, const BagTopics& topics);

}  // namespace vergence::app
