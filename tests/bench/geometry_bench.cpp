// Times of the geometric solvers on made scenes: 300 points, two cameras, pixels with noise and
// outliers.
#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "core/geometry/mlesac.hpp"
#include "core/geometry/pose_refine.hpp"
#include "core/geometry/three_point.hpp"

namespace {

using namespace vergence;

constexpr std::size_t kPoints = 300;

struct Scene {
  Arena arena{RigMlesac::memory_needed(512) + PoseRefiner::memory_needed(512) +
              RigObservationTable::memory_needed(512)};
  RigMlesac mlesac{512, arena};
  PoseRefiner refiner{512, arena};
  RigObservationTable table{512, arena};
  Transform T_left_world{exp_so3({0.1, -0.3, 0.05}), {1, 2, 3}};
  Random random{1};

  explicit Scene(double outliers) {
    RigCalibration rig;
    rig.cameras = 2;
    for (auto* c : {&rig.intrinsics[0], &rig.intrinsics[1]})
      c->fx = c->fy = 520, c->cx = 320, c->cy = 240;
    rig.T_camera_left[1].t.x() = -0.5;
    table.set_rig(rig);
    for (std::size_t i = 0; i < kPoints; ++i) {
      const double z = random.uniform(2, 40);
      const Vec3 p(random.uniform(-0.6, 0.6) * z, random.uniform(-0.45, 0.45) * z, z);
      const bool bad = random.uniform() < outliers;
      (void)table.push(T_left_world.inverse() * p, 0.3);
      for (int k = 0; k < 2; ++k) {
        const Vec3 q = rig.T_camera_left[static_cast<std::size_t>(k)] * p;
        const double du = bad ? random.uniform(15, 150) : 0.3 * random.normal(),
                     dv = 0.3 * random.normal();
        table.see(k, {520 * q.x() / q.z() + 320 + du, 520 * q.y() / q.z() + 240 + dv});
      }
    }
  }
};

void three_point(benchmark::State& state) {
  Random random(2);
  struct Problem {
    std::array<Vec3, 3> rays, points;
  };
  std::vector<Problem> problems(512);
  const Transform T_world_camera{exp_so3({0.4, 0.2, -0.3}), {3, 1, -2}};
  for (Problem& p : problems)
    for (std::size_t i = 0; i < 3; ++i) {
      const double z = random.uniform(2, 40);
      const Vec3 q(random.uniform(-0.6, 0.6) * z, random.uniform(-0.45, 0.45) * z, z);
      p.rays[i] = q.normalized();
      p.points[i] = T_world_camera * q;
    }
  std::size_t i = 0;
  for (auto _ : state)
    benchmark::DoNotOptimize(solve_three_point(problems[i % 512].rays, problems[i % 512].points)),
        ++i;
}
BENCHMARK(three_point);

void rig_mlesac(benchmark::State& state) {
  Scene scene(static_cast<double>(state.range(0)) / 100);
  int hypotheses = 0, solves = 0;
  for (auto _ : state) {
    const MlesacPose pose = scene.mlesac.solve(scene.table.view(), {}, nullptr, scene.random);
    hypotheses += pose.hypotheses;
    ++solves;
  }
  state.counters["hypotheses"] = static_cast<double>(hypotheses) / solves;
}
BENCHMARK(rig_mlesac)
    ->ArgName("outliers_percent")
    ->Arg(10)
    ->Arg(30)
    ->Arg(50)
    ->Unit(benchmark::kMicrosecond);

void rig_mlesac_100_samples(benchmark::State& state) {
  Scene scene(0.3);
  MlesacOptions options;
  options.min_hypotheses = options.max_hypotheses = 100;
  int hypotheses = 0, solves = 0;
  for (auto _ : state) {
    const MlesacPose pose =
        scene.mlesac.solve(scene.table.view(), options, &scene.T_left_world, scene.random);
    hypotheses += pose.hypotheses;
    ++solves;
  }
  state.counters["hypotheses"] = static_cast<double>(hypotheses) / solves;
}
BENCHMARK(rig_mlesac_100_samples)->Unit(benchmark::kMicrosecond);

void score_two_cameras(
    benchmark::State& state) {  // one hypothesis over 304 observations in each of two cameras
  std::vector<float> column(304, 1.0F);
  const detail::ScoreColumns c{column.data(), column.data(), column.data(), column.data(),
                               column.data(), column.data(), column.data()};
  const detail::ProjectionRows rows{520, 0, 0, 1, 0, 520, 0, 1, 0, 0, 1, 3};
  for (auto _ : state)
    benchmark::DoNotOptimize(detail::projection_cost(c, 0, 304, rows, 1e-3F) +
                             detail::projection_cost(c, 0, 304, rows, 1e-3F));
}
BENCHMARK(score_two_cameras);

void pose_refine(benchmark::State& state) {
  Scene scene(0.1);
  int steps = 0, solves = 0;
  const Transform start =
      perturbed(scene.T_left_world, {0.002, -0.001, 0.001}, {0.02, 0.01, -0.02});
  for (auto _ : state) {
    const RefinedPose pose = scene.refiner.refine(scene.table.view(), start, {}, {});
    steps += pose.steps;
    ++solves;
  }
  state.counters["steps"] = static_cast<double>(steps) / solves;
}
BENCHMARK(pose_refine)->Unit(benchmark::kMicrosecond);

}  // namespace
