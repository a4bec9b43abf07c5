#pragma once
#include <fstream>
#include <initializer_list>
#include <numbers>

#include "app/session/calibration_writer.hpp"
#include "app/session/records.hpp"
#include "core/math/random.hpp"

namespace vergence::test {

/// Writes the session folder of a run in a circle: an INS from the start, an ENU alignment after
/// 100 m, growing drift, a covered lens (degraded, then lost), a rejected and accepted
/// calibrations.
struct SessionWriter {
  std::size_t frames = 3000;
  bool ins = true;
  bool faults = true;
  std::int64_t first_stamp_ns = 1'772'360'100'000'000'000;

  void write(const std::filesystem::path& folder) {
    std::filesystem::create_directories(folder);
    write_frames(folder);
    write_calibrations(folder);
    write_events(folder);
    write_summary(folder);
    std::ofstream(folder / "calibration.yaml")
        << "version: 1\nrig: {name: demo, baseline: 0.75}\ncameras:\n"
           "  - {name: left, size: [640, 480], model: pinhole-radtan, intrinsics: [450, 450, 320, "
           "240], distortion: [0, 0, 0, 0]}\n"
           "  - {name: right, size: [640, 480], model: pinhole-radtan, intrinsics: [450, 450, 320, "
           "240], distortion: [0, 0, 0, 0],\n"
           "     T_camera_left: [1, 0, 0, -0.75, 0, 1, 0, 0, 0, 0, 1, 0]}\n";
  }

 private:
  [[nodiscard]] std::int64_t stamp(std::size_t i) const {
    return first_stamp_ns + static_cast<std::int64_t>(i) * 50'000'000;
  }
  [[nodiscard]] std::size_t part(double share) const {
    return static_cast<std::size_t>(share * static_cast<double>(frames));
  }
  [[nodiscard]] bool lost(std::size_t i) const {
    return faults && i >= part(0.62) && i < part(0.64);
  }
  [[nodiscard]] bool degraded(std::size_t i) const {
    return faults && i >= part(0.60) && i < part(0.66) && !lost(i);
  }
  /// Appends numbers, or as many empty fields if they are not known.
  static void add(std::string* line, bool known, std::initializer_list<double> numbers) {
    for (const double n : numbers) *line += known ? fmt::format(",{:.6f}", n) : ",";
  }

  /// A circle at 0.44 m per frame, over a hill.
  void write_frames(const std::filesystem::path& folder) {
    std::ofstream poses(folder / "poses.csv"), trajectory(folder / "trajectory.tum"),
        reference(folder / "reference.tum");
    poses << app::kPosesHeader << '\n';
    constexpr double kStep = 0.44;
    const double turn = 2 * std::numbers::pi / static_cast<double>(frames);
    Random random(1);
    for (std::size_t i = 0; i < frames; ++i) {
      const double yaw = turn * static_cast<double>(i);
      driven_ = kStep * static_cast<double>(i);
      const double drift = 0.006 * std::max(0.0, driven_ - 100);
      const Vec3 ins_enu(kStep / turn * std::sin(yaw), -kStep / turn * std::cos(yaw),
                         6 * std::sin(2 * yaw)),
          error = drift * Vec3(1, -0.4, 0.3), enu = ins_enu + error;
      write_frame(i, enu, ins_enu, yaw, random, poses, trajectory, reference);
    }
  }

  void write_frame(std::size_t i, const Vec3& enu, const Vec3& ins_enu, double yaw, Random& random,
                   std::ofstream& poses, std::ofstream& trajectory,
                   std::ofstream& reference) const {
    const bool posed = !lost(i), placed = ins && driven_ > 100 && posed, weak = degraded(i);
    const char* state = lost(i)          ? "lost"
                        : i < part(0.03) ? "initialising"
                        : i < part(0.08) ? "parallel_monocular"
                                         : "stereo_odometry";
    std::string line = fmt::format("{},{},{},{},{}", i, stamp(i), state,
                                   lost(i) ? "lost"
                                   : weak  ? "degraded"
                                           : "ok",
                                   lost(i) ? "no_pose"
                                   : weak  ? "image_no_contrast"
                                           : "");
    // The odometry's world has x right, y down and z forward of a rig that started looking east. A
    // yaw of the vehicle is a negative rotation about y.
    const double s = -std::sin(yaw / 2), c = std::cos(yaw / 2), heading = 90 - yaw * 57.29577951;
    add(&line, posed, {-enu.y(), -enu.z(), enu.x(), 0, s, 0, c});
    add(&line, placed, {enu.x(), enu.y(), enu.z(), -27.49, 153.01, 60, heading});
    add(&line, ins, {ins_enu.x(), ins_enu.y(), ins_enu.z(), -27.49, 153.01, 60, heading});
    const Vec3 error = enu - ins_enu;
    add(&line, placed, {error.x(), error.y(), error.z(), 0.5 * std::sin(driven_ / 300)});
    line += fmt::format(",{:.0f},0.3,{:.3f}\n", (posed && !weak ? 230 : 46) + 15 * random.normal(),
                        12 + 3 * std::abs(random.normal()) + (i % 997 == 500 ? 45 : 0));
    poses << line;
    if (!posed) return;
    const std::string seconds =
        fmt::format("{}.{:09}", stamp(i) / 1'000'000'000, stamp(i) % 1'000'000'000);
    trajectory << fmt::format("{} {:.9f} {:.9f} {:.9f} 0 {:.9f} 0 {:.9f}\n", seconds, -enu.y(),
                              -enu.z(), enu.x(), s, c);
    if (!ins) return;
    // Axes of a camera that looks east, rotated about up by the yaw.
    reference << fmt::format("{} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n", seconds,
                             ins_enu.x(), ins_enu.y(), ins_enu.z(), (s - c) / 2, (c + s) / 2,
                             (-s - c) / 2, (c - s) / 2);
  }

