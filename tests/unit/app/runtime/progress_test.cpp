#include "app/runtime/progress.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "app/runtime/progress_output.hpp"

namespace vergence::app {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

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

TEST_F(ProgressTest, TheLineIsCutToTheWidthInCharactersNotBytes) {
  width = 30;
  auto p = progress(Progress::Mode::terminal);
  p.update(at(1204, 33000));
  const auto shown = code_points(show(out.str()).row);
  EXPECT_LE(shown.size(), 30U);
  EXPECT_GE(shown.size(), 28U) << "the room is used";
  EXPECT_EQ(show(out.str()).row.substr(0, 8), "stereo \xC2")
      << "and nothing is cut inside a character";
  for (const auto& c : shown) EXPECT_TRUE(c.size() == 1 || c == "·");
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

TEST_F(ProgressTest, LinesThatWereNotTakenAreCountedWhereOneIs) {
  bool takes = false;
  std::string taken;
  Progress p(
      [&](std::string_view text, bool may_wait) {
        EXPECT_TRUE(may_wait || text.find('\n') == std::string_view::npos) << text;
        if (takes) taken += text;
        return takes;
      },
      Progress::Mode::terminal, [this] { return now; }, [this] { return width; });
  p.update(at(5, 10));
  p.say("camera 0 is gone");
  p.say("camera 1 is gone");
  takes = true;
  p.say("both are back");
  p.finish();
  const Screen screen = show(taken);
  ASSERT_EQ(screen.rows.size(), 3U);
  EXPECT_EQ(screen.rows[0], "vergence: lines that were not taken before this one: 2");
  EXPECT_EQ(screen.rows[1], "both are back");
  EXPECT_EQ(screen.rows[2].substr(0, 6), "stereo") << "what was not drawn before is at the end";
}

/// Both ends of a pipe, a pair of sockets or a terminal; nobody reads unless asked to.
struct Ends {
  enum class Kind { pipe, sockets, terminal };
  explicit Ends(Kind kind) {
    std::array<int, 2> pair{-1, -1};
    if (kind == Kind::pipe) {
      (void)::pipe(pair.data());
      from = pair[0], to = pair[1];
    } else if (kind == Kind::sockets) {
      (void)::socketpair(AF_UNIX, SOCK_STREAM, 0, pair.data());
      from = pair[0], to = pair[1];
    } else {
      (void)::openpty(&from, &to, nullptr, nullptr, nullptr);
    }
  }
  ~Ends() {
    (void)::close(from);
    (void)::close(to);
  }
  Ends(const Ends&) = delete;
  Ends& operator=(const Ends&) = delete;

  /// What there is to be read, without carriage returns of terminals.
  [[nodiscard]] std::string read_all() const {
    std::string text;
    std::array<char, 4096> piece{};
    for (pollfd asked{from, POLLIN, 0}; ::poll(&asked, 1, 100) > 0;) {
      const ssize_t n = ::read(from, piece.data(), piece.size());
      if (n <= 0) break;
      text.append(piece.data(), static_cast<std::size_t>(n));
    }
    std::erase(text, '\r');
    return text;
  }
  int from = -1, to = -1;
};

double seconds_of(const auto& work) {
  const auto begun = Clock::now();
  work();
  return std::chrono::duration<double>(Clock::now() - begun).count();
}

class ProgressOutputTo : public testing::TestWithParam<Ends::Kind> {};

TEST_P(ProgressOutputTo, nobodyWhoReadsCostsASecondOnceAndEveryLineIsWholeOrNotThere) {
  const Ends ends(GetParam());
  ProgressOutput out(ends.to);
  int taken = 0, line = 0;
  const auto text = [](int number) { return "line " + std::to_string(number) + " of a drive\n"; };
  // A terminal hands on what it took in its own time and then takes some more.
  const auto fill = [&] {
    for (int before = -1; before != taken; std::this_thread::sleep_for(50ms)) {
      before = taken;
      while (out.write(text(line), false)) ++line, ++taken;
    }
  };
  EXPECT_LT(seconds_of(fill), 5);
  ASSERT_GT(taken, 10);
  const std::string lost = text(line);  // a shorter one may find room
  const double first = seconds_of([&] { EXPECT_FALSE(out.write(lost, true)); });
  EXPECT_GT(first, 0.9);
  EXPECT_LT(first, 5);
  EXPECT_LT(seconds_of([&] {
              for (int i = 0; i < 10; ++i) EXPECT_FALSE(out.write(lost, true));
            }),
            0.9);
  std::string expected, read = ends.read_all();
  for (int i = 0; i < taken; ++i) expected += text(i);
  expected += "after it\n";
  EXPECT_TRUE(out.write("after it\n", true));
  read += ends.read_all();
  EXPECT_EQ(read, expected);
}

INSTANTIATE_TEST_SUITE_P(Kinds, ProgressOutputTo,
                         testing::Values(Ends::Kind::pipe, Ends::Kind::sockets,
                                         Ends::Kind::terminal));

TEST(ProgressOutput, aTerminalThatCtrlSStoppedHoldsNobodyUp) {
  const Ends ends(Ends::Kind::terminal);
  ProgressOutput out(ends.to);
  ASSERT_EQ(::tcflow(ends.to, TCOOFF), 0);
  EXPECT_LT(seconds_of([&] { EXPECT_FALSE(out.write("a drive goes on\n", false)); }), 0.9);
  EXPECT_LT(seconds_of([&] { EXPECT_FALSE(out.write("a drive goes on\n", true)); }), 5);
  ASSERT_EQ(::tcflow(ends.to, TCOON), 0);
  EXPECT_TRUE(out.write("it is taken again\n", true));
  EXPECT_EQ(ends.read_all(), "it is taken again\n");
}

TEST(ProgressOutput, aDescriptorThatFailsForGoodTakesEverything) {
  ProgressOutput closed(-1);
  EXPECT_TRUE(closed.write("nobody there\n", true));
  const int full = ::open("/dev/full", O_WRONLY | O_CLOEXEC);
  ProgressOutput out(full);
  EXPECT_TRUE(out.write("no room\n", true));
  (void)::close(full);
}

}  // namespace
}  // namespace vergence::app
