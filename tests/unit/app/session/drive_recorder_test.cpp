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
      PoseSample sample;
      sample.frame = number_++;
      sample.stamp = frame.stamp;
      sample.status = PoseStatus::ok;
      recorder_.on_frame(frame);
      recorder_.on_pose(sample);
    }
  }
  void mark() {
    EventRecord event;
    event.stamp = stamp();
    event.kind = "mark";
    recorder_.on_event(event);
  }
  [[nodiscard]] DriveRecorder& recorder() { return recorder_; }
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

// The queues are as large as the time asked for needs.
TEST(DriveRecorder, allOfTheTimeBeforeAnEventIsKept) {
  constexpr int kKept = 20 * 300;
  RecordedPoses drive({"record=[poses]", "record.event_window_s=300"});
  drive.drive(kKept + 100);
  drive.mark();
  drive.drive(1);
  drive.close();
  EXPECT_GE(drive.messages("/vergence/odometry", "drive.mcap"), kKept);
}

TEST(DriveRecorder, whatIsKeptAroundAnEventSaysWhereTheCamerasAre) {
  RecordedPoses drive({"record=[poses]", "record.event_window_s=3"});
  drive.drive(200);                    // 10 s
  std::this_thread::sleep_for(300ms);  // the writer passes over the first of them
  drive.mark();
  drive.drive(2);
  drive.close();
  EXPECT_GE(drive.rigs("drive.mcap"), 2);
}

}  // namespace
}  // namespace vergence::app
