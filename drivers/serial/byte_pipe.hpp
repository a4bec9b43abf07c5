#pragma once
#include <memory>
#include <utility>

#include "drivers/serial/byte_line.hpp"

namespace vergence {

/// Two ends of a line within the process, on the real monotonic clock: what one writes the other
/// reads, at once and unaltered. Each direction holds kPipeBytes; a write that does not fit waits,
/// then is a `timeout`. The end of one is `gone` for the other.
inline constexpr std::size_t kPipeBytes = 65536;
[[nodiscard]] std::pair<std::unique_ptr<ByteLine>, std::unique_ptr<ByteLine>> make_byte_pipe();

}  // namespace vergence
