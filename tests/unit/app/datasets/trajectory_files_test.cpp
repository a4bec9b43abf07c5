#include "app/datasets/trajectory_files.hpp"

#include <array>
#include <string_view>

#include "app/datasets/text_file.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <string>

#include "app/datasets/euroc_sensor.hpp"
#include "app/runtime/errors.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

/// What the InputError says; empty when there is none.
std::string last_error(const std::function<void()>& call) {
  try {
    call();
  } catch (const InputError& e) {
    return e.what();
  }
  return {};
}

testing::AssertionResult has(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "`" << text << "` does not have `" << part << "`";
}

/// Reads `text` as a TUM file and gives the complaint without the folder.
std::string tum_complaint(const std::string& text) {
  const test::TemporaryFolder folder;
  const auto file = folder.write("t.tum", text);
  std::string said = last_error([&] { (void)read_tum(file); });
  const std::string prefix = folder.path().string() + "/";
  if (said.starts_with(prefix)) said.erase(0, prefix.size());
  return said;
}

constexpr const char* kGoodLine = "1.5 1 2 3 0 0 0 1\n";

constexpr const char* kSensor =
    "%YAML:1.0\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [0.0, -1.0, 0.0, 0.1,\n  "
    "       1.0, 0.0, 0.0, 0.2,\n         "
    "0.0, 0.0, "
    "1.0, 0.3,\n         0.0, 0.0, 0.0, 1.0]\n";

TEST(Split, everyByteEndsAFieldOrBelongsToOne) {
  for (int byte = 0; byte < 256; ++byte) {
    const std::string line =
        std::string("1 2") + static_cast<char>(byte) + "3 " + static_cast<char>(byte);
    std::array<std::string_view, 8> fields;
    EXPECT_LE(split(line, ' ', fields), 4U) << byte;  // and it comes back
  }
}

TEST(Tum, readsStampsAsIntegersAndQuaternionsWithWLast) {
  const test::TemporaryFolder folder;
  const auto file =
      folder.write("t.tum",
                   "# a comment\n\n1403636584.763555584 1 -2 3.5e0 0 0 0.70710678 0.70710678\r\n"
                   "1403636584.763555585\t0 0 0   0 0 0 -1");
  const Trajectory t = read_tum(file);
  ASSERT_EQ(t.size(), 2U);
  EXPECT_EQ(t[0].stamp.ns(), 1403636584763555584);
  EXPECT_EQ(t[1].stamp.ns(), 1403636584763555585);
  EXPECT_EQ(t[0].T_world_body.t, Vec3(1, -2, 3.5));
  EXPECT_LT((t[0].T_world_body * Vec3(1, 0, 0) - Vec3(1, -1, 3.5)).norm(),
            1e-15);  // a quarter turn about z
  EXPECT_LT((t[0].T_world_body.R * t[0].T_world_body.R.transpose() - Mat3::Identity()).norm(),
            1e-15);
  EXPECT_EQ(t[1].T_world_body.R, Mat3(Mat3::Identity()));
}

TEST(Tum, saysFileAndLineOfWhatIsWrong) {
  const std::string good = kGoodLine;
  EXPECT_TRUE(has(tum_complaint(good + "2.5 1 2 3 0 0 0\n"), "t.tum:2: has 7 columns"));
  EXPECT_TRUE(has(tum_complaint(good + "2.5 1 2 3 0 0 0 1 9\n"), "t.tum:2: has 9 columns"));
  EXPECT_TRUE(has(tum_complaint("# c\n" + good + "2.5 1 two 3 0 0 0 1\n"),
                  "t.tum:3: `two` is not a finite number"));
  EXPECT_TRUE(has(tum_complaint(good + "2.5 nan 2 3 0 0 0 1\n"), "t.tum:2: `nan` is not"));
  EXPECT_TRUE(has(tum_complaint(good + "2.5 1e999 2 3 0 0 0 1\n"), "t.tum:2: `1e999` is not"));
  EXPECT_TRUE(has(tum_complaint(good + "2.5 -inf 2 3 0 0 0 1\n"), "t.tum:2: `-inf` is not"));
  EXPECT_TRUE(has(tum_complaint(good + "nan 1 2 3 0 0 0 1\n"), "t.tum:2: `nan` is not a stamp"));
  EXPECT_TRUE(has(tum_complaint(good + "1e30 1 2 3 0 0 0 1\n"), "t.tum:2: `1e30` is not a stamp"));
  EXPECT_TRUE(
      has(tum_complaint(good + "2.5 1 2 3 0 0 0 0\n"), "t.tum:2: the quaternion has length 0"));
  EXPECT_TRUE(
      has(tum_complaint(good + "2.5 1 2 3 1 1 0 1\n"), "t.tum:2: the quaternion has length 1.73"));
  EXPECT_TRUE(has(tum_complaint(good + good), "t.tum:2: the stamp 1.500000000 s is not later"));
  EXPECT_TRUE(has(tum_complaint(good + "1.4 1 2 3 0 0 0 1\n"),
                  "t.tum:2: the stamp 1.400000000 s is not later"));
  EXPECT_TRUE(has(tum_complaint(""), "t.tum: has no pose"));
  EXPECT_TRUE(has(tum_complaint("# only words\n\n"), "t.tum: has no pose"));
  EXPECT_TRUE(has(tum_complaint(std::string(100, '\0') + "\n"), "t.tum:1: has 1 columns"));
  EXPECT_TRUE(has(tum_complaint(std::string(1U << 20U, 'x')), "t.tum:1: has 1 columns"));
}

