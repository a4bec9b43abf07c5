#pragma once
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence::test {

namespace fs = std::filesystem;

/// A replay of images of unknown origin.
class QuickStart : public ::testing::Test {
 protected:
  [[nodiscard]] Outcome replay(const fs::path& data, const std::string& more) const {
    return run_vergence("replay '" + data.string() + "' --quiet --out '" + session().string() +
                        "' " + more);
  }
  [[nodiscard]] fs::path session() const { return work_ / "session"; }
  [[nodiscard]] nlohmann::json summary() const {
    return nlohmann::json::parse(read_file(session() / "summary.json"));
  }
  [[nodiscard]] std::string report() const { return read_file(session() / "report.html"); }

  /// A plain folder of the images of two others.
  [[nodiscard]] fs::path plain(const fs::path& left, const fs::path& right,
                               const std::string& times, const std::string& calibration) const {
    const fs::path folder = work_ / "data";
    fs::create_directories(folder);
    fs::create_directory_symlink(left, folder / "left");
    fs::create_directory_symlink(right, folder / "right");
    (void)work_.write("data/times.txt", times);
    (void)work_.write("data/calibration.yaml", calibration);
    return folder;
  }

  TemporaryFolder work_;
};

}  // namespace vergence::test
