#pragma once
#include <cmath>

#include "core/types/time.hpp"

/// Arithmetic of durations for the synchroniser.
namespace vergence {

[[nodiscard]] inline Duration magnitude(Duration d) noexcept { return d < Duration{} ? -d : d; }

/// `d` times a factor, rounded to a nanosecond.
[[nodiscard]] inline Duration scaled(Duration d, double factor) noexcept {
  return Duration::nanoseconds(std::llround(static_cast<double>(d.ns()) * factor));
}

}  // namespace vergence
