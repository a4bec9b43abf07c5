#include "app/runtime/progress.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

namespace vergence::app {
namespace {

/// What a terminal would show: carriage returns overwrite, newlines end a row.
struct Screen {
  std::vector<std::string> rows;  // finished
  std::string row;                // being written, code points as they came
};

std::vector<std::string> code_points(const std::string& text) {
  std::vector<std::string> points;
  for (const char c : text) {
    if ((static_cast<unsigned char>(c) & 0xC0U) == 0x80U)
      points.back() += c;
    else
      points.emplace_back(1, c);
  }
  return points;
}

Screen show(const std::string& bytes) {
  Screen screen;
  std::vector<std::string> cells;
  std::size_t at = 0;
  const auto joined = [&cells] {
    std::string row;
    for (const auto& c : cells) row += c;
    row.erase(row.find_last_not_of(' ') + 1);
    return row;
  };
  for (const std::string& c : code_points(bytes)) {
    if (c == "\r") {
      at = 0;
    } else if (c == "\n") {
      screen.rows.push_back(joined());
      cells.clear();
      at = 0;
    } else {
      if (at == cells.size()) cells.emplace_back();
      cells[at++] = c;
    }
  }
  screen.row = joined();
  return screen;
}

class ProgressTest : public testing::Test {
 protected:
  [[nodiscard]] Progress progress(Progress::Mode mode) {
    return {out, mode, [this] { return now; }, [this] { return width; }};
  }
  static ProgressState at(std::uint64_t frame, std::uint64_t frames) {
    ProgressState s;
    s.state = "stereo";
    s.frame = frame;
    s.frames = frames;
    s.path_m = 618;
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

TEST_F(ProgressTest, TheLineSaysEverythingThatIsKnown) {
  auto p = progress(Progress::Mode::terminal);
  p.update(at(1, 33000));
  now = now + Duration::seconds(10);
  ProgressState s = at(1001, 33000);  // 100 frames a second: 31999 are left, 319.99 s
  s.from_ins_m = 0.42;
  p.update(s);
  EXPECT_EQ(
      show(out.str()).row,
      "stereo · frame 1001/33000 · 0.62 km · 318 inliers · 7.9 ms · 0.42 m from INS · 05:20 left");
}

TEST_F(ProgressTest, TheTerminalIsRedrawnAtMostTenTimesASecond) {
  auto p = progress(Progress::Mode::terminal);
  constexpr int kMilliseconds = 2000;
  for (int ms = 0; ms < kMilliseconds; ++ms) {
    p.update(at(static_cast<std::uint64_t>(ms), 5000));
    now = now + Duration::milliseconds(1);
  }
  EXPECT_EQ(redraws(), 20U);
}

TEST_F(ProgressTest, WithoutATerminalALineComesEveryTenSecondsAndOneAtTheEnd) {
  auto p = progress(Progress::Mode::lines);
  for (int second = 0; second <= 25; ++second) {
    p.update(at(static_cast<std::uint64_t>(second), 100));
    now = now + Duration::seconds(1);
  }
  p.finish();
  const Screen screen = show(out.str());
  ASSERT_EQ(screen.rows.size(), 3U);
  EXPECT_NE(screen.rows[0].find("frame 10/100"), std::string::npos);
  EXPECT_NE(screen.rows[1].find("frame 20/100"), std::string::npos);
  EXPECT_NE(screen.rows[2].find("frame 25/100"), std::string::npos);
  EXPECT_EQ(redraws(), 0U) << "no carriage return in a file";
}

}  // namespace
}  // namespace vergence::app
