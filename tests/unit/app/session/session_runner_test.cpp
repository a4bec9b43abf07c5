#include "app/session/session_runner.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "app/session/records.hpp"
#include "core/memory/fixed_vector.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

constexpr int kWidth = 160, kHeight = 120;
constexpr Stamp kStart{1'577'836'800'000'000'000};

Stamp at(int n) { return kStart + Duration::milliseconds(50) * n; }

/// Black images, an event and a frame that cannot be read among them: no pose ever.
class BlackSource final : public FrameSource {
 public:
  explicit BlackSource(int frames) : count_(frames) {
    RigCalibration& rig = facts_.begin.file.rig;
    rig.cameras = 2;
    for (std::size_t k = 0; k < 2; ++k)
      rig.intrinsics[k] = {
          .width = kWidth, .height = kHeight, .fx = 100, .fy = 100, .cx = 79.5, .cy = 59.5};
    rig.T_camera_left[1].t = {-0.5, 0, 0};
    rig.baseline = 0.5;
    facts_.begin.nominal = rig;
    facts_.frames = static_cast<std::uint64_t>(frames);
    facts_.first = at(0);
    facts_.remarks.push_back({"a remark", "data", false});
  }

  [[nodiscard]] const SourceFacts& facts() const noexcept override { return facts_; }
  void start(std::vector<std::string>* /*faults*/) override {}
  [[nodiscard]] bool next(SourceItem* item) noexcept override {
    if (next_ == count_) return false;
    if (next_ == 2 && !noted_) {
      SourceEvent event;
      event.record.stamp = at(2);
      event.record.kind = "image_missing";
      event.record.set_message("it is not there");
      event.skipped = noted_ = true;
      *item = event;
      return true;
    }
    SourceFrame frame;
    frame.rig.number = static_cast<std::uint64_t>(next_);
    frame.rig.stamp = at(next_);
    frame.rig.cameras = 2;
    for (std::size_t k = 0; k < 2; ++k)
      frame.rig.images[k] = {pixels_.data(), kWidth, kHeight, kWidth};
    *item = frame;
    ++next_;
    ++held_;
    return true;
  }
  void done(const PoseSample& /*sample*/) noexcept override { --held_; }
  void stop() noexcept override {}
  void finish(Progress* /*progress*/, std::vector<std::string>* /*faults*/) override {
    ++finished_;
  }
  void describe(const SessionTotals& /*totals*/, const Estimator& /*estimator*/,
                SummaryInput* /*input*/) const override {}
  void print_metrics(const SessionTotals& /*totals*/, const SummaryInput& /*input*/,
                     Progress* /*progress*/) const override {}
  [[nodiscard]] int held() const { return held_; }
  [[nodiscard]] int finished() const { return finished_; }

 private:
  SourceFacts facts_;
  std::vector<std::uint8_t> pixels_ = std::vector<std::uint8_t>(kWidth * kHeight);
  int count_, next_ = 0, held_ = 0, finished_ = 0;
  bool noted_ = false;
};

/// Writes down what it is told, in memory that it has from the start.
class Notebook final : public SessionObserver {
 public:
  void on_frame(const RigFrame& frame) noexcept override {
    (void)lines_.push({'f', frame.stamp});
    images_ += frame.images[0].empty() ? 0 : 1;
  }
  void on_pose(const FrameReport& report) noexcept override {
    (void)lines_.push({'p', report.pose.stamp});
  }
  void on_report(const FrameReport& report) noexcept override {
    (void)lines_.push({'c', report.pose.stamp});
  }
  void on_event(const EventRecord& event) noexcept override {
    const std::string_view kind = event.kind;
    if (kind == "image_missing") (void)lines_.push({'e', event.stamp});
    if (kind == "data") (void)lines_.push({'r', event.stamp});
  }
  void on_calibration(const CalibrationRecord& record) noexcept override {
    (void)lines_.push({'k', record.stamp});
  }

  struct Line {
    char what;
    Stamp stamp;
  };
  [[nodiscard]] std::string order() const {
    std::string text;
    for (const Line& line : lines_) text += line.what;
    return text;
  }
  [[nodiscard]] int images() const { return images_; }

 private:
  FixedVector<Line, 64> lines_;
  int images_ = 0;
};

TEST(SessionRunner, observersSeeFramePoseLineAndFramesAreReleased) {
  const test::TemporaryFolder folder;
  BlackSource source(4);
  Notebook first, second;
  SessionOptions options;
  options.out = folder.path() / "session";
  options.quiet = true;
  options.observers = {&first, &second};
  const SignalGuard signals;
  testing::internal::CaptureStderr();
  (void)run_session(source, load_configuration(std::nullopt, {}), options, signals);
  (void)testing::internal::GetCapturedStderr();
  for (const char* file : {"poses.csv", "events.jsonl", "summary.json", "report.html"})
    EXPECT_TRUE(std::filesystem::exists(options.out / file)) << file;
  // The calibration it begins with and the remark, two frames, the one that is missing, two more.
  EXPECT_EQ(first.order(), "krfpcfpcefpcfpc");
  EXPECT_EQ(second.order(), first.order());
  EXPECT_EQ(first.images(), 4) << "views of pixels, while it is called";
  EXPECT_EQ(source.held(), 0);
  EXPECT_EQ(source.finished(), 1);
}

}  // namespace
}  // namespace vergence::app