TEST(Tum, saysWhichFileCannotBeRead) {
  const test::TemporaryFolder folder;
  EXPECT_TRUE(has(last_error([&] { (void)read_tum(folder / "none.tum"); }),
                  "none.tum: cannot be opened (No such file"));
  EXPECT_TRUE(has(last_error([&] { (void)read_tum(folder.path()); }), "is a folder"));
}

TEST(Kitti, readsPosesWithTheirTimes) {
  const test::TemporaryFolder folder;
  const auto poses =
      folder.write("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n0 -1 0 4 1 0 0 5 0 0 1 6\n");
  folder.write("times.txt", "0.000000e+00\n1.044989e-01\n");
  for (const auto& path : {poses, folder.path()}) {
    const Trajectory t = read_trajectory(path);
    ASSERT_EQ(t.size(), 2U);
    EXPECT_EQ(t[1].stamp.ns(), 104498900);
    EXPECT_LT((t[1].T_world_body * Vec3(1, 0, 0) - Vec3(4, 6, 6)).norm(), 1e-15);
  }
}

TEST(Kitti, findsTheBenchmarksOwnTree) {
  const test::TemporaryFolder folder;
  const auto poses = folder.write("poses/06.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n");
  folder.write("sequences/06/times.txt", "12.5\n");
  for (const auto& path : {poses, folder / "sequences/06", folder / "sequences/06/"})
    EXPECT_EQ(read_trajectory(path).front().stamp.ns(), 12500000000) << path;
}

TEST(Kitti, normalisesRoundedRotationsAndRefusesOthersByFileAndLine) {
  const test::TemporaryFolder folder;
  folder.write("times.txt", "0\n1\n");
  const std::string first = "1 0 0 0 0 1 0 0 0 0 1 0\n";
  const auto poses = folder.write("poses.txt", first + "1.000001 1e-6 0 7 0 1 0 8 0 0 1 9\n");
  const Mat3 R = read_trajectory(poses)[1].T_world_body.R;
  EXPECT_LT((R * R.transpose() - Mat3::Identity()).norm(), 1e-14);

  folder.write("poses.txt", first + "1.0005 0 0 7 0 1 0 8 0 0 1 9\n");  // R Rᵀ − I: 1.0e-3
  EXPECT_TRUE(has(last_error([&] { (void)read_trajectory(poses); }),
                  "poses.txt:2: the matrix is not a rotation"));
  folder.write("poses.txt", first + "1 0.001 0 7 0 1 0 8 0 0 1 9\n");
  EXPECT_TRUE(has(last_error([&] { (void)read_trajectory(poses); }),
                  "poses.txt:2: the matrix is not a rotation"));
  folder.write("poses.txt", first + "1 0 0 7 0 1 0 8 0 0 -1 9\n");
  EXPECT_TRUE(has(last_error([&] { (void)read_trajectory(poses); }), "a reflection"));
}

