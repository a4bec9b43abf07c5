#include <gtest/gtest.h>

#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/session/ins_file.hpp"
#include "core/comparison/comparison.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence::app {
namespace {

using test::Outcome;

Outcome evaluate_command(const std::vector<std::string>& words) {
  return test::run_vergence(fmt::format("evaluate '{}'", fmt::join(words, "' '")));
}

/// Every figure of `expected` is in `got` at the same place and agrees to six digits (expected has
/// eight).
void expect_same(const nlohmann::json& expected, const nlohmann::json& got,
                 const std::string& name) {
  const nlohmann::json figures = expected.flatten();
  for (const auto& [place, value] : figures.items()) {
    SCOPED_TRACE(name + place);
    const nlohmann::json::json_pointer at(place);
    ASSERT_TRUE(got.contains(at));
    if (expected[at.parent_pointer()].is_array()) {
      ASSERT_EQ(got[at.parent_pointer()].size(), expected[at.parent_pointer()].size());
    }
    ASSERT_TRUE(got[at].is_number());
    const double e = value.get<double>();
    EXPECT_NEAR(e, got[at].get<double>(), value.is_number_integer() ? 0 : 1e-6 * std::abs(e));
  }
}

TEST(EvaluateCommand, matchesReferenceToSixDigits) {
  const auto folder = test::shared_data("data/eval");
  if (!folder) GTEST_SKIP() << test::shared_data_missing("data/eval");
  const auto answers = nlohmann::json::parse(test::read_file(*folder / "expected.json"));
  ASSERT_EQ(answers.size(), 5U);
  for (const auto& [name, answer] : answers.items()) {
    const std::string pair = name.substr(0, 1);
    for (const auto& segments : answer["segments"]) {
      const Outcome o = evaluate_command(
          {(*folder / (pair + "_estimate.tum")).string(),
           (*folder / (pair + "_reference.tum")).string(), "--json", "--lengths",
           fmt::format("{}", fmt::join(segments["lengths"].get<std::vector<double>>(), ",")),
           "--step", segments["step"].dump(), "--associate",
           name == "b_nearest" ? "nearest" : "interpolate", "--max-gap",
           pair == "b" ? "0.1" : "0.2", "--axes", pair < "c" ? "flu" : "camera"});
      ASSERT_EQ(o.code, 0) << o.err;
      auto expected = answer;
      expected["segments"] = nlohmann::json::array({segments});
      // Compared below; where nothing was dropped, it has no figures.
      expected.erase("dropped");
      const auto got = nlohmann::json::parse(o.out);
      expect_same(expected, got, name);
      EXPECT_EQ(got["dropped"], answer["dropped"]);
      // Only the path of pair c is straight.
      EXPECT_EQ(got["roll_about_path_unobservable"], pair == "c");
    }
  }
}

/// A drive round corners on rolling ground, at 6 m/s along x.
Transform place_at(double t) {
  Transform T;
  T.R = exp_so3(Vec3(0, 0, 0.9 * std::sin(0.15 * t) + 0.4 * std::sin(0.6 * t))) *
        exp_so3(Vec3(0.06 * std::sin(0.9 * t), 0.08 * std::sin(0.7 * t), 0));
  T.t = {6 * t, 25 * std::sin(0.15 * t), std::sin(0.7 * t)};
  return T;
}

std::string tum_line(double stamp, const Transform& T) {
  const Eigen::Quaterniond q(T.R);
  return fmt::format("{:.9f} {:.9f} {:.9f} {:.9f} {:.12f} {:.12f} {:.12f} {:.12f}\n", stamp,
                     T.t.x(), T.t.y(), T.t.z(), q.x(), q.y(), q.z(), q.w());
}

TEST(EvaluateCommand, estimatesInsExtrinsics) {
  // The reference sits 0.8 m forward and 0.3 m left of the estimate, its clock 30 ms late.
  const test::TemporaryFolder folder;
  std::string ours, theirs;
  const Transform T_ours_theirs{exp_so3(Vec3(0, 0, 0.1)), Vec3(0.8, 0.3, 0)};
  for (int i = 0; i < 2400; ++i) {
    const double at = 0.05 * i;
    ours += tum_line(1000 + at, place_at(at));
    theirs += tum_line(1000.03 + at, place_at(at) * T_ours_theirs);
  }
  const std::string a = folder.write("ours.tum", ours).string(),
                    b = folder.write("theirs.tum", theirs).string();
  const Outcome outcome =
      evaluate_command({a, b, "--axes", "flu", "--estimate-ins-extrinsics", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto mount = nlohmann::json::parse(outcome.out).at("mount");
  // T_ref_est is the inverse: turned back, and the arm seen from the reference.
  EXPECT_NEAR(mount["rotation_deg"]["z"]["value"].get<double>(), -0.1 * 180 / M_PI, 0.02);
  EXPECT_NEAR(mount["lever_arm_m"]["x"]["value"].get<double>(),
              -(0.8 * std::cos(0.1) + 0.3 * std::sin(0.1)), 0.02);
  EXPECT_NEAR(mount["lever_arm_m"]["y"]["value"].get<double>(),
              0.8 * std::sin(0.1) - 0.3 * std::cos(0.1), 0.02);
  EXPECT_NEAR(mount["clock_offset_s"]["value"].get<double>(), 0.03, 1e-3);
  EXPECT_LT(mount["lever_arm_m"]["x"]["sigma"].get<double>(), 0.1);
}

/// A session of that drive with its INS: the left camera 0.9 m forward
/// and 0.4 m left of it, turned by 2° of yaw, the INS's stamps 12 ms late.
std::string session_with_ins(const test::TemporaryFolder& folder, const std::string& name) {
  const LocalTangentPlane plane({-27.5, 153, 60});
  Transform T_ins_left = mount_of({0.9, 0.4, 0}, {0, 0, 2 * M_PI / 180});
  std::string ours, readings = std::string(kInsHeader) + "\n", line;
  // The world of the odometry starts at the first left camera pose.
  const Transform T_world_enu = (place_at(0) * T_ins_left).inverse();
  for (int i = 0; i < 4800; ++i) {
    const double t = 0.025 * i;
    const Transform T = place_at(t);
    if (i % 2 == 0) ours += tum_line(1000 + t, T_world_enu * T * T_ins_left);
    InsRecord r;
    r.sample.stamp = Stamp(1'000'012'000'000 + i * 25'000'000LL);
    r.sample.fix = FixStatus::fix_3d;
    r.sample.position = plane.to_geodetic(T.t);
    const Mat3 R_local_enu = plane.rotation_from(r.sample.position).transpose();
    const Eigen::Quaterniond q(R_local_enu * T.R);
    r.sample.attitude_valid = r.sample.velocity_valid = true;
    r.sample.q_enu_ins = {q.x(), q.y(), q.z(), q.w()};
    const Vec3 v = R_local_enu * (place_at(t + 1e-4).t - place_at(t - 1e-4).t) / 2e-4;
    r.sample.velocity_enu = {v.x(), v.y(), v.z()};
    format_ins_record(r, &line);
    readings += line;
  }
  folder.write(name + "/trajectory.tum", ours);
  return folder.write(name + "/ins.csv", readings).parent_path().string();
}

/// The poses are the truth and so is the INS, but for its 12 ms: at 0.375 rad/s of yaw and 0.08 of
/// roll and pitch at most that is 0.264 deg, and a segment that begins turned by it ends off by
/// 0.46 % of its length.
TEST(EvaluateCommand, comparesInsOfSessionAtLeftCamera) {
  const test::TemporaryFolder folder;
  const std::string session = session_with_ins(folder, "s"), ins = session + "/ins.csv",
                    elsewhere = folder.write("t.tum", test::read_file(session + "/trajectory.tum"));
  const auto figures = [&](const std::string& estimate, const std::string& axes = "camera") {
    const Outcome o = evaluate_command({estimate, ins, "--axes", axes, "--json"});
    EXPECT_EQ(o.code, 0) << o.err;
    return nlohmann::json::parse(o.out);
  };
  folder.write("s/summary.json", R"({"enu": {"mount": {"lever_arm_m": [0.9, 0.4, 0],
                                    "boresight_deg": [0, 0, 2], "source": "the test"}}})");
  for (const std::string& estimate : {session, elsewhere}) {
    const auto reported = figures(estimate);
    EXPECT_LT(reported["heading_error_deg"]["max_abs"], 0.27);
    EXPECT_LT(reported["rotation_error_deg"]["max"], 0.27);
    EXPECT_LT(reported["segments"][0]["t_percent"], 0.5);
    EXPECT_LT(reported["end_error_start_aligned_percent"], 0.5);
    EXPECT_EQ(reported["ins_mount"]["boresight_deg"][2], 2);
  }
  EXPECT_FALSE(figures(session, "flu").contains("ins_mount")) << "both are forward, left, up";

