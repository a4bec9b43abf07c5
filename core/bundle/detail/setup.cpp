#include "core/bundle/detail/setup.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace vergence::detail {
namespace {

// Maximum entry of RᵀR − I of a rotation with rounding.
constexpr double kOrthonormal = 1e-6;

bool refuse(BundleResult* result, BundleTermination termination) noexcept {
  result->termination = termination;
  return false;
}

bool rigid(const Transform& T) noexcept {
  return T.finite() &&
         (T.R.transpose() * T.R - Mat3::Identity()).cwiseAbs().maxCoeff() < kOrthonormal &&
         T.R.determinant() > 0;
}

bool usable(const Intrinsics& k) noexcept {
  for (const double v : parameters(k))
    if (!std::isfinite(v)) return false;
  return k.fx > 0 && k.fy > 0;
}

bool check_sizes(const BundleWorkspace& w, const BundleProblem& p, const BundleOptions& o,
                 BundleResult* r) noexcept {
  const bool mono = o.configuration == BundleConfiguration::parallel_monocular;
  const auto as_many = [](std::size_t n, std::size_t of) { return n == of || n == 0; };
  if (p.cameras.empty() || p.cameras.size() > kMaxCameras || p.T_left_world.empty() ||
      !as_many(p.pose_constant.size(), p.T_left_world.size()) ||
      !as_many(p.squared_residuals.size(), p.observations.size()) ||
      (mono ? !as_many(p.T_camera_left.size(), p.cameras.size())
            : p.T_camera_left.size() != p.cameras.size()))
    return refuse(r, BundleTermination::invalid_input);
  if (p.cameras.size() > w.capacity.cameras || p.T_left_world.size() > w.capacity.poses ||
      p.points.size() > w.capacity.points || p.observations.size() > w.capacity.observations ||
      (o.configuration == BundleConfiguration::stereo_calibration && !w.capacity.shared))
    return refuse(r, BundleTermination::capacity);
  return true;
}

/// Checks that the start has finite numbers and valid rotations.
bool check_state(const BundleProblem& p, const BundleOptions& o) noexcept {
  for (const Vec3& point : p.points)
    if (!point.allFinite()) return false;
  for (const Transform& T : p.T_left_world)
    if (!rigid(T)) return false;
  const bool mono = o.configuration == BundleConfiguration::parallel_monocular;
  for (std::size_t k = 0; k < p.cameras.size(); ++k) {
    if (!usable(p.cameras[k].intrinsics())) return false;
    if (mono) continue;
    if (!rigid(p.T_camera_left[k])) return false;
    if (k == 0 && !(p.T_camera_left[0].R.isIdentity(kOrthonormal) &&
                    p.T_camera_left[0].t.norm() < kOrthonormal))
      return false;
    // A length constraint needs a direction.
    if (k > 0 && o.configuration == BundleConfiguration::stereo_calibration &&
        o.length[k].kind != BundleLength::free && !(p.T_camera_left[k].t.norm() > kOrthonormal))
      return false;
  }
  return true;
}

/// Checks indices, order and values of the observations, finds where those of each point begin, and
/// counts those of each pose.
bool check_observations(BundleWorkspace& w, const BundleProblem& p, BundleResult* r) noexcept {
  std::fill(w.pose_observations.begin(), w.pose_observations.end(), 0U);
  const std::size_t points = p.points.size(), poses = p.T_left_world.size(),
                    cameras = p.cameras.size();
  std::uint32_t* const pose_observations = w.pose_observations.data();
  std::size_t next_point = 0;
  std::uint64_t last = 0;
  for (std::size_t i = 0; i < p.observations.size(); ++i) {
    const BundleObservation& o = p.observations[i];
    if (o.point >= points || o.pose >= poses || o.camera >= cameras)
      return refuse(r, BundleTermination::invalid_input);
    const std::uint64_t key = (static_cast<std::uint64_t>(o.point) << 24U) |
                              (static_cast<std::uint64_t>(o.pose) << 8U) | o.camera;
    if (i > 0 && key <= last) return refuse(r, BundleTermination::invalid_input);
    last = key;
    if (!std::isfinite(o.x) || !std::isfinite(o.y) || !std::isfinite(o.inverse_sigma) ||
        !(o.inverse_sigma > 0))
      return refuse(r, BundleTermination::invalid_input);
    while (next_point <= o.point) w.first_observation[next_point++] = static_cast<std::uint32_t>(i);
    ++pose_observations[o.pose];
  }
  while (next_point <= p.points.size())
    w.first_observation[next_point++] = static_cast<std::uint32_t>(p.observations.size());
  return true;
}

/// Numbers the free poses, each of which must be determined by observations.
bool check_poses(BundleWorkspace& w, const BundleProblem& p, const BundleOptions& o,
                 BundleResult* r) noexcept {
  w.free_poses = 0;
  bool anchored = false;
  for (std::size_t i = 0; i < p.T_left_world.size(); ++i) {
    const bool constant = p.pose_constant.empty() ? i == 0 : p.pose_constant[i] != 0;
    anchored = anchored || constant;
    w.poses[i].block = constant ? -1 : w.free_poses++;
  }
  if (!anchored) return refuse(r, BundleTermination::invalid_input);
  for (std::size_t i = 0; i < p.T_left_world.size(); ++i) {
    if (w.poses[i].block >= 0 && w.pose_observations[i] == 0)
      return refuse(r, BundleTermination::rank_deficient);
  }
  if (static_cast<std::size_t>(w.free_poses) * kBlock +
              static_cast<std::size_t>(shared_layout(p, o, false).blocks) * kBlock ==
          0 &&
      p.points.empty())
    return refuse(r, BundleTermination::invalid_input);
  return true;
}

/// Sorts the points with observations so that those seen by the same poses are adjacent.
bool order_points(BundleWorkspace& w, const BundleProblem& p, BundleResult* r) noexcept {
  w.point_count = 0;
  for (std::size_t i = 0; i < p.points.size(); ++i) {
    const std::uint32_t begin = w.first_observation[i], end = w.first_observation[i + 1];
    if (begin == end) continue;
    if (end - begin < 2) return refuse(r, BundleTermination::rank_deficient);
    const std::uint64_t first = p.observations[begin].pose, last = p.observations[end - 1].pose;
    w.order[w.point_count++] = (first << 48U) | (last << 32U) | i;
  }
  const auto used = w.order.first(w.point_count);
  if (!std::is_sorted(used.begin(), used.end())) std::sort(used.begin(), used.end());
  return true;
}

/// Number of slots before camera k for every set of cameras, [set][k]; [set][kMaxCameras] is the
/// total.
constexpr auto kSlotsBefore = [] {
  std::array<std::array<std::uint8_t, kMaxCameras + 1>, 1U << kMaxCameras> table{};
  for (unsigned set = 0; set < table.size(); ++set)
    for (unsigned k = 0; k <= kMaxCameras; ++k)
      table[set][k] = static_cast<std::uint8_t>(std::popcount(set & ((1U << k) - 1U)));
  return table;
}();

/// Lays out the images of one batch, the union of those that see its points. Returns false if a
/// capacity is exceeded.
bool lay_out_batch(BundleWorkspace& w, const BundleProblem& p, std::size_t index) noexcept {
  Batch& batch = w.batches[index];
  batch.lanes =
      static_cast<std::uint32_t>(std::min<std::size_t>(kBatch, w.point_count - index * kBatch));
  batch.block_begin = static_cast<std::uint32_t>(w.block_count);
  const BundleObservation* const observations = p.observations.data();
  const std::uint32_t* const first_observation = w.first_observation.data();
  std::uint8_t* const pose_cameras = w.pose_cameras.data();
  std::uint32_t* const pose_slot = w.pose_slot.data();
  std::size_t lowest = p.T_left_world.size(), highest = 0;
  const auto point_of = [&](std::size_t lane) {
    return static_cast<std::uint32_t>(w.order[index * kBatch + lane]);
  };
  for (std::size_t lane = 0; lane < batch.lanes; ++lane) {
    const std::uint32_t begin = first_observation[point_of(lane)],
                        end = first_observation[point_of(lane) + 1];
    for (std::uint32_t i = begin; i < end; ++i)
      pose_cameras[observations[i].pose] = static_cast<std::uint8_t>(
          pose_cameras[observations[i].pose] | (1U << observations[i].camera));
    lowest = std::min<std::size_t>(lowest, observations[begin].pose);
    highest = std::max<std::size_t>(highest, observations[end - 1].pose);
  }
  bool room = true;
  for (std::size_t pose = lowest; pose <= highest; ++pose) {
    const std::uint8_t cameras = pose_cameras[pose];
    if (cameras == 0) continue;
    const std::size_t count = kSlotsBefore[cameras][kMaxCameras];
    if (w.block_count == w.blocks.size() || w.slot_count + count > w.slots.size()) {
      room = false;
      break;
    }
    w.blocks[w.block_count++] = {static_cast<std::uint32_t>(w.slot_count),
                                 static_cast<std::uint16_t>(pose), cameras};
    pose_slot[pose] = static_cast<std::uint32_t>(w.slot_count);
    std::fill_n(w.slots.begin() + static_cast<std::ptrdiff_t>(w.slot_count), count, Slot{});
    w.slot_count += count;
  }
  Slot* const slots = w.slots.data();
  std::uint32_t* const observation_lane = w.observation_lane.data();
  for (std::size_t lane = 0; lane < batch.lanes && room; ++lane) {
    const std::uint32_t end = first_observation[point_of(lane) + 1];
    for (std::uint32_t i = first_observation[point_of(lane)]; i < end; ++i) {
      const BundleObservation& o = observations[i];
      const std::uint32_t slot = pose_slot[o.pose] + kSlotsBefore[pose_cameras[o.pose]][o.camera];
      slots[slot].x[lane] = o.x;
      slots[slot].y[lane] = o.y;
      slots[slot].inverse_sigma[lane] = static_cast<double>(o.inverse_sigma);
      observation_lane[i] = slot * kBatch + static_cast<std::uint32_t>(lane);
    }
  }
  if (lowest <= highest)
    std::fill(pose_cameras + lowest, pose_cameras + highest + 1, std::uint8_t{0});
  batch.block_end = static_cast<std::uint32_t>(w.block_count);
  return room;
}

bool same_poses(const BundleWorkspace& w, const Batch& a, const Batch& b) noexcept {
  const auto begin = w.blocks.begin();
  return std::equal(begin + a.block_begin, begin + a.block_end, begin + b.block_begin,
                    begin + b.block_end,
                    [](const PoseBlock& x, const PoseBlock& y) { return x.pose == y.pose; });
}

}  // namespace

