// Stereo odometry on recorded excerpts: accuracy, time a frame by stage, and a yardstick of the
// machine's speed in the same run.
//
//   odometry_bench [--repeats N] [--threads 1|2] [--set KEY=VALUE]… [--json FILE] [--markdown FILE]
//   [--no-yardstick] [--frames PREFIX]
//
// Images are decoded beforehand; the clock runs from the decoded pair to the pose. Yardstick:
// OpenCV's pyramidal Lucas–Kanade on 1000 corners of one pair of successive EuRoC left images
// (pyramids included, one thread). A time counts as its ratio to it.
#include <time.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "app/config/configuration.hpp"
#include "app/datasets/image_file.hpp"
#include "app/datasets/stereo_sequence.hpp"
#include "app/datasets/trajectory_files.hpp"
#include "app/runtime/background_thread.hpp"
#include "app/runtime/thread_runner.hpp"
#include "app/runtime/version.hpp"
#include "core/comparison/trajectory_metrics.hpp"
#include "core/estimator/estimator.hpp"
#include "core/memory/allocation_guard.hpp"
#include "tests/support/shared_data.hpp"

namespace {

using namespace vergence;

struct Excerpt {
  const char* name;
  const char* folder;
  app::SequenceFormat format;
  std::vector<double> lengths;  // m, of the segment error
};

struct DecodedDrive {
  app::StereoSequence sequence;
  std::vector<std::array<cv::Mat, 2>> pairs;
  app::Trajectory truth;
  double decode_ms = 0;  // mean a pair, one thread
};

struct Replay {
  std::vector<StampedPose> poses;
  std::vector<float> milliseconds;         // a frame, of the clock …
  std::vector<float> cpu_milliseconds;     // … and of the estimator's thread
  std::array<double, kStages> stage_ms{};  // sums
  int posed = 0, ok = 0, keyframes = 0;
};

struct Arguments {
  int repeats = 10;
  int threads = 2;
  bool yardstick = true;
  std::vector<std::string> set;
  std::string json, frames, markdown;
};

double quantile(std::vector<float> values, double q) {
  if (values.empty()) return 0;
  const auto i = static_cast<std::size_t>(q * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(i), values.end());
  return values[i];
}

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

/// What this thread has run so far, ms.
double thread_ms() {
  timespec t{};
  (void)::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

DecodedDrive load(const Excerpt& excerpt, const std::filesystem::path& folder) {
  DecodedDrive d;
  d.sequence = app::open_sequence(excerpt.format, folder);
  d.truth = app::read_trajectory(folder);
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
              bool online, std::FILE* frames) {
  EstimatorOptions options;
  options.odometry = configuration.odometry;
  options.online = online;
  Arena arena(Estimator::memory_needed(options, d.sequence.calibration));
  SequentialRunner one;
  std::optional<app::ThreadRunner> two;
  if (threads == 2) two.emplace();
  ImmediateRunner at_once;
  std::optional<app::BackgroundThread> beside;  // calibrations are solved on it, as in a drive
  if (online) beside.emplace();
  Estimator estimator(options, d.sequence.calibration, d.sequence.calibration, arena,
                      two ? static_cast<PairRunner&>(*two) : one,
                      beside ? static_cast<BackgroundRunner&>(*beside) : at_once);
  Replay r;
  for (std::size_t i = 0; i < d.pairs.size(); ++i) {
    RigFrame frame;
    frame.number = i;
    frame.stamp = d.sequence.pairs[i].stamp;
    frame.cameras = 2;
    for (std::size_t k = 0; k < 2; ++k) {
      const Intrinsics& c = d.sequence.calibration.intrinsics[k];
      frame.images[k] = {d.pairs[i][k].data, c.width, c.height,
                         static_cast<std::ptrdiff_t>(d.pairs[i][k].step)};
    }
    const double before = thread_ms();
    const PoseSample s = estimator.process(frame);
    r.cpu_milliseconds.push_back(static_cast<float>(thread_ms() - before));
    r.milliseconds.push_back(s.estimate_ms);
    for (std::size_t k = 0; k < kStages; ++k) r.stage_ms[k] += static_cast<double>(s.stage_ms[k]);
    r.keyframes += s.keyframe ? 1 : 0;
    if (frames != nullptr)
      fmt::print(frames, "{},{},{},{},{},{},{:.3f},{},{:.2f},{:.6f},{:.6f},{:.6f}\n", i,
                 s.stamp.ns(), to_string(s.status), to_string(s.reason), s.inliers,
                 s.stereo_inliers, s.reprojection_px, s.keyframe ? 1 : 0, s.estimate_ms,
                 s.T_world_left.t.x(), s.T_world_left.t.y(), s.T_world_left.t.z());
    if (s.status == PoseStatus::lost) continue;
    ++r.posed;
    r.ok += s.status == PoseStatus::ok ? 1 : 0;
    r.poses.push_back({s.stamp, s.T_world_left});
  }
  return r;
}

void write_tum(const std::string& file, const std::vector<StampedPose>& poses) {
  std::ofstream out(file);
  for (const StampedPose& p : poses) {
    const Eigen::Quaterniond q = quaternion(p.T_world_body.R);
    const Vec3& t = p.T_world_body.t;
    out << fmt::format("{}.{:09} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
                       p.stamp.ns() / 1'000'000'000, p.stamp.ns() % 1'000'000'000, t.x(), t.y(),
                       t.z(), q.x(), q.y(), q.z(), q.w());
  }
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

nlohmann::json measure(const Excerpt& excerpt, const DecodedDrive& drive,
                       const Arguments& arguments, double* yardstick) {
  const app::Configuration configuration = app::load_configuration(std::nullopt, arguments.set);
  std::vector<float> pooled, cpu, means, online_means;
  Replay last;
  for (int i = 0; i < arguments.repeats; ++i) {
    std::FILE* frames =
        i == 0 && !arguments.frames.empty()
            ? std::fopen((arguments.frames + "." + excerpt.name + ".csv").c_str(), "w")
            : nullptr;
    last = replay(drive, configuration, arguments.threads, false, frames);
    if (frames != nullptr) {
      std::fclose(frames);
      write_tum(arguments.frames + "." + excerpt.name + ".tum", last.poses);
    }
    pooled.insert(pooled.end(), last.milliseconds.begin(), last.milliseconds.end());
    cpu.insert(cpu.end(), last.cpu_milliseconds.begin(), last.cpu_milliseconds.end());
    means.push_back(static_cast<float>(mean(last.milliseconds)));
    online_means.push_back(static_cast<float>(
        mean(replay(drive, configuration, arguments.threads, true, nullptr).milliseconds)));
  }
  EvaluationOptions options;
  options.segments = {{excerpt.lengths, 1, false}, {excerpt.lengths, 1, true}};
  const TrajectoryEvaluation e = evaluate(last.poses, drive.truth, options);
  const double n = static_cast<double>(drive.pairs.size());
  nlohmann::json j;
  j["data"] = excerpt.name;
  j["frames"] = drive.pairs.size();
  j["posed"] = last.posed;
  j["ok"] = last.ok;
  j["keyframes"] = last.keyframes;
  j["ate_mm"] = 1e3 * e.ate_se3.rmse;
  j["ate_sim3_mm"] = 1e3 * e.ate_sim3.rmse;
  j["scale"] = e.sim3.scale;
  j["segment_percent"] = 1e2 * e.segments[0].translation;
  j["segment_scaled_percent"] = 1e2 * e.segments[1].translation;
  j["segment_scaled_mount_percent"] =
      1e2 * segments_without_mount(last.poses, drive.truth, options, e.sim3.scale);
  j["rotation_deg_per_m"] = e.segments[0].rotation * 180.0 / std::numbers::pi;
  j["end_percent"] = 1e2 * e.end_error_ratio;
  j["mean_ms"] = quantile(means, 0.5);
  j["online_mean_ms"] = quantile(online_means, 0.5);
  j["p50_ms"] = quantile(pooled, 0.5);
  j["p99_ms"] = quantile(pooled, 0.99);
  j["max_ms"] = *std::max_element(pooled.begin(), pooled.end());
  j["cpu_p50_ms"] = quantile(cpu, 0.5);
  j["cpu_p999_ms"] = quantile(cpu, 0.999);
  if (*yardstick > 0) {
    j["yardstick_ms"] = *yardstick;
    j["ratio"] = quantile(means, 0.5) / *yardstick;
  }
  j["stages_ms"]["decode"] = drive.decode_ms;
  for (int k = 0; k < kStages; ++k)
    j["stages_ms"][std::string(to_string(static_cast<Stage>(k)))] =
        last.stage_ms[static_cast<std::size_t>(k)] / n;
  return j;
}

void print(const nlohmann::json& j) {
  fmt::print("{}: {} of {} posed, {} ok, {} keyframes\n", j["data"].get<std::string>(),
             j["posed"].get<int>(), j["frames"].get<int>(), j["ok"].get<int>(),
             j["keyframes"].get<int>());
  fmt::print(
      "  ATE {:.2f} mm · Sim(3) {:.2f} mm, scale {:.5f} · segments {:.3f} %, scaled {:.3f} %, and "
      "mount {:.3f} % · {:.4f} °/m · end {:.3f} "
      "%\n",
      j["ate_mm"].get<double>(), j["ate_sim3_mm"].get<double>(), j["scale"].get<double>(),
      j["segment_percent"].get<double>(), j["segment_scaled_percent"].get<double>(),
      j["segment_scaled_mount_percent"].get<double>(), j["rotation_deg_per_m"].get<double>(),
      j["end_percent"].get<double>());
  fmt::print(
      "  {:.2f} ms mean, {:.2f} with the rig watched and calibrated · {:.2f} p50 · {:.2f} p99 · "
      "{:.2f} max",
      j["mean_ms"].get<double>(), j["online_mean_ms"].get<double>(), j["p50_ms"].get<double>(),
      j["p99_ms"].get<double>(), j["max_ms"].get<double>());
  if (j.contains("ratio"))
    fmt::print(" · yardstick {:.2f} ms, ratio {:.3f}", j["yardstick_ms"].get<double>(),
               j["ratio"].get<double>());
  const double median = j["cpu_p50_ms"].get<double>(), slowest = j["cpu_p999_ms"].get<double>();
  fmt::print("\n  estimator's thread: {:.2f} ms p50 · {:.2f} p99.9, {:.2f} medians", median,
             slowest, slowest / median);
  fmt::print("\n ");
  for (const auto& [stage, ms] : j["stages_ms"].items())
    fmt::print(" {} {:.2f}", stage, ms.get<double>());
  fmt::print("\n");
}

std::string processor() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  return "unknown processor";
}

/// docs/benchmarks.md: accuracy, time and stages of the last run, with the version and the machine
/// that gave them.
void write_markdown(const std::string& file, const nlohmann::json& all,
                    const Arguments& arguments) {
  std::ofstream out(file);
  out << "# Benchmarks\n\nWritten by `scripts/bench` (`build/bench/odometry_bench`), version "
      << app::version() << ", " << processor() << ", " << arguments.threads
      << " threads.\nMedian of " << arguments.repeats
      << " replays' means; images decoded beforehand, the clock runs from the decoded pair to the "
         "pose.\n"
         "Accuracy and times are the odometry's by itself, `calibration.online: off`; the last "
         "column has what the\nwatched rig and its calibration, on by default, make of the mean.\n"
         "Yardstick: OpenCV's pyramidal Lucas–Kanade on 1000 corners of one EuRoC pair, in the "
         "same run; only the ratio compares between "
         "machines.\n\n"
         "| data | frames posed | ATE SE(3) mm | ATE Sim(3) mm | scale | segments % | after one "
         "scale % | and one mounting % | °/m "
         "|\n|---|---|---|---|---|---|---|---|---|\n";
  for (const auto& j : all)
    out << fmt::format(
        "| {} | {} of {} | {:.2f} | {:.2f} | {:.5f} | {:.3f} | {:.3f} | {:.3f} | {:.4f} |\n",
        j["data"].get<std::string>(), j["posed"].get<int>(), j["frames"].get<int>(),
        j["ate_mm"].get<double>(), j["ate_sim3_mm"].get<double>(), j["scale"].get<double>(),
        j["segment_percent"].get<double>(), j["segment_scaled_percent"].get<double>(),
        j["segment_scaled_mount_percent"].get<double>(), j["rotation_deg_per_m"].get<double>());
  out << "\nSegments: 0.2, 0.5, 1 m on EuRoC, 10 to 50 m on KITTI, every frame a start.\n\n| data "
         "| mean ms | p50 | p99 | max | yardstick "
         "ms | mean / yardstick | mean ms with the rig watched and calibrated "
         "|\n|---|---|---|---|---|---|---|---|\n";
  for (const auto& j : all)
    out << fmt::format("| {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.3f} | {:.2f} |\n",
                       j["data"].get<std::string>(), j["mean_ms"].get<double>(),
                       j["p50_ms"].get<double>(), j["p99_ms"].get<double>(),
                       j["max_ms"].get<double>(), j.value("yardstick_ms", 0.0),
                       j.value("ratio", 0.0), j["online_mean_ms"].get<double>());
  out << "\n| stage, ms a frame |";
  for (const auto& j : all) out << " " << j["data"].get<std::string>() << " |";
  out << "\n|---|";
  for (std::size_t i = 0; i < all.size(); ++i) out << "---|";
  for (const char* stage : {"decode", "pyramid", "detect", "track", "match", "pose", "window"}) {
    out << "\n| " << stage << " |";
    for (const auto& j : all) out << fmt::format(" {:.2f} |", j["stages_ms"][stage].get<double>());
  }
  out << "\n\nDecode runs on its own thread ahead of the estimator and is not in the times "
         "above.\n";
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
    else if (word == "--json")
      a.json = value();
    else if (word == "--markdown")
      a.markdown = value();
    else if (word == "--frames")
      a.frames = value();
    else if (word == "--no-yardstick")
      a.yardstick = false;
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
    nlohmann::json all = nlohmann::json::array();
    double yardstick = 0;
    for (const Excerpt& excerpt : excerpts) {
      const auto folder = test::shared_data(excerpt.folder);
      if (!folder) {
        fmt::print("{}: {}\n", excerpt.name, test::shared_data_missing(excerpt.folder));
        continue;
      }
      const DecodedDrive drive = load(excerpt, *folder);
      if (arguments.yardstick && yardstick == 0 && excerpt.format == app::SequenceFormat::euroc)
        yardstick = yardstick_ms(drive);
      all.push_back(measure(excerpt, drive, arguments, &yardstick));
      print(all.back());
    }
    if (!arguments.markdown.empty() && !all.empty())
      write_markdown(arguments.markdown, all, arguments);
    if (!arguments.json.empty()) std::ofstream(arguments.json) << all.dump(2) << '\n';
    return all.empty() ? 2 : 0;
  } catch (const std::exception& e) {
    fmt::print(stderr, "odometry_bench: {}\n", e.what());
    return 2;
  }
}
