// `vergence run` on emulated IIDC cameras that look at a rendered drive: what the example
// configurations do on real stacks.

#include <cstdlib>

#include "app/report/session.hpp"
#include "drivers/iidc/iidc.hpp"
#include "tests/rigs/board_rig.hpp"
#include "tests/rigs/film.hpp"
#include "tests/rigs/iidc_rig.hpp"
#include "tests/support/thread_allocations.hpp"
#include "tests/support/within.hpp"
#include "tests/support/xsens_terminal.hpp"
#include "tests/system/run/session.hpp"

namespace vergence::test {
namespace {

/// Distance of the track from the film's, worst of all poses, as part of the way: the film begins
/// with the first exposure of any camera, the track with the first pair, a few images later.
double worst_error(const std::vector<app::report::Frame>& frames, const Film& film) {
  constexpr std::size_t kLatest = 30;
  double best = 1e9;
  for (std::size_t shift = 0; shift < kLatest; ++shift) {
    double worst = 0, way = 0;
    Transform first;
    bool any = false;
    std::size_t begin = 0;
    Vec3 last = Vec3::Zero(), offset = Vec3::Zero();
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const app::report::Frame& frame = frames[i];
      if (!frame.posed) continue;
      if (!any) {
        begin = i;
        offset = frame.T_world_left.t;
        if (shift >= film.pairs()) break;
        first = film.T_first_left(shift).inverse();
      }
      const std::size_t n = shift + i - begin;
      if (n >= film.pairs()) break;
      const Vec3 truth = (first * film.T_first_left(n)).t;
      if (any) way += (truth - last).norm();
      last = truth;
      any = true;
      worst = std::max(worst, (frame.T_world_left.t - offset - truth).norm());
    }
    if (way > 5) best = std::min(best, worst / way);
  }
  return best;
}

/// `vergence run` for so many seconds of the film; `settings`: --set KEY=VALUE. →
/// the session's folder.
std::filesystem::path run_film(const std::string& name, const std::string& configuration,
                               int seconds, const std::vector<std::string>& settings) {
  const std::filesystem::path out = std::filesystem::absolute("session-" + name);
  std::filesystem::remove_all(out);
  std::string command = std::string(VERGENCE_PROGRAM) + " run " + VERGENCE_SOURCE_FOLDER +
                        "/app/config/" + configuration + " --out " + out.string() + " --duration " +
                        std::to_string(seconds) + " --quiet --set rig.state_dir=none";
  for (const std::string& setting : settings) command += " --set " + setting;
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  return out;
}

/// Requirements for every drive on the film: all pairs posed, nothing allocated, the way right.
void expect_a_drive(const std::filesystem::path& session, const nlohmann::json& summary,
                    const Film& film) {
  const auto& frames = summary.at("frames");
  const auto& devices = summary.at("devices");
  EXPECT_GE(frames.at("read").get<int>(), 60) << "of 90 at 10 Hz, or of 88 at 4 Hz";
  EXPECT_GE(frames.at("posed").get<int>(), devices.at("sets_complete").get<int>())
      << "every pair that came gets a pose";
  EXPECT_GE(frames.at("ok").get<int>(), 15)
      << "until a calibration is found the poses are degraded";
  EXPECT_EQ(summary.at("runtime_allocations").get<int>(), 0);
  // libusb takes one block for every transfer that is submitted, which is an image; libdc1394 none.
  const std::uint64_t images = 2 * (devices.at("sets_complete").get<std::uint64_t>() +
                                    devices.at("sets_incomplete").get<std::uint64_t>());
  test::expect_no_heap_but_of({"vergence-iidcus", images + 20}, summary);
  EXPECT_LT(worst_error(app::report::read_session(session).frames, film), 0.03);
}

struct Bus {
  const char *name, *emulator, *configuration;
  bool pulses;
};

class IidcRun : public ::testing::TestWithParam<Bus> {};

TEST_P(IidcRun, exampleConfigurationPosesEveryPair) {
  if (!inside_rig()) GTEST_SKIP() << kNeedsRig;
  const char* film_folder = std::getenv("VERGENCE_FILM");
  ASSERT_NE(film_folder, nullptr);
  const Film film(film_folder);
  std::vector<std::string> arguments{"--cameras", "2", "--film", film_folder, "--film-hz", "10"};
  if (GetParam().pulses) arguments.insert(arguments.end(), {"--trigger-hz", "10"});
  auto driver = std::string(GetParam().emulator) == "sim_1394" ? iidc::make_1394_driver()
                                                               : iidc::make_usb_driver();
  Emulator emulator(GetParam().emulator, arguments);
  ASSERT_TRUE(await_cameras(driver.get(), 2));

  const auto out = run_film(GetParam().name, GetParam().configuration, 9, {});
  const std::string report = emulator.finish();
  const auto summary = test::summary_of(out);
  const auto& frames = summary.at("frames");
  const auto& devices = summary.at("devices");
  SCOPED_TRACE(summary.dump(1) + report);
  expect_a_drive(out, summary, film);
  // The cameras start one after the other: the first exposures of one may be without their pair.
  EXPECT_LE(frames.at("lost").get<int>(), devices.at("sets_incomplete").get<int>());
  EXPECT_LE(devices.at("sets_incomplete").get<int>(), 3);
  for (int k = 0; k < 2; ++k) {
    const std::string name = "camera" + std::to_string(k) + "_";
    const auto delivered = devices.at(name + "delivered").get<std::int64_t>();
    const auto lost = devices.at(name + "lost").get<std::int64_t>(),
               underruns = devices.at(name + "underruns").get<std::int64_t>();
    EXPECT_EQ(devices.at("frames_incomplete").get<int>(), 0);
    // Exposures counted by the emulator, without images after the end of the drive: the
    // cameras are stopped by the next look of the caller's thread (50 ms), one after the other, on
    // the one processor of this machine. At 10 Hz that is within 0.4 s.
    constexpr int kAfterTheEnd = 4;
    EXPECT_LE(delivered + lost + underruns, count_of(report, k, "exposed"));
    EXPECT_GE(delivered + lost + underruns + kAfterTheEnd, count_of(report, k, "exposed"));
    EXPECT_LE(lost, count_of(report, k, "overtaken"));
  }
}

TEST(BoardRun, triggerBoardCamerasAndInsMakeOneSession) {
  if (!inside_rig()) GTEST_SKIP() << kNeedsRig;
  const char* film_folder = std::getenv("VERGENCE_FILM");
  ASSERT_NE(film_folder, nullptr);
  const Film film(film_folder);
  auto driver = iidc::make_usb_driver();
  // Slower than the other drives: two serial lines cost the one processor as much as the
  // cameras do, and what it cannot expose no pulse can be verified by.
  Emulator cameras("sim_usb_iidc", {"--cameras", "2", "--film", film_folder, "--film-hz", "4"});
  ASSERT_TRUE(await_cameras(driver.get(), 2));
  std::atomic<bool> wired{true};
  BoardBehindConverter board([&](const test::SimulatedPulse& pulse) {
    if (wired) cameras.command("trigger " + std::to_string(pulse.edge.ns()));
    return test::SimulatedExposures{};
  });
  const auto await_port = [](const char* port) {
    return within(10, [port] { return std::filesystem::exists(port); });
  };
  ASSERT_TRUE(await_port("/dev/ttyUSB0"));
  constexpr const char* kInsWire = "/run/vergence-wire";
  Emulator converter("sim_ftdi", {"--wire", kInsWire});
  DeviceOnDescriptor sensor(::open(kInsWire, O_RDWR | O_NOCTTY | O_NONBLOCK), resting_xsens());
  ASSERT_TRUE(await_port("/dev/ttyUSB1"));

  const auto out = run_film("board", "iidc_usb.yaml", 22,
                            {"sync.mode=board", "trigger.driver=board", "trigger.port=/dev/ttyUSB0",
                             "trigger.rate=4", "trigger.dither_us=2000", "ins.driver=xsens",
                             "ins.port=/dev/ttyUSB1", "ins.baud=115200", "ins.rate=20"});
  wired = false;
  const std::string report = cameras.finish();
  const auto summary = test::summary_of(out);
  SCOPED_TRACE(summary.dump(1) + report);
  expect_a_drive(out, summary, film);
  const auto& pairing = summary.at("time").at("pairing");
  EXPECT_TRUE(pairing.at("verified").get<bool>());
  const auto& devices = summary.at("devices");
  EXPECT_EQ(devices.at("sets_ambiguous").get<int>(), 0);
  for (const char* name : {"camera0_acquisitions", "camera1_acquisitions"})
    EXPECT_EQ(devices.at(name).get<int>(), 1);
}

INSTANTIATE_TEST_SUITE_P(Buses, IidcRun,
                         ::testing::Values(Bus{"usb", "sim_usb_iidc", "iidc_usb.yaml", true},
                                           Bus{"1394", "sim_1394", "iidc_1394.yaml", false}),
                         [](const auto& bus) { return std::string(bus.param.name); });

}  // namespace
}  // namespace vergence::test