std::array<double, kIntrinsicsSize> parameters(const Intrinsics& k) noexcept {
  return {k.fx,
          k.fy,
          k.cx,
          k.cy,
          k.distortion[0],
          k.distortion[1],
          k.distortion[2],
          k.distortion[3],
          k.distortion[4]};
}

void set_parameters(Intrinsics& k, const std::array<double, kIntrinsicsSize>& v) noexcept {
  k.fx = v[0];
  k.fy = v[1];
  k.cx = v[2];
  k.cy = v[3];
  for (std::size_t i = 0; i < k.distortion.size(); ++i) k.distortion[i] = v[4 + i];
}

double held_sigma(const BundleIntrinsics& intrinsics, const Intrinsics& k, int parameter) noexcept {
  // Defaults: share of a focal length, and px of a principal point.
  constexpr double kFocalShare = 1e-3, kPrincipalPoint = 0.5;
  const double given = intrinsics.held_sigma[static_cast<std::size_t>(parameter)];
  if (given >= 0) return given;
  return parameter == 0   ? kFocalShare * k.fx
         : parameter == 1 ? kFocalShare * k.fy
         : parameter < 4  ? kPrincipalPoint
                          : 0;
}

SharedLayout shared_layout(const BundleProblem& p, const BundleOptions& o, bool held_too) noexcept {
  SharedLayout s;
  if (o.configuration != BundleConfiguration::stereo_calibration) return s;
  for (std::size_t k = 1; k < p.cameras.size(); ++k) {
    s.extrinsic[k] = s.size;
    s.exact[k] = o.length[k].kind == BundleLength::exact;
    s.size += s.exact[k] ? 5 : 6;
  }
  for (std::size_t k = 0; k < p.cameras.size(); ++k) {
    s.intrinsic[k] = s.size;
    for (int i = 0; i < kIntrinsicsSize; ++i) {
      const bool free = ((o.intrinsics[k].free >> static_cast<unsigned>(i)) & 1U) != 0;
      const bool held = held_too && held_sigma(o.intrinsics[k], p.cameras[k].intrinsics(), i) > 0;
      if (free || held) s.intrinsic_index[k][s.intrinsic_count[k]++] = static_cast<std::uint8_t>(i);
    }
    s.size += s.intrinsic_count[k];
  }
  s.blocks = (s.size + kBlock - 1) / kBlock;
  return s;
}

