#include "core/estimator/states.hpp"

#include "core/estimator/degradations.hpp"
#include "tests/support/mentions.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence {
namespace {

constexpr std::array kStateNames = {"none", "unverified", "verified", "suspect"};
constexpr std::array kTriggerNames = {"adopted",      "adopted_verified", "verified",
                                      "contradicted", "suspected",        "kept"};
constexpr std::array kEstimatorTriggerNames = {"calibration_given",
                                               "pair_found",
                                               "frames_enough",
                                               "calibration_accepted",
                                               "calibration_rejected",
                                               "calibration_kept",
                                               "rig_changed",
                                               "requested",
                                               "pose_lost",
                                               "pose_found",
                                               "pose_found_suspect",
                                               "pose_found_uncalibrated"};
constexpr std::array kDegradationNames = {"pairing",     "scene",         "frame",
                                          "out_of_sync", "late_image",    "rig",
                                          "calibration", "dynamic_scene", "window"};
static_assert(kDegradationNames.size() == kDegradations);

std::string edge(std::string_view from, std::string_view to, std::string_view on) {
  return std::string(from) + " --> " + std::string(to) + ": " + std::string(on) + "\n";
}

std::ptrdiff_t arrows(const std::string& text) {
  std::ptrdiff_t n = 0;
  for (std::size_t at = 0; (at = text.find("--> ", at)) != std::string::npos; ++at) ++n;
  return n;
}

TEST(CalibrationStates, suspectAndVerifiedHaveTheirTriggersOnly) {
  using S = CalibrationState;
  using T = CalibrationTrigger;
  for (const auto& t : kCalibrationTransitions) {
    EXPECT_EQ(t.to == S::suspect, t.on == T::suspected);
    EXPECT_EQ(t.to == S::verified, t.on == T::verified || t.on == T::adopted_verified);
    EXPECT_NE(t.to, S::none);
    EXPECT_EQ(find_edge(kCalibrationTransitions, t.from, t.on), &t) << "a row hides another";
  }
  EXPECT_EQ(find_edge(kCalibrationTransitions, S::none, T::suspected), nullptr);
  EXPECT_EQ(find_edge(kCalibrationTransitions, S::suspect, T::verified), nullptr);
}

TEST(CalibrationStates, readmeDiagramsMatchTheTables) {
  const std::string text = test::read_file(VERGENCE_SOURCE_DIR "/core/README.md");
  for (const auto& t : kCalibrationTransitions) {
    const std::string line = edge(kStateNames[static_cast<std::size_t>(t.from)],
                                  kStateNames[static_cast<std::size_t>(t.to)],
                                  kTriggerNames[static_cast<std::size_t>(t.on)]);
    EXPECT_TRUE(test::mentions(text, line)) << line;
  }
  for (const auto& t : kTransitions) {
    EXPECT_EQ(find_edge(kTransitions, t.from, t.on), &t) << "a row hides another";
    const std::string line = edge(to_string(t.from), to_string(t.to),
                                  kEstimatorTriggerNames[static_cast<std::size_t>(t.on)]);
    EXPECT_TRUE(test::mentions(text, line)) << line;
  }
  EXPECT_EQ(arrows(text),
            static_cast<std::ptrdiff_t>(kCalibrationTransitions.size() + kTransitions.size()));
  std::size_t at = 0;
  for (const char* name : kDegradationNames) {
    const std::size_t row = text.find("| `" + std::string(name) + "` |", at);
    ASSERT_NE(row, std::string::npos) << name << " is missing, or out of its order";
    at = row;
  }
}

}  // namespace
}  // namespace vergence
