// `vergence run` on V4L2 cameras that look at a rendered drive, inside the rig's kernel.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "app/datasets/trajectory_files.hpp"
#include "tests/rigs/film.hpp"
#include "tests/rigs/vivid.hpp"

namespace vergence {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t kInterval_ns = 100'000'000;

/// The program as a child; ended by the destructor.
class Program {
 public:
  explicit Program(std::vector<std::string> words) {
    words.insert(words.begin(), VERGENCE_PROGRAM);
    std::vector<char*> pointers;
    for (std::string& w : words) pointers.push_back(w.data());
    pointers.push_back(nullptr);
    pid_ = ::fork();
    if (pid_ != 0) return;
    (void)::execv(pointers.front(), pointers.data());
    ::_exit(127);
  }
  ~Program() {
    if (pid_ > 0) (void)finish(SIGKILL, 5s);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  /// → exit code; 128 + the signal's number; −1: it did not end in time.
  int finish(int with_signal, std::chrono::seconds limit) {
    if (with_signal != 0) (void)::kill(pid_, with_signal);
    const auto end = std::chrono::steady_clock::now() + limit;
    for (int status = 0; std::chrono::steady_clock::now() < end;
         std::this_thread::sleep_for(20ms)) {
      if (::waitpid(pid_, &status, WNOHANG) != pid_) continue;
      pid_ = -1;
      return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }
    return -1;
  }

 private:
  pid_t pid_ = -1;
};

std::size_t lines_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  return static_cast<std::size_t>(std::count(std::istreambuf_iterator<char>(in), {}, '\n'));
}

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream all;
  all << in.rdbuf();
  return all.str();
}

class V4l2Run : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists("/dev/video3"))
      GTEST_SKIP() << "no looped video nodes: this test runs inside the rig's kernel";
    for (int k = 0; k < 2; ++k) test::loop(node(2 * k), node(2 * k + 1));
    std::filesystem::remove_all(session_);
  }
  static std::string node(int number) { return "/dev/video" + std::to_string(number); }
  /// The example, on cameras whose clock ticks every 10 ms and whose rate is 40 Hz.
  std::vector<std::string> words() const {
    return {"run",   std::string(VERGENCE_SOURCE_DIR) + "/app/config/v4l2.yaml",
            "--out", session_,
            "--set", "cameras.0.options=thin=6 control_timestamp_source=start_of_exposure",
            "--set", "cameras.1.options=thin=6 control_timestamp_source=start_of_exposure"};
  }

  std::string session_ = ::testing::UnitTest::GetInstance()->current_test_info()->name();
};

TEST_F(V4l2Run, theDriveInFrontOfTheCamerasComesOut) {
  const char* folder = std::getenv("VERGENCE_FILM");
  ASSERT_NE(folder, nullptr);
  const test::Film film(folder);
  // The first pair stands until the program has posed a few, so that all of the drive is seen.
  std::atomic<bool> roll{false};
  std::atomic<std::int64_t> began{-1};
  test::VividPlayer player(
      {node(1), node(3)}, kInterval_ns,
      [&](std::size_t output, std::uint64_t number, std::span<std::uint8_t> image) {
        const auto n = static_cast<std::int64_t>(number);
        std::int64_t start = -1;
        if (roll && began.compare_exchange_strong(start, n)) start = n;
        const auto shown =
            film.image(output, start < 0 || n < start ? 0 : static_cast<std::uint64_t>(n - start));
        std::copy(shown.begin(), shown.end(), image.begin());
      });
  Program program(words());
  for (const auto end = std::chrono::steady_clock::now() + 60s;
       lines_of(session_ + "/poses.csv") < 6;) {
    ASSERT_LT(std::chrono::steady_clock::now(), end) << "no pose in a minute";
    std::this_thread::sleep_for(100ms);
  }
  roll = true;
  std::this_thread::sleep_for(std::chrono::nanoseconds(kInterval_ns) *
                              (static_cast<int>(film.pairs()) + 20));
  EXPECT_EQ(program.finish(SIGINT, 30s), 130) << "ended by the signal, session closed";

  const auto summary = nlohmann::json::parse(text_of(session_ + "/summary.json"));
  const auto& frames = summary["frames"];
  const auto& devices = summary["devices"];
  const auto read = frames["read"].get<std::uint64_t>();
  EXPECT_GE(read, film.pairs()) << summary.dump(1);
  // Not every interval has a frame of both cameras when the one processor is late; what came in
  // pairs is posed.
  EXPECT_GE(devices["sets_complete"].get<std::uint64_t>() * 10, read * 9);
  EXPECT_GE(frames["posed"].get<std::uint64_t>() * 20, read * 19);
  EXPECT_EQ(frames["lost"].get<std::uint64_t>() + frames["posed"].get<std::uint64_t>(), read);
  EXPECT_EQ(summary["allocations_after_seal"], 0);
  EXPECT_EQ(devices["frames_torn"], 0);
  for (const char* name : {"camera0_underruns", "camera1_underruns"})
    EXPECT_EQ(devices[name], 0) << name;
  for (const char* name : {"camera0_starts", "camera1_starts"}) EXPECT_EQ(devices[name], 1) << name;

  const app::Trajectory trajectory = app::read_tum(session_ + "/trajectory.tum");
  const Transform& last = trajectory.back().T_world_body;
  const Transform& truth = film.T_first_left(film.pairs() - 1);
  const double way = truth.t.norm();
  EXPECT_GT(way, 30) << "metres: the film is a drive";
  EXPECT_LT((last.t - truth.t).norm(), 0.03 * way)
      << "ends at " << last.t.transpose() << ", truly at " << truth.t.transpose();
  EXPECT_LT(log_so3(last.R * truth.R.transpose()).norm(), 0.02) << "radians";
}

TEST_F(V4l2Run, aCameraThatIsNotThereIsOneSentence) {
  auto w = words();
  w.insert(w.end(), {"--set", "cameras.1.serial=/dev/video9"});
  Program program(w);
  EXPECT_EQ(program.finish(0, 30s), 2);
  EXPECT_FALSE(std::filesystem::exists(session_ + "/poses.csv"));
}

TEST_F(V4l2Run, whatTheCameraCannotDoIsRefused) {
  auto w = words();
  w.insert(w.end(), {"--set", "cameras.0.trigger=hardware", "--set", "cameras.1.trigger=hardware"});
  Program program(w);
  EXPECT_EQ(program.finish(0, 30s), 2);
}

}  // namespace
}  // namespace vergence
