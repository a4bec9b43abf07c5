#pragma once
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>

#include <fmt/format.h>

#include "core/math/random.hpp"

namespace vergence::test {

/// Writes a session folder as a drive of a kilometre or more around blocks leaves it: an INS from
/// the start, a placement after 100 m, growing drift, a covered lens (degraded, then lost), a
/// rejected and an accepted calibration.
struct SessionWriter {
  std::size_t frames = 3000;
  double rate = 20;  // Hz
  bool ins = true;
  bool faults = true;
  std::uint64_t seed = 1;
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

  static constexpr const char* kHead =
      "frame,stamp_ns,state,status,reason,x,y,z,qx,qy,qz,qw,east,north,up,latitude_deg,longitude_"
      "deg,height_m,heading_deg,ins_east,ins_"
      "north,"
      "ins_up,ins_latitude_deg,ins_longitude_deg,ins_height_m,ins_heading_deg,error_east_m,error_"
      "north_m,error_up_m,error_heading_deg,"
      "inliers,reprojection_px,estimate_ms\n";

 private:
  [[nodiscard]] std::int64_t stamp(std::size_t i) const {
    return first_stamp_ns + static_cast<std::int64_t>(static_cast<double>(i) / rate * 1e9);
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

  /// Around blocks: straight stretches with rounded corners, a closed way.
  void write_frames(const std::filesystem::path& folder) {
    std::ofstream poses(folder / "poses.csv"), trajectory(folder / "trajectory.tum"),
        reference(folder / "reference.tum");
    poses << kHead;
    Random random(seed);
    double east = 0, north = 0, driven = 0, wander_east = 0, wander_north = 0;
    const double way = 2.2 * static_cast<double>(frames) / 20;
    for (std::size_t i = 0; i < frames; ++i) {
      const double s = static_cast<double>(i) / static_cast<double>(frames);
      const double speed =
          s < 0.02 || (s > 0.4 && s < 0.43) ? 0.5 : way / static_cast<double>(frames) * 4;
      const double yaw =
          0.6 +
          2 * std::numbers::pi * (s + 0.11 * std::sin(8 * std::numbers::pi * s));  // ccw from east
      east += speed * std::cos(yaw), north += speed * std::sin(yaw), driven += speed;
      const double up = 6 * std::sin(4 * std::numbers::pi * s);
      wander_east = 0.995 * wander_east + 0.08 * random.normal(),
      wander_north = 0.995 * wander_north + 0.08 * random.normal();
      const double drift = 0.006 * std::max(0.0, driven - 100);
      write_frame(i, driven, {east + drift, north - 0.4 * drift, up + 0.3 * drift},
                  {east + wander_east, north + wander_north, up}, yaw, random, poses, trajectory,
                  reference);
    }
    driven_ = driven;
  }

  struct Place {
    double east, north, up;
  };

  void write_frame(std::size_t i, double driven, const Place& ours, const Place& theirs, double yaw,
                   Random& random, std::ofstream& poses, std::ofstream& trajectory,
                   std::ofstream& reference) const {
    const double t = static_cast<double>(stamp(i) - first_stamp_ns) * 1e-9;
    const std::string seconds =
        fmt::format("{}.{:09}", stamp(i) / 1'000'000'000, stamp(i) % 1'000'000'000);
    const double half = -yaw / 2;  // about y, which points down
    const std::string quaternion = fmt::format("0,{:.9f},0,{:.9f}", std::sin(half), std::cos(half));
    const char* status = lost(i) ? "lost" : degraded(i) ? "degraded" : "ok";
    const char* reason = lost(i) ? "no_pose" : degraded(i) ? "image_no_contrast" : "";
    const char* state = lost(i)          ? "lost"
                        : i < part(0.03) ? "initialising"
                        : i < part(0.08) ? "parallel_monocular"
                                         : "stereo_odometry";
    std::string line = fmt::format("{},{},{},{},{}", i, stamp(i), state, status, reason);
    // The odometry's world: x right, y down, z forward of a rig that started looking east.
    if (lost(i))
      line += ",,,,,,,";
    else
      line += fmt::format(",{:.9f},{:.9f},{:.9f},{}", -ours.north, -ours.up, ours.east, quaternion);
    const bool placed = ins && driven > 100 && !lost(i);
    if (placed)
      line += fmt::format(",{:.4f},{:.4f},{:.4f},-27.49,153.01,60,{:.3f}", ours.east, ours.north,
                          ours.up, 90 - yaw * 57.29577951);
    else
      line += ",,,,,,,";
    if (ins)
      line += fmt::format(",{:.4f},{:.4f},{:.4f},-27.49,153.01,60,{:.3f}", theirs.east,
                          theirs.north, theirs.up, 90 - yaw * 57.29577951);
    else
      line += ",,,,,,,";
    if (placed)
      line += fmt::format(",{:.4f},{:.4f},{:.4f},{:.4f}", ours.east - theirs.east,
                          ours.north - theirs.north, ours.up - theirs.up,
                          0.5 * std::sin(t / 30) + 0.1 * random.normal());
    else
      line += ",,,,";
    const double dip = degraded(i) || lost(i) ? 0.2 : 1.0;
    line += fmt::format(",{:.0f},0.3,{:.3f}\n",
                        dip * (230 + 40 * std::sin(t / 7) + 15 * random.normal()),
                        12 + 3 * std::abs(random.normal()) + (i % 997 == 500 ? 45 : 0));
    poses << line;
    if (lost(i)) return;
    trajectory << fmt::format("{} {:.9f} {:.9f} {:.9f} 0 {:.9f} 0 {:.9f}\n", seconds, -ours.north,
                              -ours.up, ours.east, std::sin(half), std::cos(half));
    if (!ins) return;
    // About up by the yaw, after the axes of a camera that looks east.
    const double c = 0.5 * std::cos(yaw / 2), d = 0.5 * std::sin(yaw / 2);
    reference << fmt::format("{} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n", seconds,
                             theirs.east, theirs.north, theirs.up, -c - d, c - d, d - c, c + d);
  }

  void write_calibrations(const std::filesystem::path& folder) const {
    std::ofstream out(folder / "calibrations.csv");
    out << "stamp_ns,outcome,cause,reason,frames,latency_frames,onset_frame,reprojection_px,held_"
           "out_before_px,held_out_after_px,scale_"
           "sigma,"
           "camera,rx,ry,rz,tx,ty,tz,sigma_rx,sigma_ry,sigma_rz,sigma_tx,sigma_ty,sigma_tz,sigma_"
           "total_rx,"
           "sigma_total_ry,sigma_total_rz,sigma_total_tx,sigma_total_ty,sigma_total_tz,"
           "fx,fy,cx,cy,sigma_fx,sigma_fy,sigma_cx,sigma_cy,d0,d1,d2,d3,sigma_d0,sigma_d1,sigma_d2,"
           "sigma_d3,"
           "reference_depth_m,depth_sigma_percent,depth_error_percent,verified\n";
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
      out << fmt::format(",{:.6f},0,0,0,{:.6f},0,0,0,20,{:.4f},{:.4f},1\n", 2 * off, sigma,
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
      event(0.6 + 0.001 * i, "points_dropped", "points beyond the window's capacity were dropped");
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
