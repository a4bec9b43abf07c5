#include "app/session/drive_recorder.hpp"

#include <algorithm>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/recording_reader.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/session/recorder_inputs.hpp"

namespace vergence::app {
namespace {

using namespace std::chrono_literals;

struct IdleSolver final : BackgroundRunner {
  void start(TaskRef task) noexcept override { task(); }
  [[nodiscard]] bool busy() noexcept override { return false; }
  void wait() noexcept override {}
};

/// A recording of poses of a calibrated pair, 50 ms apart.
class RecordedPoses {
 public:
  explicit RecordedPoses(const std::vector<std::string>& settings)
      : configuration_(load_configuration(std::nullopt, settings)),
        recorder_(folder_.path(), configuration_, facts_, watch_) {}

  void drive(int frames) {
    for (int i = 0; i < frames; ++i) {
      RigFrame frame;
      frame.number = number_;
      frame.stamp = stamp();
      frame.cameras = 2;
      FrameReport report;
      report.pose.frame = number_++;
      report.pose.stamp = frame.stamp;
      report.pose.status = PoseStatus::ok;
      recorder_.on_frame(frame);
      recorder_.on_pose(report);
    }
  }
  void close() {
    std::vector<std::string> faults;
    recorder_.close(&faults);
    EXPECT_TRUE(faults.empty());
  }
  /// Messages of a topic in a file; none where it is not there.
  [[nodiscard]] std::ptrdiff_t messages(const std::string& topic, const std::string& file) const {
    if (!std::filesystem::exists(folder_ / file)) return 0;
    const auto all = test::read_mcap(folder_ / file).messages;
    return std::count_if(all.begin(), all.end(),
                         [&](const test::ReadMessage& m) { return m.topic == topic; });
  }
  [[nodiscard]] std::ptrdiff_t rigs(const std::string& file) const {
    return messages("/tf_static", file);
  }

 private:
  [[nodiscard]] Stamp stamp() const {
    return Stamp(1'577'836'800'000'000'000) +
           Duration::milliseconds(50) * static_cast<std::int64_t>(number_);
  }
  static SourceFacts calibrated_pair() {
    SourceFacts facts;
    facts.begin.file.rig = facts.begin.nominal = two_cameras();
    return facts;
  }

  test::TemporaryFolder folder_;
  IdleSolver solver_;
  ReplayableSolverRunner watch_{solver_};
  SourceFacts facts_ = calibrated_pair();
  Configuration configuration_;
  DriveRecorder recorder_;
  std::uint64_t number_ = 0;
};

TEST(DriveRecorder, everyFileSaysWhereTheCamerasAre) {
  RecordedPoses drive({"record=[poses]", "record.split_mb=1"});
  for (int i = 0; i < 100 && drive.rigs("drive_1.mcap") == 0; ++i) {
    drive.drive(100);
    std::this_thread::sleep_for(100ms);
  }
  drive.close();
  EXPECT_EQ(drive.rigs("drive_0.mcap"), 1);
  EXPECT_EQ(drive.rigs("drive_1.mcap"), 1);
}

}  // namespace
}  // namespace vergence::app
