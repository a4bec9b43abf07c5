#include "app/datasets/trajectory_files.hpp"

#include <sys/stat.h>

#include "app/datasets/text_file.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

using test::mentions;
using test::refusal_of;

constexpr const char* kGoodLine = "1.5 1 2 3 0 0 0 1\n";
/// Stamp in ns.
constexpr std::int64_t kFirst = 1403636584763555584;

constexpr const char* kSensor =
    "%YAML:1.0\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [0.0, -1.0, 0.0, 0.1,\n  "
    "       1.0, 0.0, 0.0, 0.2,\n         0.0, 0.0, 1.0, 0.3,\n         0.0, 0.0, 0.0, 1.0]\n";

/// As PowerShell writes a text.
std::string wide(const std::string& text) {
  std::string bytes = "\xFF\xFE";
  for (const char c : text) bytes += std::string{c, '\0'};
  return bytes;
}

/// A quarter turn about z at (1, 2, 3), some other poses after it.
struct Row {
  const char* name;
  std::string text;
  std::size_t poses;
  /// First stamp in ns.
  std::int64_t first;
  /// Part of the remarks; empty if none is expected.
  const char* remark;
};

TEST(Trajectory, readsVariantsOfPrograms) {
  const std::string q = " 0 0 0.70710678 0.70710678";
  const std::string moved = " 1 2 3" + q;
  const std::array rows{
      Row{"seconds",
          "# a comment\n\n1403636584.763555584" + moved + "\r\n1403636584.863555585\t1 2  3" + q, 2,
          kFirst, ""},
      Row{"byte order mark",
          "\xEF\xBB\xBF"
          "5" +
              moved,
          1, 5'000'000'000, ""},
      Row{"semicolons", "1.5; 1; 2; 3; 0; 0; 0.70710678; 0.70710678\n", 1, 1'500'000'000, ""},
      Row{"decimal commas", "1,5;1,0;2;3;0;0;0,70710678;0,70710678\n", 1, 1'500'000'000, ""},
      Row{"columns in another order",
          "# qx qy qz qw x y z timestamp\n0 0 0.70710678 0.70710678 1 2 3 1.5\n", 1, 1'500'000'000,
          ""},
      Row{"rostopic echo -p",
          "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.pose.position.x,"
          "field.pose.position.y,field.pose.position.z,field.pose.orientation.x,field.pose."
          "orientation.y,field.pose.orientation.z,field.pose.orientation.w\n"
          "1403636584999000000,1,1403636584763555584,map,1,2,3,0,0,0.70710678,0.70710678\n",
          1, kFirst, "nanoseconds"},
      Row{"an index and more columns",
          "0 1.5" + moved + " 7 7\n1 1.6" + moved + " 7 7\n2 1.7" + moved + " 7 7\n", 3,
          1'500'000'000, ""},
      Row{"unfinished", "1.5" + moved + "\n1.6 1 2", 1, 1'500'000'000, "incomplete"},
      Row{"a matrix with its time", "1.5 0 -1 0 1 1 0 0 2 0 0 1 3\n", 1, 1'500'000'000, ""},
      Row{"a matrix of 4 x 4", "1.5 0 -1 0 1 1 0 0 2 0 0 1 3 0 0 0 1\n", 1, 1'500'000'000, ""},
      Row{"a matrix of three decimals", "1.5 0.001 -1 0 1 1 0.001 0 2 0 0 1.001 3\n", 1,
          1'500'000'000, "few decimals"},
      Row{"UTF-16", wide("1.5" + moved + "\n"), 1, 1'500'000'000, ""},
  };
  const test::TemporaryFolder folder;
  for (const Row& row : rows) {
    const TrajectoryFile t = read_trajectory_file(folder.write("t.txt", row.text));
    ASSERT_EQ(t.poses.size(), row.poses) << row.name;
    EXPECT_EQ(t.poses.front().stamp.ns(), row.first) << row.name;
    const Transform& T = t.poses.front().T_world_body;
    EXPECT_LT((T * Vec3(1, 0, 0) - Vec3(1, 3, 3)).norm(), 2e-3) << row.name;
    EXPECT_LT((T.R * T.R.transpose() - Mat3::Identity()).norm(), 1e-14) << row.name;
    std::string said;
    for (const std::string& remark : t.remarks) said += remark + "; ";
    EXPECT_TRUE(mentions(said, row.remark)) << row.name;
    EXPECT_EQ(said.empty(), std::string_view(row.remark).empty()) << row.name << ": " << said;
  }
}

TEST(Trajectory, errorNamesFileAndLine) {
  const std::string good = kGoodLine;
  struct Case {
    std::string text, said;
  };
  const std::array cases{
      Case{good + "2.5 1 2 3 0 0 0\n", "t.tum:2: has 7 columns"},
      Case{"# c\n" + good + "2.5 1 two 3 0 0 0 1\n", "t.tum:3: `two` is not a finite number"},
      Case{good + "1e30 1 2 3 0 0 0 1\n", "t.tum:2: `1e30` is not a stamp"},
      Case{good + "2.5 1 2 3 1 1 0 1\n", "t.tum:2: the quaternion has the length 1.73"},
      Case{good + good + good, "t.tum: has the same stamp in all of its 3 rows"},
      Case{good + good + good + good + "1.6 1 2 3 0 0 0 1\n", "only 2 different stamps in 5 rows"},
      Case{"1 1 2\n", "t.tum:1: has 3 columns"},
      Case{"1 0 0 0 0 1 0 0 0 0 1 0\n1.02 0 0 7 0 1 0 8 0 0 1 9\n",
           "t.tum:2: the matrix is not a rotation"},
      Case{"1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 7 0 1 0 8 0 0 -1 9\n", "a reflection"},
      Case{"", "t.tum: has no pose"},
      Case{"# only words\n\n", "t.tum: has no pose"},
      Case{std::string(100, '\0') + "\n", "t.tum: has no pose"},
      Case{std::string(1U << 20U, 'x'), "t.tum: has no pose"},
  };
  const test::TemporaryFolder folder;
  for (const Case& c : cases) {
    const auto file = folder.write("t.tum", c.text);
    EXPECT_TRUE(mentions(refusal_of([&] { (void)read_tum(file); }), c.said))
        << c.text.substr(0, 80);
  }
  EXPECT_TRUE(mentions(refusal_of([&] { (void)read_tum(folder / "none.tum"); }),
                       "none.tum: cannot be opened (No such file"));
  EXPECT_TRUE(mentions(refusal_of([&] { (void)read_tum(folder.path()); }), "is a directory"));
  const std::filesystem::path pipe = folder / "pipe.tum";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_TRUE(mentions(refusal_of([&] { (void)read_tum(pipe); }), "is a pipe or a device"));
}

TEST(Trajectory, usesSuppliedUnit) {
  const test::TemporaryFolder folder;
  const std::string turn = " 1 2 3 0.70710678 0 0 0.70710678\n";
  const auto file = folder.write("t.txt", "0" + turn + "100" + turn + "200" + turn);
  TrajectoryOptions options{.unit_option = "--time-unit"};
  EXPECT_TRUE(
      mentions(refusal_of([&] { (void)read_trajectory_file(file, options); }), "--time-unit"));
  options.unit = TimeUnit::milliseconds;
  EXPECT_EQ(read_trajectory_file(file, options).poses[1].stamp.ns(), 100'000'000);
}

TEST(Kitti, posesUseAdjacentTimesFile) {
  const test::TemporaryFolder folder;
  const std::string first = "1 0 0 0 0 1 0 0 0 0 1 0\n";
  const auto poses = folder.write("poses/06.txt", first + "0 -1 0 4 1 0 0 5 0 0 1 6\n");
  EXPECT_FALSE(read_trajectory_file(poses).timed);
  EXPECT_EQ(read_trajectory_file(poses).rows, 2U);
  folder.write("sequences/06/times.txt", "12.5\n1.26e+01\n");
  for (const auto& path : {poses, folder / "sequences/06", folder / "sequences/06/"}) {
    const Trajectory t = read_trajectory_file(path).poses;
    ASSERT_EQ(t.size(), 2U) << path;
    EXPECT_EQ(t[1].stamp.ns(), 12600000000) << path;
    EXPECT_LT((t[1].T_world_body * Vec3(1, 0, 0) - Vec3(4, 6, 6)).norm(), 1e-15);
  }
  folder.write("sequences/06/times.txt", "0\n1\n2\n");
  EXPECT_TRUE(
      mentions(refusal_of([&] { (void)read_trajectory_file(poses); }), "has 2 poses, but "));
  folder.write("sequences/06/times.txt", "0\nsoon\n");
  EXPECT_TRUE(
      mentions(refusal_of([&] { (void)read_trajectory_file(poses); }), "times.txt:2: `soon`"));
  const std::vector<Stamp> times = {Stamp(30), Stamp(20)};
  EXPECT_EQ(read_trajectory_file(poses, {.times = times}).poses.front().stamp, Stamp(20))
      << "in the order of time";
  EXPECT_THROW((void)read_trajectory_file(poses, {.times = std::span(times).first(1)}), InputError);
}

TEST(Euroc, convertsBodyToLeftCamera) {
  const test::TemporaryFolder folder;
  // w first; a half turn about x; 17 columns; CR LF.
  const std::string text =
      "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
      "q_RS_z [], v_RS_R_x [m s^-1]\r\n"
      "1403636584763555584,1,2,3,0,1,0,0,0.1,0.2,0.3,0,0,0,0,0,0\r\n"
      "1403636584768555584,1,2,3,0,1,0,0,0.1,0.2,0.3,0,0,0,0,0,0\r\n";
  const auto alone = folder.write("alone/gt.csv", text);
  EXPECT_EQ(read_trajectory_file(alone).poses[0].T_world_body.t, Vec3(1, 2, 3)) << "of the body";
  EXPECT_TRUE(mentions(read_trajectory_file(alone).remarks.at(0), "cam0/sensor.yaml"));
  folder.write("mav0/cam0/sensor.yaml", kSensor);
  const auto csv = folder.write("mav0/state_groundtruth_estimate0/data.csv", text);
  for (const auto& path : {csv, folder.path(), folder / "mav0", folder / "mav0/"}) {
    const Trajectory t = read_trajectory_file(path).poses;
    ASSERT_EQ(t.size(), 2U) << path;
    EXPECT_EQ(t[0].stamp.ns(), 1403636584763555584);
    // Camera origin at (0.1, 0.2, 0.3) of the body, y and z turned over by the body's attitude.
    EXPECT_LT((t[0].T_world_body.t - Vec3(1.1, 1.8, 2.7)).norm(), 1e-15);
    // The camera's x axis is the body's y axis, which points along −y of the world.
    EXPECT_LT((t[0].T_world_body.R.col(0) - Vec3(0, -1, 0)).norm(), 1e-15);
  }
  const auto said = [&] { return refusal_of([&] { (void)read_trajectory_file(csv); }); };
  struct Case {
    const char *sensor, *said;
  };
  for (const Case& c :
       {Case{"rate_hz: 20\n", "sensor.yaml: has no T_BS"},
        Case{"a: 1\nT_BS:\n  data: [1, 0, 0]\n", "sensor.yaml:3: T_BS is not"},
        Case{"T_BS:\n  data: [1,0,0,0, 0,1,0,0, 0,0,1.01,0, 0,0,0,1]\n",
             "is not a rigid transform"},
        Case{"a: [1\nb: 2\n", "is not YAML"}, Case{"just words\n", "sensor.yaml: has no T_BS"}}) {
    folder.write("mav0/cam0/sensor.yaml", c.sensor);
    EXPECT_TRUE(mentions(said(), c.said));
  }
}

TEST(TimesFile, readsVariantsOfPrograms) {
  struct Case {
    const char* text;
    /// Stamp of the second line in ns.
    std::int64_t second;
    /// Name of the second line's left image.
    const char* name;
  };
  const test::TemporaryFolder folder;
  for (const Case& c : {
           Case{"1403636584763555584\n1403636584863555584\n", kFirst + 100'000'000, ""},
           Case{"1403636584763\n1403636584863\n", kFirst + 100'000'000 - 555'584, ""},
           Case{"1403636584763555\n1403636584863555\n", kFirst + 100'000'000 - 584, ""},
           Case{"timestamp,name\n1403636584763555584 , a.png\n1403636584863555584 , b.png\n",
                kFirst + 100'000'000, "b.png"},
           Case{"0 1.5 a.png\n1 1.6 b.png\n2 1.7", 1'600'000'000, "b.png"},
           Case{"1403636584 763555584\n1403636584 863555584\n", kFirst + 100'000'000, ""},
           Case{"1403636584.763555584\n1403636585.0\n", 1403636585000000000, ""},
           Case{"5.963555584\n6.63555584\n6.163555584\n", 6'063'555'584, ""},
           Case{"2014-06-24T18:29:44.5\n2014-06-24T18:29:45Z\n", 1403634585000000000, ""},
           Case{"2014-06-24 18:29:44.5 a.png\n2014-06-24 18:29:45 b.png\n", 1403634585000000000,
                "b.png"},
           Case{"0\n50000000\n100000000\n", 50'000'000, ""},
           // These are ns since the start.
           Case{"864000000000000\n864000050000000\n", 864000050000000, ""},
       }) {
    const TimesFile t = read_times_file(folder.write("times.txt", c.text));
    EXPECT_EQ(t.lines.at(1).stamp.ns(), c.second) << c.text;
    EXPECT_EQ(t.lines.at(1).name[0], c.name) << c.text;
  }
  for (const auto& [text, said] :
       {std::pair{"1\nnoon\n", "times.txt:2: `noon`"}, std::pair{"", "holds no times"},
        std::pair{"0.1,a.png\n0.2\n", "times.txt:2: differs from the other lines"},
        std::pair{"0.1,../a.png\n", "times.txt:1: `../a.png`"},
        std::pair{"0.1,a,b,c\n", "4 columns"}}) {
    const auto file = folder.write("times.txt", text);
    EXPECT_TRUE(mentions(refusal_of([&] { (void)read_times_file(file); }), said)) << text;
  }
}

TEST(Trajectory, findsTrajectoryInFolder) {
  const test::TemporaryFolder folder;
  EXPECT_TRUE(mentions(refusal_of([&] { (void)read_trajectory_file(folder.path()); }),
                       "has no trajectory.tum, no poses.txt"));
  EXPECT_FALSE(find_truth(folder.path()).has_value());
  folder.write("trajectory.tum", kGoodLine);
  EXPECT_EQ(read_trajectory_file(folder.path()).poses.front().stamp.ns(), 1500000000);
}

}  // namespace
}  // namespace vergence::app
