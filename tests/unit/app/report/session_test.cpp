#include "app/report/session.hpp"

#include <fmt/ranges.h>

#include "app/runtime/errors.hpp"
#include "tests/support/mentions.hpp"
#include "tests/support/session_writer.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app::report {
namespace {

constexpr const char* kShortHead =
    "frame,stamp_ns,state,status,reason,x,y,z,qx,qy,qz,qw,inliers,estimate_ms\n";

std::string missing(const Session& s) { return fmt::format("{}", fmt::join(s.missing, "\n")); }

/// A folder with poses.csv of that text and nothing else.
Session with_poses(const std::string& text) {
  const test::TemporaryFolder folder;
  folder.write("poses.csv", text);
  return read_session(folder.path());
}

TEST(ReadSession, wholeSessionHasNothingMissing) {
  const test::TemporaryFolder folder;
  test::SessionWriter writer;
  writer.frames = 400;
  writer.write(folder.path());
  const Session s = read_session(folder.path());
  EXPECT_EQ(s.missing, std::vector<std::string>{});
  ASSERT_EQ(s.frames.size(), 400U);
  EXPECT_EQ(s.frames.front().stamp.ns(), writer.first_stamp_ns);
  // Frames from 62 to 64 % of the run are lost.
  EXPECT_EQ(s.frames[250].status, PoseStatus::lost);
  EXPECT_FALSE(s.frames[250].posed);
  EXPECT_TRUE(s.frames[399].compared && s.frames[399].placed && s.frames[399].has_ins &&
              s.frames[399].posed);
  ASSERT_EQ(s.calibrations.size(), 5U);
  EXPECT_FALSE(s.calibrations[1].accepted);
  EXPECT_NEAR(s.calibrations[0].sigma[0], 2 * 0.0009, 1e-9)
      << "the wide sigma goes before the noise's";
  EXPECT_EQ(s.calibrations[3].cause, "knock");
  EXPECT_TRUE(s.calibrations[3].decided);
  EXPECT_EQ(s.calibrations[3].held_out_after_px, 0.21);
  EXPECT_TRUE(s.calibrations[4].kept && !s.calibrations[4].accepted);
  EXPECT_FALSE(s.calibrations[1].kept);
  EXPECT_EQ(s.calibrations[4].reference_depth_m, 20);
  EXPECT_NEAR(s.calibrations[4].depth_sigma_percent, 0.1, 1e-9);
  EXPECT_EQ(s.reference.size(), 392U);
  EXPECT_EQ(number_at(s.summary, "timing_ms.stages.track"), 5.5);
}

TEST(ReadSession, folderWithoutSessionIsRefused) {
  const test::TemporaryFolder folder;
  EXPECT_THROW((void)read_session(folder.path()), InputError);
  EXPECT_THROW((void)read_session(folder / "nowhere"), InputError);
  EXPECT_THROW((void)read_session(folder.write("file", "x")), InputError);
}

TEST(ReadSession, filesAbsentByDesignAreNotMissing) {
  const test::TemporaryFolder folder;
  folder.write("poses.csv",
               std::string(kShortHead) +
                   "0,1000,stereo_odometry,degraded,uncalibrated,1,2,3,0,0,0,1,100,5\n");
  folder.write("calibrations.csv", "stamp_ns,outcome,cause,reason,camera\n");
  folder.write("events.jsonl", "");
  folder.write("summary.json", R"({"metrics": null})");
  const Session s = read_session(folder.path());
  EXPECT_TRUE(s.missing.empty()) << s.missing.front();
  folder.write("summary.json", R"({"metrics": {"ate_m": 0.1}})");
  EXPECT_TRUE(test::mentions(missing(read_session(folder.path())), "reference.tum"))
      << "its figures stand in the summary";
}

TEST(ReadSession, damagedAndDisorderedLinesAreLeftOutAndCounted) {
  const Session s = with_poses(std::string(kShortHead) +
                               "# no row\r\n\n"
                               "0,1000,stereo_odometry,ok,,1,2,3,0,0,0,1,100,5\n"
                               "garbage\n"
                               "1,x,stereo_odometry,ok,,1,2,3,0,0,0,1,100,5\n"
                               "2,900,stereo_odometry,ok,,1,2,3,0,0,0,1,100,5\n"
                               "3,3000,dancing,splendid,,1,2,1e300,0,0,0,1,100,5\n"
                               "4,4000,stereo_odometry,ok,,nan,2,3,0,0,0,1,-1e99,inf\n"
                               "5,5000,stereo_odometry,ok,,1,2,3,0,0,0,0,100,5\n");
  EXPECT_TRUE(test::mentions(missing(s), "3 lines skipped: damaged",
                             "1 line skipped because the stamp does not increase"));
  ASSERT_EQ(s.frames.size(), 3U);
  EXPECT_FALSE(s.frames[1].posed);
  EXPECT_EQ(s.frames[1].inliers, -1);
  EXPECT_FALSE(s.frames[2].posed) << "a quaternion of no length";
}

}  // namespace
}  // namespace vergence::app::report
