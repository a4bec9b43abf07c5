// Matches between two images of which nothing is known: SURF-64 beside the project's own corners,
// on the mock's streets and on recorded excerpts.
//
//   front_end_bench [--pairs N] [--data mock|euroc|kitti]… [--surf-response X] [--surf-room N]
//   [--set KEY=VALUE]… [--markdown FILE]
//
// Across: left to right of one frame, as the first pair of a rig that nobody has calibrated. In
// time: left to left of successive frames. The five-point transform of StereoMlesac is compared
// with the truth (mock) or with what the data set publishes.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "app/config/configuration.hpp"
#include "app/datasets/image_file.hpp"
#include "app/datasets/stereo_sequence.hpp"
#include "app/datasets/trajectory_files.hpp"
#include "core/features/surf_match.hpp"
#include "core/geometry/stereo_mlesac.hpp"
#include "core/math/so3.hpp"
#include "core/odometry/front_end.hpp"
#include "tests/support/rendered_drive.hpp"
#include "tests/support/shared_data.hpp"

namespace {

using namespace vergence;

constexpr int kManyCorners = 1000;  // the most that may be asked for
constexpr double kNearLine =
    1.0;  // px to the true epipolar line: a match this near counts as right

struct Arguments {
  int pairs = 24;
  std::vector<std::string> data;
  std::vector<std::string> set;
  features::SurfOptions surf;
  std::size_t surf_room = 1500;  // points an image
  std::string markdown;
};

/// Two images with their cameras, and where the second stood.
struct ImagePair {
  std::array<ImageView, 2> images{};
  std::array<Intrinsics, 2> intrinsics{};
  Transform T_second_first{};
};

/// In ideal pixels, with the sigma that the front end claims.
using Matches = std::vector<odometry::FreeMatch>;

/// Of the processor: other programs do not count.
double milliseconds_since(std::clock_t start) {
  return 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

/// What the estimator uses on the first pair: corners with binary descriptors, or upright SURF-64,
/// mutually best, then aligned.
Matches match_freely(const ImagePair& pair, const OdometryOptions& options, double* ms) {
  RigCalibration rig;
  rig.cameras = 2;
  rig.intrinsics[0] = pair.intrinsics[0];
  rig.intrinsics[1] = pair.intrinsics[1];
  Arena arena(odometry::FrontEnd::memory_needed(options, rig));
  SequentialRunner one;
  odometry::FrontEnd front(options, rig, arena, one);
  RigFrame frame;
  frame.cameras = 2;
  frame.images[0] = pair.images[0];
  frame.images[1] = pair.images[1];
  const std::clock_t start = std::clock();
  (void)front.begin(frame);
  const std::span<const odometry::FreeMatch> found = front.match_free(1);
  *ms = milliseconds_since(start);
  return {found.begin(), found.end()};
}

/// The same corners followed from where they stand, coarse to fine, without looking for them
/// elsewhere: for small motions.
Matches follow_corners(const ImagePair& pair, const OdometryOptions& options, double* ms) {
  constexpr int kCoarsest = 3;
  const Intrinsics& c = pair.intrinsics[0];
  const auto room = static_cast<std::size_t>(options.features);
  Arena arena(2 * features::Pyramid::memory_needed(c.width, c.height, options.pyramid_levels) +
              room * sizeof(features::Corner) + kCacheLine);
  features::Pyramid first(c.width, c.height, options.pyramid_levels, arena),
      second(c.width, c.height, options.pyramid_levels, arena);
  BoundedVector<features::Corner> corners(arena.make<features::Corner>(room, "corners"));
  const odometry::UndistortedCamera lens(c);
  SequentialRunner one;
  const std::clock_t start = std::clock();
  first.build(pair.images[0]);
  second.build(pair.images[1]);
  features::CornerOptions where;
  where.cell =
      std::clamp(static_cast<int>(std::sqrt(c.width * c.height / (1.6 * options.features))), 12,
                 features::kMaxCell);
  where.min_distance = 0.5F * static_cast<float>(where.cell);
  features::find_corners(first.level(0), where, {}, one, &corners);
  features::AlignOptions how;
  how.coarsest = kCoarsest;
  how.min_zncc = 0.7F;
  how.max_shift = 8 << kCoarsest;
  Matches matches;
  features::Patch patch;
  for (const features::Corner& corner : corners) {
    const Vec2 at(corner.x, corner.y);
    if (!features::cut_patch(first, at, &patch)) continue;
    const features::AlignResult a = features::align(patch, second, at, Mat2::Identity(), how);
    odometry::FreeMatch m;
    double magnification = 1;
    if (a.status != features::AlignStatus::ok || !lens.undistort(at, &m.left, &magnification) ||
        !lens.undistort(a.pixel, &m.other, &magnification))
      continue;
    m.sigma = options.pixel_sigma * magnification;
    matches.push_back(m);
  }
  *ms = milliseconds_since(start);
  return matches;
}

/// Blobs of both images, described, mutually best.
Matches match_surf(const ImagePair& pair, const Arguments& a, bool upright, double* ms) {
  // A blob's place is as sure as the distance between the places its response is sampled at.
  constexpr double kSigmaOfScale = 0.15;
  const Intrinsics& c = pair.intrinsics[0];
  const std::size_t room = a.surf_room;
  Arena arena(2 * features::Surf::memory_needed(c.width, c.height) +
              features::SurfMatcher::memory_needed(room) +
              room * (2 * (sizeof(features::SurfPoint) + sizeof(features::SurfDescriptor)) +
                      sizeof(features::SurfMatch)) +
              8 * kCacheLine);
  features::Surf surf(c.width, c.height, arena);
  features::SurfMatcher matcher(room, arena);
  std::array<BoundedVector<features::SurfPoint>, 2> points;
  std::array<std::span<features::SurfDescriptor>, 2> descriptors;
  for (std::size_t k = 0; k < 2; ++k) {
    points[k] = BoundedVector<features::SurfPoint>(arena.make<features::SurfPoint>(room, "blobs"));
    descriptors[k] = arena.make<features::SurfDescriptor>(room, "descriptors");
  }
  BoundedVector<features::SurfMatch> found(arena.make<features::SurfMatch>(room, "matches"));
  const std::array<odometry::UndistortedCamera, 2> lens{
      odometry::UndistortedCamera(pair.intrinsics[0]),
      odometry::UndistortedCamera(pair.intrinsics[1])};
  const std::clock_t start = std::clock();
  std::array<features::SurfView, 2> views;
  for (std::size_t k = 0; k < 2; ++k) {
    if (surf.set_image(pair.images[k]) != features::SurfStatus::ok) return {};
    (void)surf.detect(a.surf, &points[k]);
    if (!upright) surf.orient(points[k].span());
    surf.describe(points[k].span(), descriptors[k].first(points[k].size()));
    views[k] = {points[k].span(), descriptors[k].first(points[k].size())};
  }
  if (matcher.match(views[0], views[1], {}, nullptr, &found) != features::SurfMatchStatus::ok)
    return {};
  Matches matches;
  for (const features::SurfMatch& f : found) {
    const features::SurfPoint &p = points[0][f.left], &q = points[1][f.right];
    const Vec2 left(static_cast<double>(p.x), static_cast<double>(p.y));
    const Vec2 right(static_cast<double>(q.x), static_cast<double>(q.y));
    const double sigma = kSigmaOfScale * static_cast<double>(std::max(p.scale, q.scale));
    odometry::FreeMatch m;
    double magnification = 1;
    if (!lens[0].undistort(left, &m.left, &magnification) ||
        !lens[1].undistort(right, &m.other, &magnification))
      continue;
    m.sigma = sigma * magnification;
    matches.push_back(m);
  }
  *ms = milliseconds_since(start);
  return matches;
}

/// Of one pair.
struct Measured {
  double matches = 0, right = 0, inliers = 0;
  double off_px = 0;  // median distance to the true epipolar line of the matches within 3 px of it
  double turn_deg = 180, direction_deg = 180;
  double ms = 0;
};

double angle_between(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

double median(std::vector<double> v, double q = 0.5) {
  if (v.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(v.begin(), v.end());
  return v[static_cast<std::size_t>(q * static_cast<double>(v.size() - 1) + 0.5)];
}

Measured measure(const ImagePair& pair, const Matches& matches, double ms) {
  constexpr double kClearlyWrong = 3.0;  // px: another thing than the corner or blob itself
  Measured m;
  m.ms = ms;
  m.matches = static_cast<double>(matches.size());
  std::vector<double> lx, ly, rx, ry, sigma, off;
  const EpipolarGeometry truth(pair.T_second_first);
  for (const odometry::FreeMatch& f : matches) {
    const auto ray = [](const Intrinsics& c, const Vec2& p) {
      return Vec2((p.x() - c.cx) / c.fx, (p.y() - c.cy) / c.fy);
    };
    const Vec2 l = ray(pair.intrinsics[0], f.left), r = ray(pair.intrinsics[1], f.other);
    lx.push_back(l.x());
    ly.push_back(l.y());
    rx.push_back(r.x());
    ry.push_back(r.y());
    sigma.push_back(f.sigma / pair.intrinsics[0].fx);
    double d = 0;
    if (truth.to_line(l, r, &d, nullptr) != EpipolarStatus::ok) continue;
    d = std::abs(d) * pair.intrinsics[1].fx;
    m.right += d < kNearLine ? 1 : 0;
    if (d < kClearlyWrong) off.push_back(d);
  }
  m.off_px = median(off);
  Arena arena(StereoMlesac::memory_needed(matches.size() + 1));
  StereoMlesac mlesac(matches.size() + 1, arena);
  Random random(1);
  const StereoEstimate e = mlesac.estimate_stereo_transform(
      {lx, ly, rx, ry, sigma}, pair.T_second_first.t.norm(), StereoMlesacOptions{}, random);
  if (e.status != StereoMlesacStatus::ok) return m;
  m.inliers = e.inliers;
  m.turn_deg =
      log_so3(e.T_right_left.R * pair.T_second_first.R.transpose()).norm() * 180 / std::numbers::pi;
  m.direction_deg = angle_between(e.T_right_left.t, pair.T_second_first.t);
  return m;
}

/// The median over the pairs of one data set, as a row.
struct Row {
  std::string data, task, front_end;
  std::vector<Measured> all;
  [[nodiscard]] double at(double Measured::*what, double q = 0.5) const {
    std::vector<double> v;
    for (const Measured& m : all) v.push_back(m.*what);
    return median(v, q);
  }
  [[nodiscard]] std::string line() const {
    double right = 0, matches = 0;
    for (const Measured& m : all) {
      right += m.right;
      matches += m.matches;
    }
    return fmt::format(
        "| {} | {} | {} | {:.0f} | {:.0f} % | {:.0f} | {:.2f} | {:.3f} / {:.3f} | {:.2f} / {:.2f} "
        "| {:.0f} |\n",
        data, task, front_end, at(&Measured::matches), 100 * right / std::max(1.0, matches),
        at(&Measured::inliers), at(&Measured::off_px), at(&Measured::turn_deg),
        at(&Measured::turn_deg, 0.9), at(&Measured::direction_deg),
        at(&Measured::direction_deg, 0.9), at(&Measured::ms));
  }
};

constexpr const char* kHeader =
    "| data | pair | front end | matches | right | inliers | px off | rotation ° | direction ° | "
    "ms |\n"
    "|---|---|---|---|---|---|---|---|---|---|\n";

class Table {
 public:
  explicit Table(const Arguments& a)
      : a_(a),
        odometry_(app::load_configuration(std::nullopt, a.set).odometry),
        many_(odometry_),
        blobs_(odometry_) {
    odometry_.first_pair = many_.first_pair = 0;
    blobs_.first_pair = 1;
    many_.features = blobs_.features = kManyCorners;
  }

  void add(const std::string& data, bool stereo, const ImagePair& pair) {
    double ms = 0;
    const std::string task = stereo ? "across" : "in time";
    const auto one = [&](const char* name, const Matches& matches) {
      row(data, task, name).all.push_back(measure(pair, matches, ms));
    };
    one("corners", match_freely(pair, odometry_, &ms));
    one("corners, 1000", match_freely(pair, many_, &ms));
    if (!stereo) one("corners followed", follow_corners(pair, odometry_, &ms));
    one("SURF-64", match_surf(pair, a_, false, &ms));
    one("SURF-64 upright", match_surf(pair, a_, true, &ms));
    one("SURF-64 upright, aligned", match_freely(pair, blobs_, &ms));
  }
  [[nodiscard]] std::string text() const {
    std::string s = kHeader;
    for (const Row& r : rows_) s += r.line();
    return s;
  }

 private:
  Row& row(const std::string& data, const std::string& task, const std::string& name) {
    for (Row& r : rows_)
      if (r.data == data && r.task == task && r.front_end == name) return r;
    rows_.push_back({data, task, name, {}});
    return rows_.back();
  }
  const Arguments& a_;
  OdometryOptions odometry_, many_, blobs_;
  std::vector<Row> rows_;
};

struct Copy {
  cv::Mat pixels;
  [[nodiscard]] ImageView view(const Intrinsics& c) const {
    return {pixels.data, c.width, c.height, static_cast<std::ptrdiff_t>(pixels.step)};
  }
};

void run_mock(const Arguments& a, Table* table) {
  const mock::DriveOptions drive;
  for (const double from : test::RenderedDrive::starts(drive, a.pairs, 3.0, 1.0)) {
    test::RenderedDriveOptions o;
    o.drive = drive;
    o.from_s = from;
    test::RenderedDrive rendered(o);
    const Intrinsics& c = o.rig.intrinsics[0];
    const RigFrame& frame = rendered.frame(0);
    table->add(
        "mock", true,
        {{frame.images[0], frame.images[1]}, {c, o.rig.intrinsics[1]}, o.rig.T_camera_left[1]});
    Copy first{cv::Mat(c.height, static_cast<int>(frame.images[0].stride), CV_8U)};
    for (int y = 0; y < c.height; ++y)
      std::copy_n(frame.images[0].row(y), frame.images[0].stride, first.pixels.ptr(y));
    const RigFrame& next = rendered.frame(1);
    table->add("mock", false,
               {{first.view(c), next.images[0]},
                {c, c},
                rendered.T_enu_left(1).inverse() * rendered.T_enu_left(0)});
  }
}

Copy read(const app::StereoSequence& s, std::size_t pair, std::size_t k) {
  const Intrinsics& c = s.calibration.intrinsics[k];
  std::vector<std::uint8_t> bytes;
  Copy image{cv::Mat(c.height, (c.width + 63) / 64 * 64, CV_8U)};
  const std::filesystem::path file = s.root / s.pairs[pair].file[k];
  if (app::read_image_file(file, &bytes) != app::ImageFileStatus::ok ||
      app::decode_grey(bytes, {c.width, c.height}, image.pixels.data, image.pixels.step) !=
          app::ImageFileStatus::ok)
    throw std::runtime_error(file.string() + ": cannot be decoded");
  return image;
}

/// The true pose nearest in time, at most 5 ms away.
std::optional<Transform> pose_at(const app::Trajectory& truth, Stamp stamp) {
  const StampedPose* best = nullptr;
  for (const StampedPose& p : truth)
    if (best == nullptr ||
        std::abs(p.stamp.ns() - stamp.ns()) < std::abs(best->stamp.ns() - stamp.ns()))
      best = &p;
  if (best == nullptr || std::abs(best->stamp.ns() - stamp.ns()) > 5'000'000) return std::nullopt;
  return best->T_world_body;
}

void run_recorded(const Arguments& a, const std::string& name, Table* table) {
  const bool euroc = name == "euroc";
  const char* const below = euroc ? "data/euroc_mh01" : "data/kitti06_51";
  const auto folder = test::shared_data(below);
  if (!folder) {
    fmt::print(stderr, "{}: {}\n", name, test::shared_data_missing(below));
    return;
  }
  const app::StereoSequence s =
      app::open_sequence(euroc ? app::SequenceFormat::euroc : app::SequenceFormat::kitti, *folder);
  const app::Trajectory truth = app::read_trajectory(*folder);
  const Intrinsics& c = s.calibration.intrinsics[0];
  const auto last = static_cast<int>(s.pairs.size()) - 1;
  for (int i = 0; i < a.pairs; ++i) {
    const auto n = static_cast<std::size_t>(last * i / a.pairs);
    const Copy left = read(s, n, 0), right = read(s, n, 1), next = read(s, n + 1, 0);
    table->add(name, true,
               {{left.view(c), right.view(s.calibration.intrinsics[1])},
                {c, s.calibration.intrinsics[1]},
                s.calibration.T_camera_left[1]});
    const auto before = pose_at(truth, s.pairs[n].stamp),
               after = pose_at(truth, s.pairs[n + 1].stamp);
    constexpr double kLeastMotion = 0.02;  // m: shorter ways of EuRoC's truth have no direction
    if (!before || !after || (after->t - before->t).norm() < kLeastMotion) continue;
    table->add(name, false, {{left.view(c), next.view(c)}, {c, c}, after->inverse() * *before});
  }
}

Arguments parse(int argc, char** argv) {
  Arguments a;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto value = [&]() -> std::string {
      if (i + 1 >= argc) throw std::runtime_error(word + " needs a value");
      return argv[++i];
    };
    if (word == "--pairs")
      a.pairs = std::stoi(value());
    else if (word == "--data")
      a.data.push_back(value());
    else if (word == "--surf-response")
      a.surf.min_response = std::stof(value());
    else if (word == "--surf-room")
      a.surf_room = std::stoul(value());
    else if (word == "--set")
      a.set.push_back(value());
    else if (word == "--markdown")
      a.markdown = value();
    else
      throw std::runtime_error("unknown argument " + word);
  }
  if (a.data.empty()) a.data = {"mock", "euroc", "kitti"};
  return a;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const Arguments arguments = parse(argc, argv);
    Table table(arguments);
    for (const std::string& data : arguments.data) {
      if (data == "mock")
        run_mock(arguments, &table);
      else if (data == "euroc" || data == "kitti")
        run_recorded(arguments, data, &table);
      else
        throw std::runtime_error("no data named " + data);
    }
    fmt::print("{}", table.text());
    if (!arguments.markdown.empty()) std::ofstream(arguments.markdown) << table.text();
    return 0;
  } catch (const std::exception& e) {
    fmt::print(stderr, "front_end_bench: {}\n", e.what());
    return 2;
  }
}
