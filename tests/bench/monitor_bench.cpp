// Time of the monitor for a frame: matches across alone, with motion tracks, and while a knock
// keeps it searching for the onset.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <numbers>
#include <unordered_map>
#include <vector>

#include "core/calibration/monitor.hpp"
#include "core/calibration/motion_track_builder.hpp"
#include "tests/support/feature_drive.hpp"

namespace {

using namespace vergence;
using namespace vergence::calibration;

constexpr std::size_t kMotionTracks = 200;
constexpr std::size_t kPairing = 5;  // frames between the two observations of a motion track

/// Frames with 300 matches across each; where asked, every one of them with 200 motion tracks,
/// which a drive has in one of eight.
struct Recorded {
  struct Frame {
    MonitorFrame frame;
    std::vector<StereoObservation> stereo;
    std::vector<MotionTrack> motion;
    Transform T_left_world;
  };
  std::vector<Frame> frames{400};
  test::FeatureDriveOptions options;
  std::size_t fewest_stereo = 1000, fewest_motion = 1000;

  Recorded(bool with_motion, double yaw_deg) {
    options.tracks = 320;
    options.shortest_life = 20, options.longest_life = 40;
    test::FeatureDrive drive(options);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      drive.next();
      Frame& f = frames[i];
      f.T_left_world = drive.T_left_world();
      for (const test::FeatureTrack& t :
           drive.tracks().first(std::min<std::size_t>(300, drive.tracks().size())))
        f.stereo.push_back({t.left, t.right, t.sigma_px, t.id});
      f.frame.stamp = drive.stamp();
      f.frame.frame = drive.frame();
      f.frame.moving = true;
      f.frame.T_now_previous = drive.T_now_previous();
      f.frame.expected_stereo = f.frame.found_stereo = static_cast<int>(f.stereo.size());
      fewest_stereo = std::min(fewest_stereo, f.stereo.size());
      if (!with_motion || i < 2 * kPairing) continue;
      const Frame& before = frames[i - kPairing];
      std::unordered_map<std::uint32_t, const StereoObservation*> earlier;
      for (const StereoObservation& s : before.stereo) earlier[s.track] = &s;
      for (const StereoObservation& s : f.stereo) {
        const auto it = earlier.find(s.track);
        if (it != earlier.end() && f.motion.size() < kMotionTracks)
          f.motion.push_back(
              {it->second->left, it->second->right, s.left, s.right, s.sigma_px, s.track});
      }
      fewest_motion = std::min(fewest_motion, f.motion.size());
      f.frame.before = before.frame.frame;
      f.frame.T_now_before = f.T_left_world * before.T_left_world.inverse();
      f.frame.T_before_earlier = before.frame.T_now_previous;
    }
    for (Frame& f : frames) f.frame.stereo = f.stereo, f.frame.motion = f.motion;
    options.T_right_left.R =
        exp_so3({0, yaw_deg * std::numbers::pi / 180, 0}) * options.T_right_left.R;
  }
};

void look(benchmark::State& state, bool with_motion, double yaw_deg) {
  const Recorded recorded(with_motion, yaw_deg);
  Arena arena(Monitor::memory_needed({}));
  Monitor monitor({}, arena);
  (void)monitor.set_reference(recorded.options.T_right_left, recorded.options.left,
                              recorded.options.right, Mat6::Zero());
  std::uint64_t n = 0;
  bool alarm = false;
  for (auto _ : state) {
    MonitorFrame f = recorded.frames[20 + n % (recorded.frames.size() - 20)].frame;
    const std::uint64_t gap = f.frame - f.before;
    f.frame = 20 + n++;
    f.before = f.frame - gap;
    const MonitorVerdict v = monitor.look(f);
    alarm = v.kind != MonitorVerdict::Kind::quiet;
    benchmark::DoNotOptimize(v.statistic);
  }
  state.counters["across"] = static_cast<double>(recorded.fewest_stereo);
  state.counters["motion"] = with_motion ? static_cast<double>(recorded.fewest_motion) : 0.0;
  state.counters["alarm"] = alarm ? 1 : 0;
}

BENCHMARK_CAPTURE(look, stereo, false, 0.0)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(look, stereo_and_motion, true, 0.0)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(look, stereo_and_motion_knocked, true, 0.3)->Unit(benchmark::kMicrosecond);

}  // namespace
