#pragma once
#include <cerrno>

namespace vergence::app {

/// Whether a disk that said so may take files later: it is full, read-only or does not answer.
[[nodiscard]] inline bool disk_is_away(int error) noexcept {
  return error == ENOSPC || error == EDQUOT || error == EROFS || error == EIO;
}

}  // namespace vergence::app
