// Whole drives of the mock as KITTI raw drives at the data set's rates: what the comparison and the
// mount come to.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tests/support/kitti_raw_writer.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/system/run/session.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence::test {
namespace {

// Degrees: a mount that is found has to know more than MountOptions::rotation_sigma, the drawing's.
constexpr double kHalfOfADrawing = 1;

struct WholeDrive {
  const char* name;
  std::string drive;
  double seconds;
  int seed;
  bool rectified;
  int oxts_rate;
};

void PrintTo(const WholeDrive& d, std::ostream* out) { *out << d.name; }

// 10 Hz and an image of 621 x 256, half the data set's, with its field of view.
app::Configuration configuration_of(const WholeDrive& d) {
  std::vector<std::string> set{"cameras.0.size=[620, 256]",
                               "cameras.1.size=[620, 256]",
                               "cameras.0.intrinsics=[360, 360, 305, 118]",
                               "cameras.1.intrinsics=[360, 360, 305, 118]",
                               "rig.nominal.baseline_m=0.537",
                               "trigger.rate=10",
                               "mock.ins=ideal",
                               "mock.texture_detail=0",
                               "ins.lever_arm_m=[1.083, -0.310, 0.730]",
                               "ins.boresight_deg=[-0.813, -0.725, 0.487]",
                               "mock.drive=" + d.drive,
                               fmt::format("mock.seed={}", d.seed),
                               fmt::format("ins.rate={}", d.oxts_rate)};
  if (!d.rectified)
    set.insert(set.end(), {"cameras.0.distortion=[-0.37, 0.2, 0.002, 0.001, -0.07]",
                           "cameras.1.distortion=[-0.36, 0.18, 0.001, -0.001, -0.05]"});
  return app::load_configuration(std::string(VERGENCE_SOURCE_DIR) + "/app/config/mock.yaml", set);
}

class KittiRawWhole : public ::testing::TestWithParam<WholeDrive> {};

TEST_P(KittiRawWhole, driftHeadingAndMount) {
  const WholeDrive& d = GetParam();
  const TemporaryFolder work;
  const std::string session = (work / "session").string();
  write_kitti_raw(configuration_of(d), d.seconds,
                  {d.rectified, true, static_cast<std::uint64_t>(d.seed)}, work / "data");
  const Outcome o = run_vergence("replay '" + (work / "data").string() +
                                 "' --format kitti-raw --quiet --out '" + session + "'");
  ASSERT_EQ(o.code, 0) << o.err;
  const auto summary = summary_of(session);
  const auto& errors = summary["earth"]["errors"];
  ASSERT_TRUE(errors.is_object());
  std::printf(
      "%s: way %.1f m, horizontal end %.2f m (%.2f %%) max %.2f, heading rms %.3f end %.3f deg, "
      "scale %.4f\n",
      d.name, summary["earth"]["way_m"].get<double>(), errors["horizontal_end_m"].get<double>(),
      errors["horizontal_end_percent"].get<double>(), errors["horizontal_max_m"].get<double>(),
      errors["heading_rms_deg"].get<double>(), errors["heading_end_deg"].get<double>(),
      summary["metrics"]["scale"].get<double>());
  EXPECT_LT(errors["horizontal_end_percent"].get<double>(), 0.8);
  EXPECT_LT(errors["heading_rms_deg"].get<double>(), 0.5);

  const Outcome found = run_vergence("evaluate '" + session + "' --estimate-mount --json");
  ASSERT_EQ(found.code, 0) << found.err;
  const auto mount = nlohmann::json::parse(found.out).at("mount");
  const std::array<double, 3> turn{-0.816, -0.721, 0.492},
      arm{1.083, -0.310, 0.730};  // yaw, pitch, roll one after the other as a rotation vector
  for (std::size_t k = 0; k < 3; ++k) {
    const std::string axis(1, "xyz"[k]);
    const auto tell = [&](const char* what, const nlohmann::json& v, double truth) {
      if (v["value"].is_null()) {
        std::printf("  %s %s not observable, sigma %.3f\n", what, axis.c_str(),
                    v["sigma"].get<double>());
        return;
      }
      const double error = v["value"].get<double>() - truth, sigma = v["sigma"];
      std::printf("  %s %s error %+.4f sigma %.4f (%.1f)\n", what, axis.c_str(), error, sigma,
                  error / sigma);
      EXPECT_LT(std::abs(error), 3 * sigma) << what << ' ' << axis;
    };
    tell("turn, deg,", mount["rotation_deg"][axis], turn[k]);
    tell("arm, m,", mount["lever_arm_m"][axis], arm[k]);
    ASSERT_TRUE(mount["rotation_deg"][axis]["value"].is_number()) << axis;
    EXPECT_NEAR(mount["rotation_deg"][axis]["value"].get<double>(), turn[k], kHalfOfADrawing)
        << axis;
  }
  std::printf("  clock %s\n", mount["clock_offset_s"].dump().c_str());
}

INSTANTIATE_TEST_SUITE_P(Drives, KittiRawWhole,
                         ::testing::Values(WholeDrive{"sync", "figure-eight", 45, 1, true, 10},
                                           WholeDrive{"extract", "loop", 90, 2, false, 100},
                                           WholeDrive{"syncLong", "figure-eight", 120, 3, true,
                                                      10}),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace vergence::test