  // Nobody says how it sits: what is left is the boresight of two degrees.
  for (const char* summary : {"{}", "{\"earth\": null}", "[1]", "truncated",
                              R"({"enu": {"mount": {"lever_arm_m": [0, 0, 0]}}})"}) {
    folder.write("s/summary.json", summary);
    const auto axes = figures(session);
    EXPECT_NEAR(axes["heading_error_deg"]["rms"].get<double>(), 2, 0.27) << summary;
    EXPECT_EQ(axes["ins_mount"]["source"], "the axes only");
  }
}

TEST(EvaluateCommand, refusesInvalidArguments) {
  const test::TemporaryFolder folder;
  const std::string a = folder.write("a.tum", "1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n").string();
  const auto refused = [&](std::vector<std::string> words, const std::string& part) {
    words.insert(words.begin(), {a, a});
    const Outcome o = evaluate_command(words);
    EXPECT_EQ(o.code, 2) << part;
    EXPECT_TRUE(o.out.empty());
    EXPECT_NE(o.err.find(part), std::string::npos) << o.err;
  };
  refused({"--lengths", "10,,30"}, "`` is not a length");
  refused({"--lengths", "10,-5"}, "`-5` is not a length");
  refused({"--lengths", "nan"}, "`nan` is not a length");
  refused({"--step", "0"}, "--step");
  refused({"--step", "many"}, "--step");
  refused({"--associate", "guess"}, "guess");
  refused({"--axes", "north"}, "north");
  refused({"--max-gap", "-1"}, "--max-gap");
  refused({"--max-gap", "nan"}, "--max-gap");
  refused({"--max-difference", "1e300"}, "--max-difference");
  EXPECT_EQ(evaluate_command({(folder / "none.tum").string(), a}).code, 2);
  EXPECT_EQ(evaluate_command({a}).code, 2);
}

}  // namespace
}  // namespace vergence::app
