#pragma once
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "app/config/calibration_file.hpp"
#include "tests/system/odometry/stereo_drive.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence::test {

namespace fs = std::filesystem;

/// Frames of a straight stretch of 10 m at 9 m/s.
inline constexpr std::size_t kFrames = 24;

inline std::string image_name(int camera, std::size_t pair) {
  return fmt::format("{}/{:03d}.png", camera == 0 ? "left" : "right", pair);
}

/// A rendered sequence in the layout of `--format folder`.
class ReplayedFolder : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    master_ = new TemporaryFolder;
    const StereoDrive drive = render({.rig = distorted_rig(),
                                      .drive = {.kind = mock::DriveKind::brief},
                                      .from_s = 6,
                                      .rate = 20},
                                     kFrames);
    std::string times;
    for (std::size_t i = 0; i < drive.size(); ++i) {
      times += fmt::format("{}\n", drive.stamps[i].ns());
      for (int k = 0; k < 2; ++k) {
        const features::test::Image& p = drive.pairs[i][static_cast<std::size_t>(k)];
        const fs::path file = *master_ / image_name(k, i);
        fs::create_directories(file.parent_path());
        const cv::Mat image(p.height, p.width, CV_8U, const_cast<std::uint8_t*>(p.bytes.data()),
                            static_cast<std::size_t>(p.stride));
        ASSERT_TRUE(cv::imwrite(file.string(), image));
      }
    }
    master_->write("times.txt", times);
    app::CalibrationFile calibration{.rig = drive.rig};
    app::write_calibration(*master_ / "calibration.yaml", calibration);
  }
  static void TearDownTestSuite() { delete master_; }

  /// A copy of the sequence, which a test may change.
  ReplayedFolder() { fs::copy(*master_ / ".", data(), fs::copy_options::recursive); }

  [[nodiscard]] fs::path data() const { return work_ / "data"; }
  [[nodiscard]] fs::path session() const { return work_ / "session"; }
  [[nodiscard]] Outcome replay(const std::string& more = "") const {
    return run_vergence("replay '" + data().string() + "' --format folder --quiet --out '" +
                        session().string() + "' " + more);
  }
  [[nodiscard]] nlohmann::json summary() const {
    return nlohmann::json::parse(read_file(session() / "summary.json"));
  }
  void expect_refused(const std::string& named) const {
    const Outcome o = replay();
    EXPECT_EQ(o.code, 2) << o.err;
    EXPECT_NE(o.err.find(named), std::string::npos) << o.err;
    EXPECT_FALSE(fs::exists(session() / "trajectory.tum"));
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(data() / name, std::ios::binary) << text;
  }

  TemporaryFolder work_;
  static inline TemporaryFolder* master_ = nullptr;
};

}  // namespace vergence::test
