#include "app/recording/messages.hpp"

#include <gtest/gtest.h>

#include <fmt/ranges.h>

#include "app/datasets/detail/ros_messages.hpp"

namespace vergence::app {
namespace {

std::string hex(const std::span<const std::uint8_t>& bytes) {
  return fmt::format("{:02X}", fmt::join(bytes, ""));
}

struct Room {
  std::array<std::uint8_t, 4096> bytes{};
  CdrWriter out{fill()};
  std::span<std::uint8_t> fill() {
    // The former content of the memory must not show through.
    bytes.fill(0x55);
    return bytes;
  }
};

TEST(CdrWriter, reportsOverflowAndStopsWriting) {
  std::array<std::uint8_t, 9> bytes{};
  CdrWriter out(std::span<std::uint8_t>(bytes).first(8));
  out.put(std::uint32_t{1});
  EXPECT_TRUE(out.ok());
  out.put(std::uint8_t{1}).put(std::uint32_t{2});
  EXPECT_FALSE(out.ok());
  EXPECT_EQ(bytes[8], 0);
}

// Bytes of the same numbers as a NavSatFix that Fast CDR wrote and @foxglove/rosmsg2-serialization
// read.
TEST(Messages, navSatFixMatchesReferenceWriter) {
  InsSample s{.stamp = Stamp(1'336'964'645'250'000'000), .fix = FixStatus::fix_3d};
  s.position = {-27.476543, 153.028765, 52.25};
  s.position_sigma = 2;
  s.height_sigma = 3;
  Room room;
  write_nav_sat_fix(&room.out, s);
  EXPECT_EQ(room.out.size(), 125U);
  EXPECT_EQ(hex(room.out.written().first(36)),
            "00010000"
            "2576B04F"
            "80B2E60E"
            "04000000"
            "696E7300"
            "00"
            "00"
            "0100"
            "00000000"
            "4223D8B8FE793BC0");
  EXPECT_EQ(room.out.written()[124], 2);
}

TEST(Messages, imageReadsBackWithoutPadding) {
  std::array<std::uint8_t, 12> pixels{1, 2, 3, 99, 4, 5, 6, 99, 7, 8, 9, 99};
  Room room;
  write_image(&room.out, Stamp(5'000'000'007), "left", {pixels.data(), 3, 3, 4});
  EXPECT_LE(room.out.size(), image_message_size(3, 3, 4));
  const auto image =
      detail::read_ros_image(room.out.written(), room.out.size(), detail::MessageEncoding::cdr);
  ASSERT_TRUE(image);
  EXPECT_EQ(image->stamp.ns(), 5'000'000'007);
  EXPECT_EQ(image->step, 3U);
  EXPECT_EQ(image->layout, detail::PixelLayout::grey);
  EXPECT_EQ(hex(room.out.written().subspan(image->offset)), "010203040506070809");
}

RigCalibration rig() {
  RigCalibration r{.cameras = 2};
  for (auto& lens : {&r.intrinsics[0], &r.intrinsics[1]})
    *lens = {CameraModelKind::pinhole_radtan, 640, 480, 450, 451, 322, 239,
             {-0.3, 0.1, 1e-4, -2e-4, 0.01},  {},  {}};
  r.T_camera_left[1] = {exp_so3(Vec3(0.01, -0.02, 0.005)), Vec3(-0.75, 0.01, -0.02)};
  r.baseline = r.T_camera_left[1].t.norm();
  return r;
}

// The project's own reader takes a rig out of two CameraInfos; it gets the one that was put in.
TEST(Messages, cameraInfosHoldRig) {
  const RigCalibration original = rig();
  std::array<RosCamera, 2> cameras;
  for (int k = 0; k < 2; ++k) {
    Room room;
    write_camera_info(&room.out, Stamp(1), k == 0 ? "left" : "right", original, k, true);
    ASSERT_TRUE(room.out.ok());
    const auto info =
        detail::read_ros_camera_info(room.out.written(), detail::MessageEncoding::cdr);
    ASSERT_TRUE(info);
    EXPECT_EQ(info->fault, "");
    cameras[static_cast<std::size_t>(k)] = info->camera;
  }
  RigCalibration read;
  ASSERT_EQ(set_ros_rig(cameras[0], cameras[1], &read), "");
  EXPECT_LT((read.T_camera_left[1].R - original.T_camera_left[1].R).norm(), 1e-12);
  EXPECT_LT((read.T_camera_left[1].t - original.T_camera_left[1].t).norm(), 1e-12);
  EXPECT_EQ(read.intrinsics[1].distortion, original.intrinsics[1].distortion);
  EXPECT_EQ(read.intrinsics[0].fx, 450);
}

TEST(Messages, everyMessageFitsItsBuffer) {
  std::array<std::uint8_t, kMessageRoom> bytes{};
  const std::array<std::string, 4> names{"left", "right", "camera2", "camera3"};
  RigCalibration four = rig();
  four.cameras = 4;
  const auto fits = [&](const auto& write) {
    CdrWriter out(bytes);
    write(&out);
    return out.ok();
  };
  EXPECT_TRUE(fits([](CdrWriter* o) { write_odometry(o, {}); }));
  EXPECT_TRUE(fits([](CdrWriter* o) { write_imu(o, {}); }));
  EXPECT_TRUE(fits([](CdrWriter* o) { write_ins_reading(o, {}, {}); }));
  EXPECT_TRUE(fits([](CdrWriter* o) { write_pose_transform(o, {}); }));
  EXPECT_TRUE(fits([](CdrWriter* o) { write_frame(o, {}); }));
  EXPECT_TRUE(fits([](CdrWriter* o) { write_pulse(o, {}, {}, {}); }));
  EXPECT_TRUE(fits([&](CdrWriter* o) { write_rig_transforms(o, {}, four, names); }));
  EXPECT_TRUE(fits([&](CdrWriter* o) { write_camera_info(o, {}, names[3], four, 3, true); }));
}

TEST(RosTypes, definitionsIncludeReferencedTypes) {
  for (int i = 0; i < kRosTypes; ++i) {
    const std::string text = ros_definition(static_cast<RosType>(i));
    for (std::size_t at = text.find('/'); at != std::string::npos; at = text.find('/', at + 1)) {
      const std::size_t begin = text.find_last_of("\n ", at) + 1;
      const std::string name = text.substr(begin, text.find_first_of("[ \n", at) - begin);
      EXPECT_NE(text.find("MSG: " + name + "\n"), std::string::npos)
          << name << " in " << ros_type_name(static_cast<RosType>(i));
    }
  }
}

}  // namespace
}  // namespace vergence::app
