/// Any bytes as a trajectory and as a list of times. Entry point of libFuzzer.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "app/datasets/trajectory_files.hpp"
#include "tests/fuzz/input_errors.hpp"
#include "tests/fuzz/scratch_folder.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace vergence::app;
  static const vergence::test::ScratchFolder folder;
  const auto file = folder.write("t", {reinterpret_cast<const char*>(data), size});
  vergence::test::probe([&] {
    const TrajectoryFile t = read_trajectory_file(file);
    if (t.poses.empty()) std::abort();
    for (std::size_t i = 0; i < t.poses.size(); ++i) {
      if (i > 0 && t.poses[i].stamp <= t.poses[i - 1].stamp) std::abort();
      if (!t.poses[i].T_world_body.R.allFinite()) std::abort();
    }
  });
  vergence::test::probe([&] {
    if (read_times_file(file).lines.empty()) std::abort();
  });
  return 0;
}
