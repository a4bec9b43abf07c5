#pragma once
#include <string>

#include "app/recorder/records.hpp"

namespace vergence::app {

/// A line of events.jsonl, end of line included: `stamp_ns`, `kind`, `sentence`, `fields`. Bytes
/// that are no UTF-8, which file names may hold, become U+FFFD: the line stays JSON.
///
/// Memory  None where the capacity of *line is enough.
void format_event(const EventRecord& event, std::string* line);

}  // namespace vergence::app
