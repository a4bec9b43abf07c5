// `vergence run` on V4L2 cameras that look at a rendered drive, inside the rig's kernel.
#include <signal.h>

#include "app/datasets/trajectory_files.hpp"
#include "tests/rigs/emulator.hpp"
#include "tests/rigs/film.hpp"
#include "tests/rigs/vivid.hpp"
#include "tests/support/child_program.hpp"
#include "tests/support/thread_allocations.hpp"
#include "tests/system/run/session.hpp"

namespace vergence {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t kInterval_ns = 100'000'000;

class V4l2Run : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!test::inside_rig()) GTEST_SKIP() << test::kNeedsRig;
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

  /// The first pair stands until the program has posed a few, so that all of the drive is seen.
  class Roll {
   public:
    void begin() { rolls_ = true; }
    /// Image of the film for image `number` of the player.
    std::uint64_t image(std::uint64_t number) {
      const auto n = static_cast<std::int64_t>(number);
      std::int64_t start = -1;
      if (rolls_ && began_.compare_exchange_strong(start, n)) start = n;
      return start < 0 || n < start ? 0 : static_cast<std::uint64_t>(n - start);
    }

   private:
    std::atomic<bool> rolls_{false};
    std::atomic<std::int64_t> began_{-1};
  };
  void drive(test::ChildProgram* program, Roll* roll, const test::Film& film) const {
    for (const auto end = std::chrono::steady_clock::now() + 60s;
         test::lines_of(session_ + "/poses.csv") < 6;) {
      ASSERT_LT(std::chrono::steady_clock::now(), end) << "no pose in a minute";
      std::this_thread::sleep_for(100ms);
    }
    roll->begin();
    std::this_thread::sleep_for(std::chrono::nanoseconds(kInterval_ns) *
                                (static_cast<int>(film.pairs()) + 20));
    program->signal(SIGINT);
    EXPECT_EQ(program->wait(30s), 130) << "ended by the signal, session closed";
  }
  /// Nothing that came was lost, and the trajectory is the film's.
  void expect_the_drive(const test::Film& film, const nlohmann::json& summary) const {
    const auto& frames = summary["frames"];
    const auto read = frames["read"].get<std::uint64_t>();
    EXPECT_GE(read, film.pairs()) << summary.dump(1);
    // Not every interval has a frame when the one processor is late; what came in pairs is posed.
    EXPECT_GE(summary["devices"]["sets_complete"].get<std::uint64_t>() * 10, read * 9);
    EXPECT_GE(frames["posed"].get<std::uint64_t>() * 20, read * 19);
    EXPECT_EQ(frames["lost"].get<std::uint64_t>() + frames["posed"].get<std::uint64_t>(), read);
    EXPECT_EQ(summary["runtime_allocations"], 0);
    // The thread of the INS on a serial line is included.
    test::expect_no_heap_but_of({}, summary);
    const app::Trajectory trajectory = app::read_tum(session_ + "/trajectory.tum");
    const Transform& last = trajectory.back().T_world_body;
    const Transform& truth = film.T_first_left(film.pairs() - 1);
    const double way = truth.t.norm();
    EXPECT_GT(way, 30) << "metres: the film is a drive";
    EXPECT_LT((last.t - truth.t).norm(), 0.03 * way)
        << "ends at " << last.t.transpose() << ", truly at " << truth.t.transpose();
    EXPECT_LT(log_so3(last.R * truth.R.transpose()).norm(), 0.02) << "radians";
  }

  /// The example of one picture, on the same clock, with the film's rig.
  std::vector<std::string> side_by_side() const {
    std::vector<std::string> all{
        "run", std::string(VERGENCE_SOURCE_DIR) + "/app/config/v4l2_side_by_side.yaml", "--out",
        session_};
    for (const char* camera : {"0", "1"})
      for (const char* setting : {"size.0=640", "size.1=720", "pixel_format=GREY",
                                  "options=thin=3 control_timestamp_source=start_of_exposure"}) {
        all.emplace_back("--set");
        all.push_back(std::string("cameras.") + camera + "." + setting);
      }
    for (const char* setting : {"trigger.rate=10", "rig.nominal.baseline_m=0.75",
                                "rig.nominal.k1=-0.08", "rig.nominal.k2=0.02"}) {
      all.emplace_back("--set");
      all.emplace_back(setting);
    }
    return all;
  }

  std::string session_ = ::testing::UnitTest::GetInstance()->current_test_info()->name();
};

TEST_F(V4l2Run, trajectoryIsThatOfTheFilm) {
  for (int k = 0; k < 2; ++k) test::loop(node(2 * k), node(2 * k + 1));
  const char* folder = std::getenv("VERGENCE_FILM");
  ASSERT_NE(folder, nullptr);
  const test::Film film(folder);
  Roll roll;
  test::VividPlayer player(
      {node(1), node(3)}, kInterval_ns,
      [&](std::size_t output, std::uint64_t number, std::span<std::uint8_t> image) {
        const auto shown = film.image(output, roll.image(number));
        std::copy(shown.begin(), shown.end(), image.begin());
      });
  test::ChildProgram program(words());
  ASSERT_NO_FATAL_FAILURE(drive(&program, &roll, film));
  const nlohmann::json s = test::summary_of(session_);
  expect_the_drive(film, s);
  EXPECT_EQ(s["devices"]["frames_incomplete"], 0);
  for (const char* name : {"camera0_underruns", "camera1_underruns"})
    EXPECT_EQ(s["devices"][name], 0) << name;
  for (const char* name : {"camera0_starts", "camera1_starts"})
    EXPECT_EQ(s["devices"][name], 1) << name;
}

/// The film's two images beside one another in the middle of a larger picture's rows.
TEST_F(V4l2Run, sideBySideCameraGivesTrajectoryOfTheFilm) {
  constexpr test::LoopSize kSize = test::LoopSize::hd;
  test::loop(node(0), node(1), kSize);
  const char* folder = std::getenv("VERGENCE_FILM");
  ASSERT_NE(folder, nullptr);
  const test::Film film(folder);
  constexpr auto kWidth = static_cast<std::size_t>(test::kFilmWidth);
  constexpr std::size_t kAbove = (test::height_of(kSize) - test::kFilmHeight) / 2;
  Roll roll;
  test::VividPlayer player(
      {node(1)}, kInterval_ns,
      [&](std::size_t, std::uint64_t number, std::span<std::uint8_t> image) {
        const std::uint64_t n = roll.image(number);
        for (std::size_t k = 0; k < 2; ++k) {
          const auto shown = film.image(k, n);
          for (std::size_t y = 0; y < test::kFilmHeight; ++y) {
            const auto row = shown.subspan(y * kWidth, kWidth);
            std::copy(row.begin(), row.end(),
                      image.subspan(((kAbove + y) * 2 + k) * kWidth).begin());
          }
        }
      },
      kSize);
  test::ChildProgram program(side_by_side());
  ASSERT_NO_FATAL_FAILURE(drive(&program, &roll, film));
  const nlohmann::json s = test::summary_of(session_);
  expect_the_drive(film, s);
  EXPECT_EQ(s["devices"]["sets_ambiguous"], 0) << s["devices"].dump(1);
  EXPECT_EQ(s["devices"]["sets_incomplete"], 0) << "one picture has both";
}

}  // namespace
}  // namespace vergence
