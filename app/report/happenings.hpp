#pragma once
#include <string>

#include "app/report/analysis.hpp"
#include "app/report/session.hpp"

namespace vergence::app::report {

/// What went on in words, for the top of a page whose verdict is not good: of how many frames, from
/// when to when, what was the matter, the most frequent first, and what happened to the
/// calibration. Empty when nothing did.
[[nodiscard]] std::string happenings_table(const Session& session, const Analysis& analysis);

}  // namespace vergence::app::report