TEST(Kitti, saysWhenPosesAndTimesDoNotBelongTogether) {
  const test::TemporaryFolder folder;
  const std::string line = "1 0 0 0 0 1 0 0 0 0 1 0\n";
  const auto poses = folder.write("poses.txt", line + line);
  const auto said = [&] { return last_error([&] { (void)read_trajectory(poses); }); };
  EXPECT_TRUE(has(said(), "put the sequence's times.txt beside it"));
  folder.write("times.txt", "0\n");
  EXPECT_TRUE(has(said(), "poses.txt:2: is pose 2, but "));
  folder.write("times.txt", "0\n1\n2\n");
  EXPECT_TRUE(has(said(), "has 2 poses, but "));
  folder.write("times.txt", "0\n0\n");
  EXPECT_TRUE(has(said(), "times.txt:2: the time is not later"));
  folder.write("times.txt", "0\nsoon\n");
  EXPECT_TRUE(has(said(), "times.txt:2: `soon` is not a time"));
  folder.write("poses.txt", line + "1 0 0 0 0 1 0 0 0 0 1\n");
  folder.write("times.txt", "0\n1\n");
  EXPECT_TRUE(has(said(), "poses.txt:2: has 11 numbers"));
}

TEST(Euroc, bringsTheBodyToTheLeftCamera) {
  const test::TemporaryFolder folder;
  folder.write("mav0/cam0/sensor.yaml", kSensor);
  // w first; a half turn about x; 17 columns; CR LF.
  const auto csv = folder.write("mav0/state_groundtruth_estimate0/data.csv",
                                "#timestamp, p_RS_R_x [m], …\r\n"
                                "1403636584763555584,1,2,3,0,1,0,0,0.1,0.2,0.3,0,0,0,0,0,0\r\n"
                                "1403636584768555584,1,2,3,0,1,0,0,0.1,0.2,0.3,0,0,0,0,0,0\r\n");
  for (const auto& path : {csv, folder.path(), folder / "mav0", folder / "mav0/"}) {
    const Trajectory t = read_trajectory(path);
    ASSERT_EQ(t.size(), 2U) << path;
    EXPECT_EQ(t[0].stamp.ns(), 1403636584763555584);
    // Camera origin at (0.1, 0.2, 0.3) of the body, y and z turned over by the body's attitude.
    EXPECT_LT((t[0].T_world_body.t - Vec3(1.1, 1.8, 2.7)).norm(), 1e-15);
    // The camera's x axis is the body's y axis, which points along −y of the world.
    EXPECT_LT((t[0].T_world_body.R.col(0) - Vec3(0, -1, 0)).norm(), 1e-15);
  }
}

TEST(Euroc, readsEightColumnsToo) {
  const test::TemporaryFolder folder;
  folder.write("cam0/sensor.yaml", kSensor);
  const auto csv = folder.write("data.csv", "5,1,2,3,1,0,0,0\n");
  EXPECT_LT((read_trajectory(csv)[0].T_world_body.t - Vec3(1.1, 2.2, 3.3)).norm(), 1e-15);
}

TEST(Euroc, saysFileAndLineOfWhatIsWrong) {
  const test::TemporaryFolder folder;
  const auto csv = folder.write("data.csv", "5,1,2,3,1,0,0,0\n6,1,2,3,1,0,0\n");
  const auto said = [&] { return last_error([&] { (void)read_trajectory(csv); }); };
  EXPECT_TRUE(has(said(), "put cam0/sensor.yaml"));
  folder.write("cam0/sensor.yaml", kSensor);
  EXPECT_TRUE(has(said(), "data.csv:2: has 7 columns"));
  folder.write("data.csv", "5.5,1,2,3,1,0,0,0\n");
  EXPECT_TRUE(has(said(), "data.csv:1: `5.5` is not a stamp in whole nanoseconds"));
  folder.write("data.csv", "5,1,2,3,1,0,0,0\n5,1,2,3,1,0,0,0\n");
  EXPECT_TRUE(has(said(), "data.csv:2: the stamp"));
  folder.write("data.csv", "5,1,,3,1,0,0,0\n");
  EXPECT_TRUE(has(said(), "data.csv:1: `` is not a finite number"));

  folder.write("data.csv", "5,1,2,3,1,0,0,0\n");
  folder.write("cam0/sensor.yaml", "rate_hz: 20\n");
  EXPECT_TRUE(has(said(), "sensor.yaml: has no T_BS"));
  folder.write("cam0/sensor.yaml", "a: 1\nT_BS:\n  data: [1, 0, 0]\n");
  EXPECT_TRUE(has(said(), "sensor.yaml:3: T_BS data"));
  folder.write("cam0/sensor.yaml", "T_BS:\n  data: [1,0,0,0, 0,1,0,0, 0,0,1.01,0, 0,0,0,1]\n");
  EXPECT_TRUE(has(said(), "sensor.yaml:2: T_BS is not a rigid transform"));
  folder.write("cam0/sensor.yaml", "T_BS:\n  data: [1,0,0,x, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n");
  EXPECT_TRUE(has(said(), "sensor.yaml:2: T_BS data"));
  folder.write("cam0/sensor.yaml", "a: [1\nb: 2\n");
  EXPECT_TRUE(has(said(), "is not YAML"));
  folder.write("cam0/sensor.yaml", "just words\n");
  EXPECT_TRUE(has(said(), "is not a sensor.yaml"));
  folder.write("cam0/sensor.yaml", std::string(100000, '['));
  EXPECT_TRUE(has(said(), "is not YAML"));
}

