#pragma once

#include "tests/support/temporary_folder.hpp"

namespace vergence::test {

/// A folder of this process in memory: what is read by path is written there, run after run.
struct ScratchFolder : TemporaryFolder {
  ScratchFolder()
      : TemporaryFolder(std::filesystem::is_directory("/dev/shm")
                            ? "/dev/shm"
                            : std::filesystem::temp_directory_path()) {}
};

}  // namespace vergence::test
