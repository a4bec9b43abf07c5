// A recording with a message of every type that a drive records, for other programs to read:
// record_sample FOLDER
#include <array>
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "app/recording/messages.hpp"
#include "app/recording/recording.hpp"

namespace vergence::app {
namespace {

constexpr std::array kTopics{RosType::image, RosType::camera_info, RosType::nav_sat_fix,
                             RosType::imu,   RosType::odometry,    RosType::tf,
                             RosType::text,  RosType::frame,       RosType::ins_reading,
                             RosType::pulse};

void write(CdrWriter* out, RosType type, Stamp stamp) {
  std::array<std::uint8_t, 12> pixels{};
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<std::uint8_t>(i);
  RigCalibration rig;
  rig.cameras = 2;
  for (auto* lens : {&rig.intrinsics[0], &rig.intrinsics[1]})
    *lens = {CameraModelKind::pinhole_radtan, 4, 3, 450, 451, 2, 1.5, {}, {}, {}};
  rig.T_camera_left[1].t = Vec3(-0.75, 0, 0);
  InsSample ins;
  ins.stamp = stamp;
  ins.number = 7;
  ins.fix = FixStatus::fix_3d;
  ins.position = {-27.476543, 153.028765, 52.25};
  ins.position_sigma = ins.height_sigma = 2;
  PoseSample pose;
  pose.stamp = stamp;
  pose.status = PoseStatus::ok;
  pose.T_world_left.t = Vec3(1, 2, 3);
  pose.covariance[0] = 0.25F;   // of x
  pose.covariance[1] = 0.125F;  // of x and y
  pose.covariance[20] = 0.5F;   // of the rotation about z
  FrameRecord frame;
  frame.stamp = stamp;
  frame.number = 3;
  frame.sample = pose;
  const std::array<std::string_view, 2> names{"left", "right"};
  switch (type) {
    case RosType::image:
      return write_image(out, stamp, "left", {pixels.data(), 4, 3, 4});
    case RosType::camera_info:
      return write_camera_info(out, stamp, "right", rig, 1, true);
    case RosType::nav_sat_fix:
      return write_nav_sat_fix(out, ins);
    case RosType::imu:
      return write_imu(out, ins);
    case RosType::odometry:
      return write_odometry(out, pose);
    case RosType::tf:
      return write_rig_transforms(out, stamp, rig, names);
    case RosType::text:
      return write_text(out, "rig: {name: demo}");
    case RosType::frame:
      return write_frame(out, frame);
    case RosType::ins_reading:
      return write_ins_reading(out, ins, {});
    case RosType::pulse: {
      Pulse pulse;
      pulse.number = 9;
      return write_pulse(out, stamp, pulse, stamp);
    }
  }
}

int record(const std::filesystem::path& folder) {
  constexpr int kRounds = 50;
  Recording::Options options;
  for (const RosType type : kTopics)
    options.files.topics.push_back(
        {"/sample_" + std::to_string(static_cast<int>(type)), type, type == RosType::tf});
  options.queues = {64U << 10U};  // full many times: many chunks
  options.when_full = Recording::WhenFull::wait;
  Recording recording(folder, options);
  for (int i = 0; i < kRounds; ++i)
    for (std::size_t t = 0; t < kTopics.size(); ++t) {
      const Stamp stamp(1'336'964'645'250'000'000 + i * 33'333'333LL);
      CdrWriter out(recording.begin(0, t, stamp, kMessageRoom));
      write(&out, kTopics[t], stamp);
      recording.commit(0, out.size());
    }
  recording.close();
  return recording.counters().messages == kRounds * kTopics.size() ? 0 : 1;
}

}  // namespace
}  // namespace vergence::app

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: record_sample FOLDER\n");
    return 2;
  }
  return vergence::app::record(argv[1]);
}