bool set_up(BundleWorkspace& w, const BundleProblem& p, const BundleOptions& o,
            BundleResult* r) noexcept {
  if (!o.valid()) return refuse(r, BundleTermination::invalid_input);
  if (!check_sizes(w, p, o, r)) return false;
  if (!check_state(p, o)) return refuse(r, BundleTermination::invalid_input);
  if (!check_observations(w, p, r) || !check_poses(w, p, o, r) || !order_points(w, p, r))
    return false;
  w.batch_count = (w.point_count + kBatch - 1) / kBatch;
  w.block_count = w.slot_count = 0;
  std::uint32_t group = 0, in_group = 0;
  for (std::size_t b = 0; b < w.batch_count; ++b) {
    if (!lay_out_batch(w, p, b)) return refuse(r, BundleTermination::capacity);
    if (b > 0 && (in_group == kGroupLimit || !same_poses(w, w.batches[b - 1], w.batches[b]))) {
      ++group;
      in_group = 0;
    }
    ++in_group;
    w.batches[b].group = group;
  }
  BundleState& state = w.states[0];
  for (std::size_t i = 0; i < w.batch_count * kBatch; ++i) {
    const std::size_t batch = i / kBatch, lane = i % kBatch;
    const bool used = i < w.point_count;
    const auto point = used ? static_cast<std::uint32_t>(w.order[i]) : 0U;
    for (std::size_t c = 0; c < 3; ++c)
      state.points[(batch * 3 + c) * kBatch + lane] =
          used ? p.points[point][static_cast<Eigen::Index>(c)] : 0.0;
    w.point_free[i] = used ? 1.0 : 0.0;
  }
  std::copy(p.T_left_world.begin(), p.T_left_world.end(), state.poses.begin());
  for (std::size_t k = 0; k < p.cameras.size(); ++k) {
    state.cameras[k] = p.cameras[k];
    state.T_camera_left[k] = o.configuration == BundleConfiguration::parallel_monocular || k == 0
                                 ? Transform{}
                                 : p.T_camera_left[k];
    if (o.configuration != BundleConfiguration::stereo_calibration || k == 0 ||
        o.length[k].kind != BundleLength::exact)
      continue;
    if (o.length[k].metres > 0)
      state.T_camera_left[k].t *= o.length[k].metres / state.T_camera_left[k].t.norm();
  }
  return true;
}

}  // namespace vergence::detail
