#include "app/runtime/progress_output.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <string>
#include <thread>

namespace vergence::app {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

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