  void write_calibrations(const std::filesystem::path& folder) const {
    std::ofstream out(folder / "calibrations.csv");
    out << app::kCalibrationsHeader << '\n';
    const auto row = [&](double share, const char* outcome, const char* cause, const char* reason,
                         double off, double sigma) {
      out << fmt::format(
          "{},{},{},{},60,75,{},0.2,0.9,0.21,0.002,1,{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f}",
          stamp(part(share)), outcome, cause, reason, part(share) - 75, 0.011 + off, -0.004 + off,
          0.002 - off, -0.75 + off, 0.001 + off, 0.003 - off);
      for (const double scale : {1.0, 2.0})
        for (int k = 0; k < 6; ++k)
          out << fmt::format(",{:.6f}", scale * sigma * (k < 3 ? 1.0 : 2.0));
      out << fmt::format(",{:.3f},450,{:.3f},240,{:.3f},{:.3f},{:.3f},0", 450 + 100 * off,
                         318 + 900 * off, 300 * sigma, 300 * sigma, 900 * sigma);
      out << fmt::format(",{:.6f},0,0,0,{:.6f},0,0,0,,,,,,,,,20,{:.4f},{:.4f},1\n", 2 * off, sigma,
                         500 * sigma, 300 * off);
    };
    row(0.08, "accepted", "from_scratch", "", 0.0006, 0.0009);
    if (faults) row(0.3, "rejected", "drift", "too little motion", 0.0020, 0.0015);
    row(0.45, "accepted", "requested", "", 0.0001, 0.0003);
    row(0.7, "accepted", "knock", "", 0.0009, 0.0003);
    row(0.8, "unchanged", "refinement", "the calibration in use fits as well", 0.0008, 0.0002);
  }

  void write_events(const std::filesystem::path& folder) const {
    std::ofstream out(folder / "events.jsonl");
    const auto event = [&](double share, const char* kind, const std::string& message) {
      out << fmt::format("{{\"stamp_ns\":{},\"kind\":\"{}\",\"message\":\"{}\",\"fields\":{{}}}}\n",
                         stamp(part(share)), kind, message);
    };
    event(0, "state", "initialising to parallel_monocular: enough points and parallax");
    event(0.08, "state", "calibrating to stereo_odometry: the calibration passed its gates");
    event(0.085, "calibration_verified", "the calibration in use is verified");
    event(0.09, "enu_alignment", "aligned with ENU after 100.0 m: heading sigma 1.20 deg");
    for (int i = 0; faults && i < 20; ++i)
      event(0.6 + 0.001 * i, "frame_dropped", "the frame is not newer than the one before");
    if (faults) event(0.62, "state", "stereo_odometry to lost: no pose for ten frames");
    if (faults) event(0.64, "relocalised", "found again against the window");
  }

  void write_summary(const std::filesystem::path& folder) const {
    std::size_t lost_count = 0, degraded_count = 0;
    for (std::size_t i = 0; i < frames; ++i)
      lost_count += lost(i) ? 1U : 0U, degraded_count += degraded(i) ? 1U : 0U;
    const std::string metrics =
        ins ? R"({"matched": 1, "path_m": 1000, "ate_m": 1.91, "scale": 1.0021, "segment_error_percent": 0.74, "segment_error_short_percent": 1.9,
          "rotation_error_deg_per_m": 0.0031, "end_error_percent": 0.63})"
            : "null";
    std::ofstream(folder / "summary.json") << fmt::format(
        R"({{"frames": {{"read": {}, "posed": {}, "ok": {}, "degraded": {}, "lost": {}, "skipped": 0}}, "path_m": {},
  "timing_ms": {{"mean": 14.2, "p50": 13.9, "p99": 21.0, "p99_9": 57.1, "max": 61.4, "stages": {{"decode": 3.1, "pyramid": 0.6, "detect": 1.4,
    "track": 5.5, "match": 4.1, "pose": 0.2, "window": 1.1}}}},
  "metrics": {},
  "calibration": {{"source": "online", "baseline_m": 0.75, "rating": "good", "online": true, "verified": true, "depth_error_percent": {{"1": 0.06, "5": 0.3, "10": 0.6, "20": 1.2, "50": 3.1}},
    "initial": {{"rating": "fair", "depth_error_percent": {{"1": 0.2, "5": 0.9, "10": 1.8, "20": 3.6, "50": 9.1}}}}}},
  "recalibrations": [], "runtime_allocations": 0,
  "memory": {{"estimator_bytes": 15957952, "images_bytes": 9472064, "rings_bytes": 87168, "total_bytes": 25517184}},
  "drops": {{"frames": 0, "estimator": 20, "records": 0, "lines": 0, "recorder_high_water": 3}},
  "truth": {{"ate_m": 0.41, "calibration_error": [0.0001, 0, 0, 0.001, 0, 0]}}, "devices": {{"left_frames": 3000}},
  "version": "0.1.0", "configuration_hash": "890eaa09a20a4e1c"}})",
        frames, frames - lost_count, frames - lost_count - degraded_count, degraded_count,
        lost_count, driven_, metrics);
  }

  double driven_ = 0;
};

}  // namespace vergence::test
