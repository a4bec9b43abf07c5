#pragma once
#include <array>
#include <string>
#include <vector>

#include "app/checkerboard/board_calibration.hpp"
#include "core/camera/camera.hpp"
#include "core/math/random.hpp"
#include "core/math/se3.hpp"

namespace vergence::test {

/// Side by side, 12 cm apart, a little turned: lenses of a common machine-vision rig.
inline RigCalibration known_rig(int cameras, CameraModelKind kind) {
  RigCalibration rig{.cameras = cameras};
  for (int k = 0; k < cameras; ++k) {
    Intrinsics& lens = rig.intrinsics[static_cast<std::size_t>(k)];
    const bool radtan = kind == CameraModelKind::pinhole_radtan;
    const double f = radtan ? 520 : 290;
    lens = {kind, 640, 480, f + 3 * k, f + 1 + 2 * k, 322.0 - 2 * k, 238.0 + 3 * k};
    lens.distortion = radtan ? std::array{-0.28, 0.09, 0.0008, -0.0005, 0.0}
                             : std::array{-0.02, 0.008, -0.004, 0.0008, 0.0};
    if (k > 0)
      rig.T_camera_left[static_cast<std::size_t>(k)] = {exp_so3(Vec3(0.006, -0.004 * k, 0.003)),
                                                        Vec3(-0.12 * k, 0.001, -0.002 * k)};
  }
  rig.baseline = cameras > 1 ? rig.T_camera_left[1].t.norm() : 0;
  return rig;
}

/// A board held in front of the rig: how far, how tilted and where in the image changes from view
/// to view.
inline Transform held_board(const app::BoardPattern& board, const Intrinsics& lens, int view,
                            Random& random) {
  const double width = board.square * (board.columns - 1), height = board.square * (board.rows - 1);
  // The board fills 35 to 65 % of the image's width.
  const double far = lens.fx * width / (lens.width * (0.35 + 0.1 * (view % 4)));
  const double tilt = 0.35 + 0.25 * random.uniform(),
               direction = 2 * M_PI * (view * 0.37 + 0.1 * random.uniform());
  const Mat3 R = exp_so3(tilt * Vec3(std::cos(direction), std::sin(direction), 0)) *
                 exp_so3(Vec3(0, 0, random.uniform(-0.2, 0.2)));
  const double aside = far * 0.14 * lens.width / lens.fx;
  const Vec3 centre(aside * ((view % 3) - 1) + 0.03, aside * 0.8 * (((view / 3) % 3) - 1), far);
  return {R, centre - R * Vec3(0.5 * width, 0.5 * height, 0)};
}

/// Board poses as somebody shows them who reads what is missing: nine places, four tilts, near and
/// far.
inline std::vector<Transform> shown_around(const app::BoardPattern& board,
                                           const RigCalibration& rig) {
  const Intrinsics& lens = rig.intrinsics[0];
  const double width = board.square * (board.columns - 1), height = board.square * (board.rows - 1);
  std::vector<Transform> poses;
  for (int i = 0; i < 18; ++i) {
    const double far = lens.fx * width / (lens.width * (i < 9 ? 0.28 : 0.42));
    const double right = (i % 3 - 1) * (i < 9 ? 0.27 : 0.16),
                 down = ((i / 3) % 3 - 1) * (i < 9 ? 0.28 : 0.22);
    const Vec3 axis = i % 4 == 0   ? Vec3(0, 1, 0)
                      : i % 4 == 1 ? Vec3(0, -1, 0)
                      : i % 4 == 2 ? Vec3(1, 0, 0)
                                   : Vec3(-1, 0, 0);
    const Mat3 R = exp_so3(0.4 * axis);
    const double middle = rig.cameras > 1 ? 0.5 * rig.baseline : 0;
    const Vec3 centre(middle + far * right * lens.width / lens.fx,
                      far * down * lens.height / lens.fx, far);
    poses.push_back({R, centre - R * Vec3(0.5 * width, 0.5 * height, 0)});
  }
  return poses;
}

/// Corners without noise; empty for a camera that does not have the whole board.
inline app::BoardView seen_board(const RigCalibration& rig, const app::BoardPattern& board,
                                 const Transform& T_left_board) {
  app::BoardView seen;
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k) {
    const Camera camera(rig.intrinsics[k]);
    for (std::size_t i = 0; i < board.corners(); ++i) {
      Vec2 x;
      if (camera.project(rig.T_camera_left[k] * (T_left_board * board.corner(i)), &x, nullptr) !=
              ProjectStatus::ok ||
          !camera.inside(x, 4)) {
        seen.corners[k].clear();
        break;
      }
      seen.corners[k].push_back({i, x});
    }
  }
  return seen;
}

/// Corners of `count` board poses with normal noise, px a coordinate. A view is kept where every
/// camera has the whole board.
inline std::vector<app::BoardView> board_views(const RigCalibration& rig,
                                               const app::BoardPattern& board, int count,
                                               double noise_px, std::uint64_t seed) {
  std::vector<app::BoardView> views;
  Random poses(7, 1), noise(seed, 2);
  for (int view = 0; static_cast<int>(views.size()) < count && view < 20 * count; ++view) {
    app::BoardView seen = seen_board(rig, board, held_board(board, rig.intrinsics[0], view, poses));
    seen.name = "view" + std::to_string(view);
    bool whole = true;
    for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k) {
      whole = whole && !seen.corners[k].empty();
      for (app::BoardCorner& c : seen.corners[k])
        c.pixel += noise_px * Vec2(noise.normal(), noise.normal());
    }
    if (whole) views.push_back(seen);
  }
  return views;
}

inline app::BoardCalibrationOptions board_options(const RigCalibration& rig,
                                                  const app::BoardPattern& board) {
  app::BoardCalibrationOptions o{.board = board, .model = rig.intrinsics[0].kind};
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k)
    o.sizes.push_back({rig.intrinsics[k].width, rig.intrinsics[k].height});
  return o;
}

/// (φ, τ) with found = perturbed(true, φ, τ).
inline Vec6 place_error(const Transform& found, const Transform& truth) {
  Vec6 e;
  e << log_so3(found.R * truth.R.transpose()), found.t - truth.t;
  return e;
}

}  // namespace vergence::test
