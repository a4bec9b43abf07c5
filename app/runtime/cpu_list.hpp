#pragma once
#include <sched.h>

#include <optional>
#include <string_view>

namespace vergence::app {

/// Processors as taskset(1) has them, `0-1,3`. Nothing: another text, an empty one, or a number
/// beyond CPU_SETSIZE.
[[nodiscard]] std::optional<cpu_set_t> parse_cpu_list(std::string_view text) noexcept;

}  // namespace vergence::app
