#pragma once
#include <cstdio>
#include <cstdlib>

namespace vergence::test {

/// Aborts with a message unless a property holds that must hold for any bytes.
inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "broken: %s\n", what);
  std::abort();
}

}  // namespace vergence::test
