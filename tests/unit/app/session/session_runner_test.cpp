#include "app/session/session_runner.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "app/session/records.hpp"
#include "core/memory/fixed_vector.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/session/waiting_source.hpp"

namespace vergence::app {
namespace {

constexpr int kWidth = 160, kHeight = 120;
constexpr Stamp kStart{1'577'836'800'000'000'000};

Stamp at(int n) { return kStart + Duration::milliseconds(50) * n; }

/// Black images, an event and a frame that cannot be read among them: no pose ever.
class BlackSource final : public test::WaitingSource {
 public:
  explicit BlackSource(int frames) : WaitingSource(Milliseconds(0)), count_(frames) {
    facts_.frames = static_cast<std::uint64_t>(frames);
    facts_.first = at(0);
    facts_.remarks.push_back({"a remark", "data", false});
  }

  [[nodiscard]] bool next(SourceItem* item) noexcept override {
    if (next_ == count_) return false;
    if (next_ == 2 && !noted_) {
      SourceEvent event;
      event.record.stamp = at(2);
      event.record.kind = "image_missing";
      event.record.set_sentence("it is not there");
      event.skipped = noted_ = true;
      *item = event;
      return true;
    }
    *item = black_frame(static_cast<std::uint64_t>(next_), at(next_));
    ++next_;
    ++held_;
    return true;
  }
  void done(const PoseSample& /*sample*/) noexcept override { --held_; }
  void finish(Progress* /*progress*/, std::vector<std::string>* /*faults*/) override {
    ++finished_;
  }
  [[nodiscard]] int held() const { return held_; }
  [[nodiscard]] int finished() const { return finished_; }

 private:
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
  void on_pose(const PoseSample& sample) noexcept override {
    (void)lines_.push({'p', sample.stamp});
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

TEST(SessionRunner, ObserversSeeFramePoseAndLineInTurnAndFramesGoBack) {
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

/// Asks for everything with the first frame, as a viewer of a live page would.
class Asking final : public SessionObserver {
 public:
  explicit Asking(SessionRequests* requests) : requests_(requests) {}
  void on_start(const SessionStart& start) noexcept override { start_ = start; }
  void on_frame(const RigFrame& /*frame*/) noexcept override {
    if (frames_++ == 0) requests_->recalibrate = requests_->mark = requests_->stop_recording = true;
  }
  void on_event(const EventRecord& event) noexcept override {
    marks_ += std::string_view(event.kind) == "mark" ? 1 : 0;
    others_ += std::string_view(event.kind) == "recalibration_requested" ||
                       std::string_view(event.kind) == "recording_stopped"
                   ? 1
                   : 0;
  }
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() override {
    return {{"asked", 17}};
  }

  SessionStart start_{};
  int frames_ = 0, marks_ = 0, others_ = 0;

 private:
  SessionRequests* requests_;
};

TEST(SessionRunner, whatAnObserverAsksForActsOnceWhereTheSessionCanAndItsCountersAreInTheSummary) {
  const test::TemporaryFolder folder;
  BlackSource source(4);
  SessionRequests requests;
  Asking asking(&requests);
  SessionOptions options;
  options.out = folder.path() / "session";
  options.quiet = true;
  options.observers = {&asking};
  options.requests = &requests;
  const SignalGuard signals;
  testing::internal::CaptureStderr();
  (void)run_session(source, load_configuration(std::nullopt, {}), options, signals);
  (void)testing::internal::GetCapturedStderr();
  EXPECT_EQ(asking.start_.name, "session");
  EXPECT_EQ(asking.start_.first, at(0));
  EXPECT_EQ(asking.start_.image_bytes, static_cast<std::size_t>(kWidth * kHeight));
  EXPECT_FALSE(asking.start_.tie.has_value()) << "no clock of this machine's";
  EXPECT_EQ(asking.marks_, 1);
  EXPECT_EQ(asking.others_, 0) << "this source does not recalibrate on request, nothing records";
  std::ifstream in(options.out / "summary.json");
  const std::string summary(std::istreambuf_iterator<char>(in), {});
  EXPECT_NE(summary.find("\"asked\": 17"), std::string::npos);
}

}  // namespace
}  // namespace vergence::app
