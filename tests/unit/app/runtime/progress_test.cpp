#include "app/runtime/progress.hpp"

#include <algorithm>
#include <sstream>

#include "tests/support/refusal.hpp"

namespace vergence::app {
namespace {

class ProgressTest : public testing::Test {
 protected:
  [[nodiscard]] Progress progress(Progress::Mode mode) {
    return {out, mode, [this] { return now; }, [this] { return width; }};
  }
  static ProgressState at(std::uint64_t frame, std::uint64_t frames) {
    ProgressState s{.state = "stereo", .frame = frame, .frames = frames, .path_m = 618};
    s.inliers = 318;
    s.estimate_ms = 7.9;
    return s;
  }
  [[nodiscard]] std::size_t redraws() const {
    const std::string text = out.str();
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\r'));
  }

  std::ostringstream out;
  HostStamp now{0};
  int width = 200;
};

TEST_F(ProgressTest, lineHasEveryKnownField) {
  auto p = progress(Progress::Mode::terminal);
  p.update(at(1, 33000));
  now = now + Duration::seconds(10);
  // At 100 Hz, the remaining 31999 frames take 319.99 s.
  ProgressState s = at(1001, 33000);
  s.from_ins_m = 0.42;
  p.update(s);
  EXPECT_TRUE(
      test::mentions(out.str(), "1001/33000", "0.62 km", "318", "7.9 ms", "0.42 m", "05:20"));
}

TEST_F(ProgressTest, terminalIsRedrawnAtMostAt10Hz) {
  auto p = progress(Progress::Mode::terminal);
  constexpr int kMilliseconds = 2000;
  for (int ms = 0; ms < kMilliseconds; ++ms) {
    p.update(at(static_cast<std::uint64_t>(ms), 5000));
    now = now + Duration::milliseconds(1);
  }
  EXPECT_EQ(redraws(), 20U);
}

TEST_F(ProgressTest, printsEvery10SWithoutATerminal) {
  auto p = progress(Progress::Mode::lines);
  for (int second = 0; second <= 25; ++second) {
    p.update(at(static_cast<std::uint64_t>(second), 100));
    now = now + Duration::seconds(1);
  }
  p.finish();
  const std::string text = out.str();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 3);
  EXPECT_TRUE(test::mentions(text, "10/100", "20/100", "25/100"));
  EXPECT_EQ(redraws(), 0U) << "no carriage return in a file";
}

}  // namespace
}  // namespace vergence::app
