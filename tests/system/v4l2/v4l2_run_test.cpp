// `vergence run` on V4L2 cameras that look at a rendered drive, inside the rig's kernel.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "app/datasets/trajectory_files.hpp"
#include "tests/rigs/film.hpp"
#include "tests/rigs/vivid.hpp"
#include "tests/support/child_program.hpp"
#include "tests/support/gnss_bytes.hpp"
#include "tests/support/receiver_terminal.hpp"
#include "tests/support/thread_allocations.hpp"

namespace vergence {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t kInterval_ns = 100'000'000;

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
         lines_of(session_ + "/poses.csv") < 6;) {
      ASSERT_LT(std::chrono::steady_clock::now(), end) << "no pose in a minute";
      std::this_thread::sleep_for(100ms);
    }
    roll->begin();
    std::this_thread::sleep_for(std::chrono::nanoseconds(kInterval_ns) *
                                (static_cast<int>(film.pairs()) + 20));
    program->signal(SIGINT);
    EXPECT_EQ(program->wait(30s), 130) << "ended by the signal, session closed";
  }
  nlohmann::json summary() const {
    return nlohmann::json::parse(text_of(session_ + "/summary.json"));
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
    EXPECT_EQ(summary["allocations_after_seal"], 0);
    test::expect_no_heap_but_of({}, summary);  // the INS on a line is among them
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
  std::vector<std::string> one_picture() const {
    std::vector<std::string> all{
        "run", std::string(VERGENCE_SOURCE_DIR) + "/app/config/v4l2_one_picture.yaml", "--out",
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

TEST_F(V4l2Run, theDriveInFrontOfTheCamerasComesOut) {
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
  const nlohmann::json s = summary();
  expect_the_drive(film, s);
  EXPECT_EQ(s["devices"]["frames_torn"], 0);
  for (const char* name : {"camera0_underruns", "camera1_underruns"})
    EXPECT_EQ(s["devices"][name], 0) << name;
  for (const char* name : {"camera0_starts", "camera1_starts"})
    EXPECT_EQ(s["devices"][name], 1) << name;
}

/// Latitude or longitude as NMEA writes it: degrees and minutes in one number, of which `width`
/// digits stand before the point.
std::string in_minutes(double degrees, int width) {
  const double whole = std::floor(degrees);
  std::array<char, 24> text{};
  (void)std::snprintf(text.data(), text.size(), "%0*.7f", width + 8,
                      whole * 100 + (degrees - whole) * 60);
  return text.data();
}

/// An epoch of a receiver that stands where the film's left camera does; the film begins northward.
std::string epoch_at(const Eigen::Vector3d& t_first_left, const Eigen::Vector3d& before,
                     int tenths) {
  constexpr double kLatitude = 27.5, kLongitude = 153;  // degrees
  constexpr double kDegree = 110'800, kEast = 98'700;   // metres a degree there
  const std::string at = in_minutes(kLatitude + t_first_left.z() / kDegree, 4) + ",N," +
                         in_minutes(kLongitude + t_first_left.x() / kEast, 5) + ",E";
  const Eigen::Vector3d v = (t_first_left - before) / 0.1;
  const double course = std::atan2(v.x(), v.z()) * 180 / std::numbers::pi;
  std::array<char, 64> time{}, motion{};
  (void)std::snprintf(time.data(), time.size(), "01%02d%02d.%d0", tenths / 600 % 60,
                      tenths / 10 % 60, tenths % 10);
  (void)std::snprintf(motion.data(), motion.size(), "%.3f,%.2f", v.norm() / 0.514444,
                      course < 0 ? course + 360 : course);
  return test::nmea_sentence("GPRMC," + std::string(time.data()) + ",A," + at + "," +
                             motion.data() + ",290224,,,A") +
         test::nmea_sentence("GPGGA," + std::string(time.data()) + "," + at +
                             ",4,12,0.8,50.0,M,0.0,M,,");
}

TEST_F(V4l2Run, theDriveIsComparedWithASatelliteReceiver) {
  for (int k = 0; k < 2; ++k) test::loop(node(2 * k), node(2 * k + 1));
  const char* folder = std::getenv("VERGENCE_FILM");
  ASSERT_NE(folder, nullptr);
  const test::Film film(folder);
  Roll roll;
  std::atomic<std::uint64_t> shown{0};
  test::VividPlayer player(
      {node(1), node(3)}, kInterval_ns,
      [&](std::size_t output, std::uint64_t number, std::span<std::uint8_t> image) {
        shown = roll.image(number);
        const auto of_film = film.image(output, shown);
        std::copy(of_film.begin(), of_film.end(), image.begin());
      });
  const test::Receiver receiver([&](int tenths) {
    const std::size_t n = std::min<std::size_t>(shown, film.pairs() - 1);
    const bool moves = n > 0 && n + 1 < film.pairs();
    return epoch_at(film.T_first_left(n).t, film.T_first_left(moves ? n - 1 : n).t, tenths);
  });
  std::vector<std::string> all = words();
  for (const std::string& setting :
       {std::string("ins.driver=nmea"), std::string("ins.rate=10"), "ins.port=" + receiver.port(),
        std::string("comparison.placement_m=15")}) {
    all.emplace_back("--set");
    all.push_back(setting);
  }
  test::ChildProgram program(all);
  ASSERT_NO_FATAL_FAILURE(drive(&program, &roll, film));
  const nlohmann::json s = summary();
  expect_the_drive(film, s);
  const auto& comparison = s["comparison"];
  EXPECT_GT(comparison["ins_samples"], film.pairs() / 2) << s.dump(1);
  EXPECT_EQ(comparison["ins_without_attitude"], comparison["ins_samples"]);
  EXPECT_GE(comparison["placements"], 1) << "placed on the earth";
  EXPECT_GT(comparison["compared"].get<std::uint64_t>(), film.pairs() / 2);
  EXPECT_EQ(comparison["jumps"], 0);
}

/// The film's two images beside one another in the middle of a larger picture's rows.
TEST_F(V4l2Run, theSameDriveComesOutOfOneCameraWithBothImagesInItsPicture) {
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
  test::ChildProgram program(one_picture());
  ASSERT_NO_FATAL_FAILURE(drive(&program, &roll, film));
  const nlohmann::json s = summary();
  expect_the_drive(film, s);
  EXPECT_EQ(s["devices"]["sets_unproven"], 0) << s["devices"].dump(1);
  EXPECT_EQ(s["devices"]["sets_incomplete"], 0) << "one picture has both";
}

TEST_F(V4l2Run, aCameraThatIsNotThereIsOneSentence) {
  auto w = words();
  w.insert(w.end(), {"--set", "cameras.1.serial=/dev/video9"});
  test::ChildProgram program(w);
  EXPECT_EQ(program.wait(30s), 3);
  EXPECT_FALSE(std::filesystem::exists(session_ + "/poses.csv"));
}

TEST_F(V4l2Run, whatTheCameraCannotDoIsRefused) {
  auto w = words();
  w.insert(w.end(), {"--set", "cameras.0.trigger=hardware", "--set", "cameras.1.trigger=hardware"});
  test::ChildProgram program(w);
  EXPECT_EQ(program.wait(30s), 2);
}

}  // namespace
}  // namespace vergence