TEST(Trajectory, folderWithoutOneSaysWhatWasLookedFor) {
  const test::TemporaryFolder folder;
  EXPECT_TRUE(has(last_error([&] { (void)read_trajectory(folder.path()); }),
                  "has no trajectory.tum, no poses.txt"));
  EXPECT_FALSE(find_truth(folder.path()).has_value());
}

TEST(Trajectory, sessionFolderStandsForItsTrajectory) {
  const test::TemporaryFolder folder;
  folder.write("trajectory.tum", kGoodLine);
  EXPECT_EQ(read_trajectory(folder.path()).front().stamp.ns(), 1500000000);
}

TEST(Trajectory, kittiExcerptIsTheReferenceOfPairC) {
  const auto folder = test::shared_data("data/kitti06_51"),
             tum = test::shared_data("data/eval/c_reference.tum");
  if (!folder || !tum) GTEST_SKIP() << test::shared_data_missing("data/kitti06_51");
  const Trajectory kitti = read_trajectory(*folder), reference = read_trajectory(*tum);
  ASSERT_EQ(kitti.size(), 51U);
  ASSERT_EQ(reference.size(), kitti.size());
  for (std::size_t i = 0; i < kitti.size(); ++i) {
    EXPECT_LE(std::abs((kitti[i].stamp - reference[i].stamp).ns()),
              500);  // six decimals in the TUM file, seven digits here
    EXPECT_LT((kitti[i].T_world_body.t - reference[i].T_world_body.t).norm(),
              2e-9);  // nine decimals in the TUM file
    // Which of the rotations near a rounded matrix is taken differs by the rounding, seven digits.
    EXPECT_LT(rotation_angle(kitti[i].T_world_body.R.transpose() * reference[i].T_world_body.R),
              5e-7);
  }
}

TEST(Trajectory, kittiPosesWithTimesInHandLeaveOutThoseThatGoBackwards) {
  const test::TemporaryFolder folder;
  std::string rows;
  for (int i = 0; i < 4; ++i) rows += "1 0 0 " + std::to_string(i) + " 0 1 0 0 0 0 1 0\n";
  const auto file = folder.write("poses.txt", rows);
  const std::vector<Stamp> times = {Stamp(10), Stamp(30), Stamp(20), Stamp(31)};
  const Trajectory trajectory = read_kitti(file, times);
  ASSERT_EQ(trajectory.size(), 3U);
  EXPECT_EQ(trajectory[2].stamp, Stamp(31));
  EXPECT_EQ(trajectory[2].T_world_body.t.x(), 3.0);
  EXPECT_THROW((void)read_kitti(file, std::span(times).first(3)), InputError);
}

TEST(Trajectory, eurocExcerptGivesTheKnownLeftCamera) {
  const auto folder = test::shared_data("data/euroc_mh01"),
             tum = test::shared_data("data/eval/euroc_mh01_left_camera.tum");
  if (!folder || !tum) GTEST_SKIP() << test::shared_data_missing("data/euroc_mh01");
  const Trajectory truth = read_trajectory(*folder), expected = read_trajectory(*tum);
  EXPECT_EQ(truth.size(), 1140U);
  ASSERT_EQ(expected.size(), 105U);
  std::size_t i = 0;
  for (const StampedPose& e : expected) {
    while (i < truth.size() && truth[i].stamp < e.stamp) ++i;
    ASSERT_LT(i, truth.size());
    ASSERT_EQ(truth[i].stamp, e.stamp);
    EXPECT_LT((truth[i].T_world_body.t - e.T_world_body.t).norm(), 2e-9);  // nine decimals
    EXPECT_LT(rotation_angle(truth[i].T_world_body.R.transpose() * e.T_world_body.R), 4e-9);
  }
}

}  // namespace
}  // namespace vergence::app
