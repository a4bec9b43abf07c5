// Stereo odometry on recorded excerpts: accuracy, time a frame by stage, and a yardstick of the
// machine's speed in the same run.
//
//   odometry_bench [--repeats N] [--threads 1|2] [--set KEY=VALUE]…
//
// Prints the first part of docs/benchmarks.md (scripts/bench).
// Images are decoded beforehand; the clock runs from the decoded pair to the pose. Yardstick:
// OpenCV's pyramidal Lucas–Kanade on 1000 corners of one pair of successive EuRoC left images
// (pyramids included, one thread). A time counts as its ratio to it.
#include <chrono>
#include <cstdio>
#include <fstream>
#include <numbers>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "app/config/configuration.hpp"
#include "app/datasets/stereo_sequence.hpp"
#include "app/datasets/trajectory_files.hpp"
#include "app/runtime/background_thread.hpp"
#include "app/runtime/version.hpp"
#include "core/comparison/trajectory_metrics.hpp"
#include "core/estimator/estimator.hpp"
#include "tests/support/quantile.hpp"
#include "tests/support/shared_data.hpp"

namespace {

using namespace vergence;
using test::quantile;

struct Excerpt {
  const char* name;
  const char* folder;
  app::SequenceFormat format;
  // Lengths of the segments in m.
  std::vector<double> lengths;
};

struct DecodedDrive {
  app::StereoSequence sequence;
  std::vector<std::array<cv::Mat, 2>> pairs;
  app::Trajectory truth;
  // Mean time per pair on one thread.
  double decode_ms = 0;
};

struct Replay {
  std::vector<StampedPose> poses;
  // Time of each frame.
  std::vector<float> milliseconds;
  // Sum over all frames.
  std::array<double, kStages> stage_ms{};
};

struct Arguments {
  int repeats = 10;
  int threads = 2;
  std::vector<std::string> set;
};

/// Results of one excerpt for docs/benchmarks.md.
struct Measured {
  const char* name = "";
  std::size_t frames = 0, posed = 0;
  TrajectoryEvaluation evaluation{};
  // Segment error after the scale and one mounting rotation.
  double without_mount = 0;
  double mean_ms = 0, p50_ms = 0, p99_ms = 0, max_ms = 0, online_mean_ms = 0, decode_ms = 0;
  std::array<double, kStages> stage_ms{};
};

double mean(const std::vector<float>& values) {
  double sum = 0;
  for (const float v : values) sum += v;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

cv::Mat decode(const std::filesystem::path& file, int width, int height) {
  std::vector<std::uint8_t> bytes;
  cv::Mat image(height, (width + 63) / 64 * 64, CV_8U);
  if (app::read_image_file(file, &bytes) != app::ImageFileStatus::ok ||
      app::decode_grey(bytes, {width, height}, image.data, image.step) != app::ImageFileStatus::ok)
    throw std::runtime_error(file.string() + ": cannot be decoded");
  return image;
}

DecodedDrive load(const Excerpt& excerpt, const std::filesystem::path& folder) {
  DecodedDrive d;
  d.sequence = app::open_sequence(excerpt.format, folder);
  d.truth = app::read_trajectory_file(folder).poses;
  const auto start = std::chrono::steady_clock::now();
  for (const app::StereoPair& p : d.sequence.pairs) {
    std::array<cv::Mat, 2> images;
    for (std::size_t k = 0; k < 2; ++k)
      images[k] = decode(d.sequence.root / p.file[k], d.sequence.calibration.intrinsics[k].width,
                         d.sequence.calibration.intrinsics[k].height);
    d.pairs.push_back(std::move(images));
  }
  d.decode_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count() /
      static_cast<double>(d.pairs.size());
  return d;
}

Replay replay(const DecodedDrive& d, const app::Configuration& configuration, int threads,
              bool online) {
  EstimatorOptions options{.odometry = configuration.odometry, .online = online};
  Arena arena;
  SequentialRunner one;
  std::optional<app::ThreadRunner> two;
  if (threads == 2) two.emplace();
  ImmediateRunner at_once;
  // Calibrations are solved on this thread, as in a live run.
  std::optional<app::BackgroundThread> beside;
  if (online) beside.emplace();
  Estimator estimator(options, d.sequence.calibration, d.sequence.calibration, arena,
                      two ? static_cast<PairRunner&>(*two) : one,
                      beside ? static_cast<BackgroundRunner&>(*beside) : at_once);
  Replay r;
  for (std::size_t i = 0; i < d.pairs.size(); ++i) {
    RigFrame frame{.number = i, .stamp = d.sequence.pairs[i].stamp, .cameras = 2};
    for (std::size_t k = 0; k < 2; ++k) {
      const Intrinsics& c = d.sequence.calibration.intrinsics[k];
      frame.images[k] = {d.pairs[i][k].data, c.width, c.height,
                         static_cast<std::ptrdiff_t>(d.pairs[i][k].step)};
    }
    const PoseSample s = estimator.process(frame);
    r.milliseconds.push_back(s.estimate_ms);
    for (std::size_t k = 0; k < kStages; ++k) r.stage_ms[k] += static_cast<double>(s.stage_ms[k]);
    if (s.status != PoseStatus::lost) r.poses.push_back({s.stamp, s.T_world_left});
  }
  return r;
}

double yardstick_ms(const DecodedDrive& euroc) {
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const Intrinsics& c = euroc.sequence.calibration.intrinsics[0];
  const cv::Rect whole(0, 0, c.width, c.height);
  const cv::Mat a = euroc.pairs[0][0](whole), b = euroc.pairs[1][0](whole);
  std::vector<cv::Point2f> corners, found;
  cv::goodFeaturesToTrack(a, corners, 1000, 0.001, 7);
  std::vector<float> times;
  for (int i = 0; i < 15; ++i) {
    std::vector<std::uint8_t> status;
    std::vector<float> error;
    const auto start = std::chrono::steady_clock::now();
    cv::calcOpticalFlowPyrLK(a, b, corners, found, status, error, {21, 21}, 3);
    times.push_back(
        std::chrono::duration<float, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  cv::setNumThreads(threads);
  return quantile(times, 0.5);
}

/// Scaled segment error after the constant rotation between the camera and the body that the truth
/// is of, as fits best: what is left when the data set's own mounting is taken out. Coordinate
/// search over two turns; the roll about the way changes nothing.
double segments_without_mount(const std::vector<StampedPose>& estimate,
                              const app::Trajectory& truth, const EvaluationOptions& options,
                              double scale) {
  const MatchedTrajectories matched = associate(estimate, truth, options);
  const auto error = [&](const Vec3& turn) {
    std::vector<StampedPose> turned = matched.estimate;
    for (StampedPose& p : turned) p.T_world_body.R = p.T_world_body.R * exp_so3(turn);
    return segment_errors(turned, matched.reference, options.segments[1], scale).translation;
  };
  Vec3 best = Vec3::Zero();
  double least = error(best);
  for (double step = 2e-3; step > 2e-5; step /= 2) {
    for (bool better = true; better;) {
      better = false;
      for (const Vec3& axis :
           {Vec3(step, 0, 0), Vec3(-step, 0, 0), Vec3(0, step, 0), Vec3(0, -step, 0)}) {
        const double e = error(best + axis);
        if (!(e < least)) continue;
        least = e;
        best += axis;
        better = true;
      }
    }
  }
  return least;
}

Measured measure(const Excerpt& excerpt, const DecodedDrive& drive, const Arguments& arguments) {
  const app::Configuration configuration = app::load_configuration(std::nullopt, arguments.set);
  std::vector<float> pooled, means, online_means;
  Replay last;
  for (int i = 0; i < arguments.repeats; ++i) {
    last = replay(drive, configuration, arguments.threads, false);
    pooled.insert(pooled.end(), last.milliseconds.begin(), last.milliseconds.end());
    means.push_back(static_cast<float>(mean(last.milliseconds)));
    online_means.push_back(static_cast<float>(
        mean(replay(drive, configuration, arguments.threads, true).milliseconds)));
  }
  EvaluationOptions options{.segments = {{excerpt.lengths, 1, false}, {excerpt.lengths, 1, true}}};
  Measured m{.name = excerpt.name, .frames = drive.pairs.size(), .posed = last.poses.size()};
  m.evaluation = evaluate(last.poses, drive.truth, options);
  m.without_mount =
      segments_without_mount(last.poses, drive.truth, options, m.evaluation.sim3.scale);
  m.mean_ms = quantile(means, 0.5);
  m.online_mean_ms = quantile(online_means, 0.5);
  m.p50_ms = quantile(pooled, 0.5);
  m.p99_ms = quantile(pooled, 0.99);
  m.max_ms = *std::max_element(pooled.begin(), pooled.end());
  m.decode_ms = drive.decode_ms;
  for (std::size_t k = 0; k < kStages; ++k)
    m.stage_ms[k] = last.stage_ms[k] / static_cast<double>(m.frames);
  return m;
}

std::string processor() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  return "unknown processor";
}

/// Accuracy, times and stages, with the version and the machine that gave them.
void print(const std::vector<Measured>& all, const Arguments& arguments, double yardstick) {
  fmt::print(
      "# Benchmarks\n\nWritten by `scripts/bench` (`build/bench/odometry_bench`), version {}, {}, "
      "{} threads.\nTimes are from the decoded pair to the pose, with images decoded beforehand; "
      "mean times are the median over {} replays.\n"
      "Accuracy and times are of odometry alone (`calibration.online: off`); the last column is "
      "the mean with monitoring and online calibration, the default.\n"
      "The reference is OpenCV's pyramidal Lucas–Kanade on 1000 corners of one EuRoC pair, in the "
      "same run; only the ratio can be compared between machines.\n\n"
      "| data | frames posed | ATE SE(3) mm | ATE Sim(3) mm | scale | segments % | after one scale "
      "% | after one scale and mounting % | °/m |\n|---|---|---|---|---|---|---|---|---|\n",
      app::version(), processor(), arguments.threads, arguments.repeats);
  for (const Measured& m : all)
    fmt::print("| {} | {} of {} | {:.2f} | {:.2f} | {:.5f} | {:.3f} | {:.3f} | {:.3f} | {:.4f} |\n",
               m.name, m.posed, m.frames, 1e3 * m.evaluation.ate_se3.rmse,
               1e3 * m.evaluation.ate_sim3.rmse, m.evaluation.sim3.scale,
               1e2 * m.evaluation.segments[0].translation,
               1e2 * m.evaluation.segments[1].translation, 1e2 * m.without_mount,
               m.evaluation.segments[0].rotation * 180.0 / std::numbers::pi);
  fmt::print(
      "\nSegments: 0.2, 0.5, 1 m on EuRoC, 10 to 50 m on KITTI, from every frame.\n\n| data | "
      "mean ms | p50 | p99 | max | reference ms | mean / reference | mean ms with online "
      "calibration |\n|---|---|---|---|---|---|---|---|\n");
  for (const Measured& m : all)
    fmt::print("| {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.3f} | {:.2f} |\n", m.name,
               m.mean_ms, m.p50_ms, m.p99_ms, m.max_ms, yardstick,
               yardstick > 0 ? m.mean_ms / yardstick : 0, m.online_mean_ms);
  fmt::print("\n| stage, ms per frame |");
  for (const Measured& m : all) fmt::print(" {} |", m.name);
  fmt::print("\n|---|");
  for (std::size_t i = 0; i < all.size(); ++i) fmt::print("---|");
  fmt::print("\n| decode |");
  for (const Measured& m : all) fmt::print(" {:.2f} |", m.decode_ms);
  for (std::size_t k = 0; k < kStages; ++k) {
    fmt::print("\n| {} |", to_string(static_cast<Stage>(k)));
    for (const Measured& m : all) fmt::print(" {:.2f} |", m.stage_ms[k]);
  }
  fmt::print("\n\nDecoding runs ahead on its own thread and is not included in the times above.\n");
}

Arguments parse(int argc, char** argv) {
  Arguments a;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto value = [&]() -> std::string {
      if (i + 1 >= argc) throw std::runtime_error(word + " needs a value");
      return argv[++i];
    };
    if (word == "--repeats")
      a.repeats = std::stoi(value());
    else if (word == "--threads")
      a.threads = std::stoi(value());
    else if (word == "--set")
      a.set.push_back(value());
    else
      throw std::runtime_error("unknown argument " + word);
  }
  return a;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const Arguments arguments = parse(argc, argv);
    const std::vector<Excerpt> excerpts = {
        {"euroc_mh01", "data/euroc_mh01", app::SequenceFormat::euroc, {0.2, 0.5, 1.0}},
        {"kitti06_51", "data/kitti06_51", app::SequenceFormat::kitti, {10, 20, 30, 40, 50}},
    };
    std::vector<Measured> all;
    double yardstick = 0;
    for (const Excerpt& excerpt : excerpts) {
      const auto folder = test::shared_data(excerpt.folder);
      if (!folder) throw std::runtime_error(test::shared_data_missing(excerpt.folder));
      const DecodedDrive drive = load(excerpt, *folder);
      if (excerpt.format == app::SequenceFormat::euroc) yardstick = yardstick_ms(drive);
      all.push_back(measure(excerpt, drive, arguments));
    }
    print(all, arguments, yardstick);
    return 0;
  } catch (const std::exception& e) {
    fmt::print(stderr, "odometry_bench: {}\n", e.what());
    return 2;
  }
}
