#include "tests/support/quantile.hpp"
#include "tests/unit/drivers/trigger_board/rig.hpp"

namespace vergence::trigger_board {
namespace {

using namespace test;

struct Case {
  const char* name;
  double p99_us, rms_us;
  void (*change)(test::BoardSimulatorOptions*, test::SimulatedLineOptions*);
  Options options{};
};
class Stamps : public ::testing::TestWithParam<Case> {};

/// |mapped − true| of the edges later than ten seconds after the first, over seeds whose crystals
/// are off by ±50 ppm.
TEST_P(Stamps, errorsStayWithinTheirBound) {
  const Case& c = GetParam();
  std::vector<double> us;
  double squares = 0;
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    test::BoardSimulatorOptions board = board_for(Duration::seconds(60));
    test::SimulatedLineOptions line = direct_line();
    board.seed = line.seed = seed;
    board.clock_ppm = seed % 2 == 0 ? 50 : -50;
    c.change(&board, &line);
    BoardRig rig(board, line, c.options);
    // As a camera does: the report comes at the end of its exposure.
    rig.exposures = [](const test::SimulatedPulse& p) {
      test::SimulatedExposures x;
      x[0] =
          x[1] = {true, p.edge + Duration::microseconds(30), p.edge + Duration::microseconds(8030)};
      return x;
    };
    TriggerConfiguration requested = thirty_hertz();
    requested.feedback = 0x03;
    // drive() checks each stamp against its bound.
    const auto all = rig.drive(requested);
    EXPECT_GT(all.size(), 1700U);
    for (const Pulse& p : all) {
      if (p.edge - all.front().edge < Duration::seconds(10)) continue;
      us.push_back(std::abs((p.host - rig.truth(p)).to_seconds()) * 1e6);
      squares += us.back() * us.back();
    }
  }
  EXPECT_LE(std::sqrt(squares / static_cast<double>(us.size())), c.rms_us);
  EXPECT_LE(test::quantile(us, 0.99), c.p99_us);
}

void two_milliseconds_of_jitter(test::SimulatedLineOptions* line) {
  line->fifo = 64;
  line->late_fraction = line->sent_late_fraction = 1;
  line->late_mean = line->sent_late_mean = Duration::milliseconds(2);
}
/// A USB converter holds bytes back for its latency timer. With 16 ms this line's bytes fill its
/// packets before the timer runs out, and the last of a full packet leave at once; with 1 ms every
/// packet waits for a frame of the bus, 1 ms, and half of that is in the stamps, where nothing on
/// the host can see it. It is within the bound.
template <int kMilliseconds>
void converter(test::BoardSimulatorOptions*, test::SimulatedLineOptions* line) {
  line->converter = true;
  line->latency_timer = Duration::milliseconds(kMilliseconds);
}

INSTANTIATE_TEST_SUITE_P(Lines, Stamps,
                         ::testing::Values(Case{"quiet", 50, 50, [](auto*, auto*) {}},
                                           Case{"jitter", 50, 20,
                                                [](auto*, auto* line) {
                                                  two_milliseconds_of_jitter(line);
                                                }},
                                           // As fast as 0.05 ppm a second.
                                           Case{"crystalThatWarmsUp", 50, 20,
                                                [](auto* board, auto* line) {
                                                  two_milliseconds_of_jitter(line);
                                                  board->wander_ppm = 2;
                                                  board->wander_period = Duration::seconds(240);
                                                }},
                                           Case{"ppsThatMovesTheRate",
                                                50,
                                                20,
                                                [](auto* board, auto* line) {
                                                  two_milliseconds_of_jitter(line);
                                                  board->pps = true;
                                                },
                                                {.pps = Edge::rising}},
                                           Case{"converter1ms", 1000, 1000, converter<1>},
                                           Case{"converter16ms", 300, 300, converter<16>}),
                         [](const auto& one) { return one.param.name; });

}  // namespace
}  // namespace vergence::trigger_board
