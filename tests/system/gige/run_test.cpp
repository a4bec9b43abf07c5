#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "app/datasets/trajectory_files.hpp"
#include "app/devices/mock_drive.hpp"
#include "tests/support/gige_camera.hpp"
#include "tests/support/simulators/board_simulator.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/thread_allocations.hpp"
#include "tests/support/xsens_terminal.hpp"
#include "tests/system/gige/socket_buffer.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence {
namespace {

using test::GigeCamera;
using test::Outcome;
using test::run_vergence;
using test::TemporaryFolder;

constexpr int kWidth = 640, kHeight = 480, kPairs = 40;
constexpr double kRate = 10;

const std::string kExample = std::string(VERGENCE_SOURCE_DIR) + "/app/config/gige.yaml";

/// A rendered drive: every camera's images, rows without padding, and where the left camera truly
/// was.
struct RenderedDrive {
  RenderedDrive() {
    const app::Configuration c = app::parse_configuration(
        "rig: {nominal: {baseline_m: 0.75, k1: -0.08, k2: 0.02}}\n"
        "cameras: [{driver: mock, size: [640, 480], exposure_us: 4000}, {driver: mock, size: [640, "
        "480], exposure_us: 4000}]\n"
        "trigger: {driver: mock, rate: 10}\nins: {driver: none}\n"
        "mock: {drive: brief, texture_detail: 0, stop_s: 1, speed: 8}\n",
        "drive", {});
    const app::MockDrive drive = app::make_mock_drive(c, {}, false, (kPairs - 0.5) / kRate);
    for (int k = 0; k < 2; ++k) EXPECT_EQ(drive.rig->camera(k).start(nullptr), DeviceStatus::ok);
    EXPECT_EQ(drive.rig->trigger().start(nullptr), DeviceStatus::ok);
    for (int i = 0; i < kPairs; ++i)
      for (int k = 0; k < 2; ++k) {
        CameraDevice& camera = drive.rig->camera(k);
        Frame frame;
        EXPECT_EQ(camera.wait(Duration::seconds(60), &frame), DeviceStatus::ok) << "image " << i;
        const ImageView image = camera.view(frame.slot);
        std::vector<std::uint8_t> bytes;
        for (int y = 0; y < image.height; ++y)
          bytes.insert(bytes.end(), image.row(y), image.row(y) + image.width);
        images[k].push_back(std::move(bytes));
        camera.release(frame.slot);
      }
    truth = app::true_trajectory(*drive.rig, c, Stamp{});
  }
  std::vector<std::vector<std::uint8_t>> images[2];
  std::vector<StampedPose> truth;
};

/// The two cameras of the example on simulated wires.
struct Wires {
  explicit Wires(const RenderedDrive* drive) {
    for (int k = 0; k < 2; ++k) {
      test::GigeCameraOptions o;
      o.address = GigeCamera::address(k);
      o.serial = "RUN-" + std::to_string(k);
      o.sensor_width = kWidth;
      o.sensor_height = kHeight;
      o.clock_drift_ppm = 25 - 60 * k;
      o.number_images = false;
      o.discoverable = false;
      if (drive != nullptr)
        o.images = [drive, k](std::uint64_t n) {
          return drive->images[k][std::min<std::size_t>(n, drive->images[k].size() - 1)].data();
        };
      cameras.push_back(std::make_unique<GigeCamera>(o));
    }
  }
  [[nodiscard]] std::string settings() const {
    std::string s =
        " --set trigger.rate=10 --set rig.nominal.k1=-0.08 --set rig.nominal.k2=0.02 --set "
        "rig.nominal.baseline_m=0.75"
        " --set rig.state_dir=none --set 'cameras.1.T_camera_left=[1,0,0,-0.75,0,1,0,0,0,0,1,0]'";
    for (int k = 0; k < 2; ++k)
      s += " --set cameras." + std::to_string(k) +
           ".serial=" + cameras[static_cast<std::size_t>(k)]->options().address +
           " --set cameras." + std::to_string(k) + ".size=[640,480]";
    return s;
  }
  std::vector<std::unique_ptr<GigeCamera>> cameras;
};

double path_length(const std::vector<StampedPose>& poses) {
  double sum = 0;
  for (std::size_t i = 1; i < poses.size(); ++i)
    sum += (poses[i].T_world_body.t - poses[i - 1].T_world_body.t).norm();
  return sum;
}

/// Pulses for both cameras once they stream, kPairs of them.
std::thread pulse_cameras(const Wires& wires) {
  return std::thread([&wires] {
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!(wires.cameras[0]->acquiring() && wires.cameras[1]->acquiring())) {
      if (std::chrono::steady_clock::now() > give_up) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    for (std::uint64_t n = 0; n < kPairs; ++n) {
      const HostStamp now(std::chrono::steady_clock::now().time_since_epoch().count());
      for (const auto& camera : wires.cameras) camera->pulse(n, now);
      std::this_thread::sleep_for(std::chrono::duration<double>(1 / kRate));
    }
  });
}

TEST(GigeRun, everyPairOverGigeVisionIsPosed) {
  if (const std::string why = test::socket_buffer_obstacle(); !why.empty()) GTEST_SKIP() << why;
  const RenderedDrive drive;
  const Wires wires(&drive);
  std::thread pulses = pulse_cameras(wires);
  const TemporaryFolder folder;
  const auto session = folder / "s";
  const Outcome o =
      run_vergence("run '" + kExample + "' --duration " + std::to_string(kPairs / kRate + 3) +
                   " --out '" + session.string() + "'" + wires.settings());
  pulses.join();
  ASSERT_EQ(o.code, 0) << o.err;
  std::ifstream in(session / "summary.json");
  const auto summary = nlohmann::json::parse(in);
  const auto& devices = summary["devices"];
  EXPECT_EQ(summary["frames"]["read"], kPairs);
  EXPECT_EQ(summary["frames"]["posed"], kPairs);
  EXPECT_EQ(summary["runtime_allocations"], 0);
  // Aravis takes two blocks for every image that begins (a breakpoint on ThreadAllocations::count).
  test::expect_no_heap_but_of({"vergence-gige", std::uint64_t{2} * 2 * kPairs}, summary);
  EXPECT_EQ(devices["sets_complete"], kPairs);
  EXPECT_EQ(devices["sets_incomplete"], 0);
  EXPECT_EQ(devices["sets_ambiguous"], 0);
  for (const char* camera : {"camera0_", "camera1_"}) {
    EXPECT_EQ(devices[camera + std::string("delivered")], kPairs);
    EXPECT_EQ(devices[camera + std::string("lost")], 0);
    EXPECT_EQ(devices[camera + std::string("underruns")], 0);
  }
  const auto poses = app::read_tum(session / "trajectory.tum");
  ASSERT_EQ(poses.size(), static_cast<std::size_t>(kPairs));
  EXPECT_FALSE(summary.contains("truth") && !summary["truth"].is_null() &&
               summary["truth"].contains("ate_m"))
      << "nobody knows a truth here";
  const double way = path_length(drive.truth);
  EXPECT_GT(way, 5);
  EXPECT_NEAR(path_length(poses) / way, 1, 0.03);
  // By the host's clock the pulses came 100 ms apart; the stamps are the cameras', mapped.
  for (std::size_t i = 1; i < poses.size(); ++i) EXPECT_GT(poses[i].stamp, poses[i - 1].stamp);
}

/// A trigger board on a terminal whose pulses the cameras expose at.
std::unique_ptr<test::BoardSimulator> board_of(const Wires& wires) {
  test::BoardSimulatorOptions o;
  o.power_on = monotonic_now();
  return std::make_unique<test::BoardSimulator>(
      [&wires, n = std::uint64_t{0}](const test::SimulatedPulse& pulse) mutable {
        for (const auto& camera : wires.cameras) camera->pulse(n, pulse.edge);
        ++n;
        return test::SimulatedExposures{};
      },
      o);
}

nlohmann::json summary_of(const std::filesystem::path& session) {
  std::ifstream in(session / "summary.json");
  return nlohmann::json::parse(in);
}

/// With an INS and a board behind terminals, twice as long as the film lasts.
Outcome record_drive(const RenderedDrive& drive, const std::filesystem::path& session) {
  const Wires wires(&drive);
  const test::DeviceOnTerminal ins(test::resting_xsens()), board(board_of(wires));
  return run_vergence("run '" + kExample + "' --duration " + std::to_string(2 * kPairs / kRate) +
                      " --out '" + session.string() + "'" + wires.settings() +
                      " --record images,ins,pulses --set ins.driver=xsens --set ins.rate=100 "
                      "--set ins.baud=115200 --set ins.port=" +
                      ins.port() +
                      " --set trigger.driver=board --set sync.mode=board --set "
                      "trigger.dither_us=4000 --set trigger.port=" +
                      board.port());
}

// In real time, with INS and trigger board on serial lines.
TEST(GigeRun, recordedGigeRunReplaysBitForBit) {
  if (const std::string why = test::socket_buffer_obstacle(); !why.empty()) GTEST_SKIP() << why;
  const RenderedDrive drive;
  const TemporaryFolder folder;
  const Outcome o = record_drive(drive, folder / "s");
  ASSERT_LE(o.code, 1) << o.err;
  const Outcome again = run_vergence("replay '" + (folder / "s").string() + "' --out '" +
                                     (folder / "again").string() + "'");
  ASSERT_LE(again.code, 1) << again.err;
  EXPECT_EQ(test::read_file(folder / "s" / "trajectory.tum"),
            test::read_file(folder / "again" / "trajectory.tum"));
  EXPECT_GT(summary_of(folder / "s")["frames"]["read"].get<int>(), 4);
}

}  // namespace
}  // namespace vergence
