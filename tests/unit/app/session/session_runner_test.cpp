#include "app/session/session_runner.hpp"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "app/recorder/pose_line.hpp"
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
  explicit BlackSource(int frames) : frames_(frames), pixels_(kWidth * kHeight) {
    RigCalibration& rig = facts_.begin.file.rig;
    rig.cameras = 2;
    for (std::size_t k = 0; k < 2; ++k) {
      Intrinsics& lens = rig.intrinsics[k];
      lens.width = kWidth, lens.height = kHeight;
      lens.fx = lens.fy = 100;
      lens.cx = (kWidth - 1) / 2.0, lens.cy = (kHeight - 1) / 2.0;
    }
    rig.T_camera_left[1].t = {-0.5, 0, 0};
    rig.baseline = 0.5;
    facts_.begin.nominal = rig;
    facts_.frames = facts_.expected_frames = static_cast<std::uint64_t>(frames);
    facts_.first = at(0);
    facts_.remarks.push_back({"a remark", "data", false});
  }

  [[nodiscard]] const SourceFacts& facts() const noexcept override { return facts_; }
  void start(std::vector<std::string>* /*faults*/) override {
    if (started_) started_();
  }
  void halt() noexcept override { ++halted_; }
  [[nodiscard]] bool next(SourceItem* item) noexcept override {
    if (next_ == frames_) return false;
    if (next_ == 2 && !noted_) {
      SourceEvent event;
      event.record.stamp = at(2);
      event.record.kind = "image_missing";
      event.record.set_sentence("it is not there");
      event.skipped = noted_ = true;
      *item = event;
      return true;
    }
    SourceFrame frame;
    frame.rig.number = static_cast<std::uint64_t>(next_);
    frame.rig.stamp = at(next_++);
    frame.rig.cameras = 2;
    for (std::size_t k = 0; k < 2; ++k)
      frame.rig.images[k] = {pixels_.data(), kWidth, kHeight, kWidth};
    *item = frame;
    ++held_;
    return true;
  }
  void done(const PoseSample& /*sample*/) noexcept override { --held_; }
  void stop() noexcept override { ++stopped_; }
  void finish(Progress* /*progress*/, std::vector<std::string>* /*faults*/) override {
    ++finished_;
  }
  void describe(const SessionTotals& /*totals*/, const Estimator& /*estimator*/,
                SummaryInput* input) const override {
    input->skipped = noted_ ? 1 : 0;
  }
  void print_figures(const SessionTotals& /*totals*/, const SummaryInput& /*input*/,
                     Progress* /*progress*/) const override {}
  [[nodiscard]] std::optional<ExitCode> verdict(Progress* progress) const override {
    progress->say("camera 0 was gone");
    return ExitCode::device_failed;
  }

  void begin_from(const std::string& source) { facts_.begin.source = source; }
  void be_live() { facts_.when_full = Recorder::WhenFull::drop; }
  /// Called when it has started.
  void when_started(std::function<void()> started) { started_ = std::move(started); }
  [[nodiscard]] int held() const { return held_; }
  [[nodiscard]] int finished() const { return finished_; }
  [[nodiscard]] int stopped() const { return stopped_; }
  [[nodiscard]] int halted() const { return halted_; }

 private:
  SourceFacts facts_;
  int frames_, next_ = 0, held_ = 0, finished_ = 0, stopped_ = 0, halted_ = 0;
  std::function<void()> started_;
  bool noted_ = false;
  std::vector<std::uint8_t> pixels_;
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
  void on_compared(const PoseRecord& pose) noexcept override {
    (void)lines_.push({'c', pose.stamp});
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
  [[nodiscard]] const auto& lines() const { return lines_; }
  [[nodiscard]] int images() const { return images_; }

 private:
  FixedVector<Line, 64> lines_;
  int images_ = 0;
};

struct Ran {
  ExitCode code = ExitCode::done;
  std::string order, other, said;
  int images = 0, held = 0, finished = 0;
};

Ran run_black(int frames) {
  const test::TemporaryFolder folder;
  BlackSource source(frames);
  Notebook first, second;
  SessionOptions options;
  options.out = folder.path() / "session";
  options.quiet = true;
  options.observers = {&first, &second};
  const SignalGuard signals;
  Ran ran;
  testing::internal::CaptureStderr();
  ran.code = run_session(source, load_configuration(std::nullopt, {}), options, signals);
  ran.said = testing::internal::GetCapturedStderr();
  for (const char* file : {"poses.csv", "events.jsonl", "summary.json", "report.html"})
    EXPECT_TRUE(std::filesystem::exists(options.out / file)) << file;
  ran.order = first.order();
  ran.other = second.order();
  ran.images = first.images();
  ran.held = source.held();
  ran.finished = source.finished();
  return ran;
}

TEST(SessionRunner, anObserverSeesFramePoseAndLineOfEachInTurnAndTheEventsBetween) {
  const Ran ran = run_black(4);
  // The calibration it begins with and the remark, two frames, the one that is missing, two more.
  EXPECT_EQ(ran.order, "krfpcfpcefpcfpc");
  EXPECT_EQ(ran.other, ran.order) << "every observer the same";
  EXPECT_EQ(ran.images, 4) << "views of pixels, while it is called";
}

TEST(SessionRunner, everyFrameGoesBackToItsSourceWhichIsEndedOnce) {
  const Ran ran = run_black(4);
  EXPECT_EQ(ran.held, 0);
  EXPECT_EQ(ran.finished, 1);
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

TEST(SessionRunner, theQuotaMakesRoomBeforeTheFolderAndASessionThatIsRefusedCostsNone) {
  const test::TemporaryFolder folder;
  const auto make_old = [&folder] {
    folder.write("old/poses.csv", kPosesHeader);
    folder.write("old/summary.json", "{}");
    folder.write("old/drive.mcap", "");
    std::filesystem::resize_file(folder / "old/drive.mcap", 2'000'000);
  };
  const Configuration configuration = load_configuration(std::nullopt, {"sessions.quota_mb=1"});
  const SignalGuard signals;
  SessionOptions options;
  options.out = folder / "taken";
  options.quiet = true;
  make_old();
  folder.write("taken/notes.txt", "mine");
  BlackSource refused(2);
  EXPECT_THROW((void)run_session(refused, configuration, options, signals), InputError);
  EXPECT_TRUE(std::filesystem::exists(folder / "old"));

  // A folder that cannot be made, as on a full disk: the old session went first.
  options.out = folder / "new";
  std::filesystem::create_symlink(folder / "none" / "new", options.out);
  BlackSource without_room(2);
  EXPECT_THROW((void)run_session(without_room, configuration, options, signals), InputError);
  EXPECT_FALSE(std::filesystem::exists(folder / "old"));
}

TEST(SessionRunner, aSessionHasTheNumberAfterThoseBesideIt) {
  const test::TemporaryFolder folder;
  folder.write("before/session_number", "41\n");
  BlackSource source(2);
  SessionOptions options;
  options.out = folder / "session";
  options.quiet = true;
  const SignalGuard signals;
  testing::internal::CaptureStderr();
  (void)run_session(source, load_configuration(std::nullopt, {}), options, signals);
  (void)testing::internal::GetCapturedStderr();
  EXPECT_EQ(test::read_file(options.out / "session_number"), "42\n");
}

/// Keeps calibration.yaml from being written until the first pose.
class InTheWay final : public SessionObserver {
 public:
  explicit InTheWay(const std::filesystem::path& session)
      : folder_((session / "calibration.yaml.new").string()) {}
  void on_start(const SessionStart& /*start*/) noexcept override {
    made_ = ::mkdir(folder_.c_str(), 0755) == 0;
  }
  void on_pose(const PoseSample& /*sample*/) noexcept override { (void)::rmdir(folder_.c_str()); }
  [[nodiscard]] bool made() const { return made_; }

 private:
  std::string folder_;
  bool made_ = false;
};

TEST(SessionRunner, aCalibrationThatCouldNotBeWrittenAtTheStartIsWrittenAtTheEnd) {
  const test::TemporaryFolder folder;
  BlackSource source(4);
  SessionOptions options;
  options.out = folder / "session";
  options.quiet = true;
  InTheWay in_the_way(options.out);
  options.observers = {&in_the_way};
  const SignalGuard signals;
  testing::internal::CaptureStderr();
  (void)run_session(source, load_configuration(std::nullopt, {}), options, signals);
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_TRUE(in_the_way.made());
  EXPECT_TRUE(std::filesystem::exists(options.out / "calibration.yaml"));
  EXPECT_EQ(said.find("calibration.yaml:"), std::string::npos) << said;
}

TEST(SessionRunner, namesNeedNotBeUtf8) {
  const test::TemporaryFolder folder;
  BlackSource source(4);
  source.begin_from("k\xe4lib.yaml");
  SessionOptions options;
  options.out = folder / "session";
  options.quiet = true;
  const SignalGuard signals;
  testing::internal::CaptureStderr();
  const Configuration configuration = load_configuration(std::nullopt, {"record=[poses]"});
  EXPECT_EQ(run_session(source, configuration, options, signals), ExitCode::not_usable);
  (void)testing::internal::GetCapturedStderr();
  for (const char* file : {"summary.json", "drive.mcap"})
    EXPECT_TRUE(std::filesystem::exists(options.out / file)) << file;
}

/// Files of this process may have so many bytes while it lives.
class LargestFile {
 public:
  explicit LargestFile(rlim_t bytes) {
    (void)::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit small{bytes, before_.rlim_max};
    (void)::setrlimit(RLIMIT_FSIZE, &small);
  }
  ~LargestFile() { (void)::setrlimit(RLIMIT_FSIZE, &before_); }
  LargestFile(const LargestFile&) = delete;
  LargestFile& operator=(const LargestFile&) = delete;

 private:
  rlimit before_{};
};

TEST(SessionRunner, aSessionThatCannotBeRecordedLeavesNoFolder) {
  const test::TemporaryFolder folder;
  BlackSource source(4);
  SessionOptions options;
  options.out = folder / "session";
  options.quiet = true;
  const SignalGuard signals;  // SIGXFSZ ends nothing
  const Configuration configuration = load_configuration(std::nullopt, {"record=[poses]"});
  const LargestFile limit(2000);
  EXPECT_THROW((void)run_session(source, configuration, options, signals), InputError);
  EXPECT_FALSE(std::filesystem::exists(options.out));
}

TEST(SessionRunner, theWholeTrajectoryIsKeptOnlyWhereSomethingIsMadeOfIt) {
  const auto bytes = [](const std::vector<OtherFormat>& also) {
    const test::TemporaryFolder folder;
    BlackSource source(64);
    SessionOptions options;
    options.out = folder / "session";
    options.quiet = true;
    options.also = also;
    const SignalGuard signals;
    testing::internal::CaptureStderr();
    (void)run_session(source, load_configuration(std::nullopt, {}), options, signals);
    (void)testing::internal::GetCapturedStderr();
    const auto summary = nlohmann::json::parse(test::read_file(options.out / "summary.json"));
    return summary["memory"]["recorder_bytes"].get<std::size_t>();
  };
  EXPECT_EQ(bytes({OtherFormat::kitti}) - bytes({}), 64U) << "a status for each frame";
}

/// No thread begins while it lives: none has room for such a stack.
class NoThreads {
 public:
  NoThreads() {
    pthread_attr_t huge;
    (void)::pthread_getattr_default_np(&before_);
    (void)::pthread_getattr_default_np(&huge);
    (void)::pthread_attr_setstacksize(&huge, std::size_t{1} << 50U);
    (void)::pthread_setattr_default_np(&huge);
    (void)::pthread_attr_destroy(&huge);
  }
  ~NoThreads() {
    (void)::pthread_setattr_default_np(&before_);
    (void)::pthread_attr_destroy(&before_);
  }
  NoThreads(const NoThreads&) = delete;
  NoThreads& operator=(const NoThreads&) = delete;

 private:
  pthread_attr_t before_{};
};

TEST(SessionRunner, withoutAThreadForTheEstimatorTheDevicesAreStoppedAndNothingIsLeft) {
  const test::TemporaryFolder folder;
  BlackSource source(4);
  std::optional<NoThreads> no_threads;
  source.when_started([&no_threads] { no_threads.emplace(); });
  SessionOptions options;
  options.out = folder / "session";
  options.quiet = true;
  const SignalGuard signals;
  EXPECT_THROW((void)run_session(source, load_configuration(std::nullopt, {}), options, signals),
               InputError);
  EXPECT_EQ(source.stopped(), 1);
  EXPECT_EQ(source.halted(), 1);
  EXPECT_FALSE(std::filesystem::exists(options.out));
}

TEST(SessionRunner, withoutAPoseThatIsTheVerdictButTheSourceIsHeardToo) {
  const Ran ran = run_black(3);
  EXPECT_EQ(ran.code, ExitCode::not_usable);
  EXPECT_NE(ran.said.find("camera 0 was gone"), std::string::npos) << ran.said;
  EXPECT_NE(ran.said.find("there never was a pose"), std::string::npos) << ran.said;
}

}  // namespace
}  // namespace vergence::app
