#include "app/report/assessment.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include <fmt/ranges.h>

namespace vergence::app::report {
namespace {

using enum Grade;

bool any_has(const std::vector<std::string>& messages, const std::string& part) {
  return fmt::format("{}", fmt::join(messages, "\n")).find(part) != std::string::npos;
}

Stamp at(double s) { return Stamp(static_cast<std::int64_t>(std::llround(s * 1e9))); }

/// A drive with which nothing is wrong: 1000 frames, a reference, 0.8 % drift.
struct Case {
  Session session;
  Analysis analysis;

  Case() {
    for (int i = 0; i < 1000; ++i) {
      session.frames.push_back({.stamp = at(0.05 * i), .posed = true});
      session.frames.back().status = PoseStatus::ok;
      session.frames.back().estimate_ms = 10;
    }
    session.summary = {{"calibration", {{"rating", "good"}}},
                       {"timing_ms", {{"p99", 20.0}}},
                       {"runtime_allocations", 0}};
    analysis.read = analysis.ok = 1000;
    analysis.ok_share = 1.0;
    analysis.source = ErrorSource::reference;
    analysis.drift = 0.008;
    analysis.scale = 1.001;
    analysis.interval_s = 0.05;
  }
  nlohmann::json& calibration() { return session.summary["calibration"]; }
  CalibrationRow& attempt(bool accepted, const char* cause, double before_px, double after_px) {
    session.calibrations.push_back({.accepted = accepted,
                                    .decided = true,
                                    .cause = cause,
                                    .reason = accepted ? "" : "it is worse",
                                    .held_out_before_px = before_px,
                                    .held_out_after_px = after_px});
    return session.calibrations.back();
  }
  void event(double s, const char* kind, const std::string& message = "") {
    session.events.push_back({at(s), kind, message});
  }
  void frames_of(std::size_t degraded, std::size_t lost) {
    analysis.degraded = degraded, analysis.lost = lost, analysis.ok = 1000 - degraded - lost;
    analysis.ok_share = 1e-3 * static_cast<double>(analysis.ok);
  }
  /// Camera 0 is away.
  void outage(double from_s, double to_s) {
    event(from_s, "camera_disconnected", "camera 0 is disconnected"),
        event(to_s, "camera_reconnected", "camera 0 is back");
  }
  void given(bool verified) { attempt(true, "given", 0, 0), calibration()["verified"] = verified; }
};

struct Row {
  const char* name;
  std::function<void(Case&)> change;
  Grade grade;
  /// Part of a reason; empty accepts any.
  std::string reason = {};
  /// Part of an advice; empty accepts any.
  std::string advice = {};
};

TEST(Assessment, everyFindingHasGradeReasonAndAdvice) {
  const auto drift = [](double d) { return [d](Case& c) { c.analysis.drift = d; }; };
  const auto lost = [](std::size_t n) { return [n](Case& c) { c.frames_of(0, n); }; };
  const auto weak_by = [](const char* what) {
    return [what](Case& c) { c.calibration() = {{"rating", "poor"}, {"limited_by", what}}; };
  };
  const auto near_sigma = [](double percent) {
    return [percent](Case& c) {
      c.calibration()["rating"] = "poor";
      CalibrationRow& row = c.attempt(true, "refinement", 1, 0.2);
      row.reference_depth_m = 2.4, row.depth_sigma_percent = percent;
    };
  };
  const auto rejected = [](const char* cause, double before_px) {
    return [=](Case& c) {
      c.attempt(true, "from_scratch", 0, 0.2), c.attempt(false, cause, before_px, 0.2);
    };
  };
  const auto event = [](double s, const char* kind, const char* message) {
    return [=](Case& c) { c.event(s, kind, message); };
  };
  const std::vector<Row> rows{
      {"nothing is wrong", [](Case&) {}, good},
      {"no reference",
       [](Case& c) { c.analysis.source = ErrorSource::none, c.analysis.drift.reset(); }, care,
       "no reference"},
      {"an INS without an alignment",
       [](Case& c) { c.analysis.source = ErrorSource::none, c.analysis.ins_unplaced = true; }, care,
       "no ENU alignment", "comparison.alignment_distance_m"},
      {"drift of 2 %", drift(0.02), good},
      {"drift above 2 %", drift(0.021), care},
      {"drift of 5 %", drift(0.05), care},
      {"drift above 5 %", drift(0.051), bad},
      {"lengths", [](Case& c) { c.analysis.scale = 0.96; }, care, "too long"},
      {"5 % lost", lost(50), care},
      {"20 % lost", lost(200), bad},
      {"no pose",
       [](Case& c) {
         for (Frame& f : c.session.frames) f.posed = false;
       },
       bad, "no frame has a pose"},
      {"weak by lenses", weak_by("intrinsics"), bad, "calibration", "driving on does not help"},
      {"weak by noise", weak_by("noise"), bad, "calibration", "near and far structure"},
      {"short baseline, known well near", near_sigma(1), care, "1.0 % at 2.4 m"},
      {"short baseline, not known near", near_sigma(3), bad},
      {"a knock that was mended", [](Case& c) { c.attempt(true, "knock", 1.4, 0.2); }, good, "",
       "knocked"},
      {"rejected", rejected("drift", 1.4), care, "", "it is worse"},
      {"rejected, and the one in use fits as well", rejected("requested", 0.2), good},
      {"measured and kept",
       [](Case& c) {
         c.attempt(true, "given", 0, 0), c.attempt(false, "refinement", 1.4, 0.2).kept = true;
       },
       good},
      {"never a calibration", [](Case& c) { c.attempt(false, "from_scratch", 0, 0.9); }, care,
       "no calibration was found", "near and far"},
      {"never an attempt", [](Case& c) { c.calibration()["accepted"] = 0; }, care,
       "no calibration was found"},
      {"waited for the first confirmation",
       [](Case& c) {
         c.frames_of(400, 0);
         c.analysis.waited = 400, c.analysis.verified_s = 20;
         constexpr auto kReason = static_cast<std::size_t>(Reason::unverified_calibration);
         c.analysis.by_reason[kReason] = c.analysis.waited_by_reason[kReason] = 400;
         c.given(true);
       },
       good},
      {"not verified", [](Case& c) { c.given(false); }, care, "was never verified", "near objects"},
      {"not verified at the end", [](Case& c) { c.given(false), c.analysis.verified_s = 20; }, care,
       "at the end is not verified"},
      {"not monitored", [](Case& c) { c.given(false), c.calibration()["online"] = false; }, care,
       "calibration.online: off"},
      {"truncated, timed out",
       [](Case& c) {
         c.session.summary = nullptr, c.attempt(true, "given", 0, 0);
         c.frames_of(1000, 0), c.analysis.waited = 1000;
       },
       bad, "was never verified"},
      {"contradicted",
       [](Case& c) {
         c.attempt(true, "given", 0, 0);
         c.event(1, "calibration_contradicted", "its depths are off by 6.1 %");
       },
       care, "", "off by 6.1 %"},
      {"another focal length",
       [](Case& c) {
         c.calibration()["focal_length"] = {{"configured_px", 898.6},
                                            {"measured_px", 711.2},
                                            {"sigma_px", 12.0},
                                            {"doubted", true},
                                            {"contradicted", true}};
       },
       bad, "711 ± 12", "--focal"},
      {"probably another focal length",
       [](Case& c) {
         c.calibration()["focal_length"] = {{"configured_px", 898.6},
                                            {"measured_px", 795.2},
                                            {"sigma_px", 48.0},
                                            {"doubted", true},
                                            {"contradicted", false}};
       },
       care, "795 ± 48", "--focal"},
      {"scale of the INS", event(1, "scale_disagrees", "90.0 % longer"), care, "lengths disagree"},
      {"calibration not kept", event(2, "calibration_save_failed", "no room"), good, "", "no room"},
      {"truncated",
       [](Case& c) {
         c.session.summary = nullptr, c.session.missing = {"summary.json is missing"};
       },
       care, "incomplete", "not closed"},
      {"slow",
       [](Case& c) {
         for (std::size_t i = 0; i < 20; ++i) c.session.frames[i].estimate_ms = 80;
       },
       good, "", "frame interval"},
      {"allocations", [](Case& c) { c.session.summary["runtime_allocations"] = 3; }, good, "",
       "3 runtime allocations"},
      {"lines dropped", [](Case& c) { c.session.summary["drops"]["lines"] = 4; }, care, "4 lines"},
      // Outages
      {"a camera that never came back",
       event(49.96, "camera_disconnected", "camera 1 is disconnected; check it"), bad,
       "no frame after 50.0 s: camera 1 was disconnected",
       "Camera 1 was disconnected once, to the end"},
      {"a board that never came back", event(49.96, "trigger_board_disconnected", "x"), bad,
       "the trigger board was disconnected"},
      {"a camera that the others drove on without",
       event(30, "camera_disconnected", "camera 1 is disconnected"), care,
       "camera 1 was disconnected from 30.0 s to the end"},
      {"a loose cable",
       [](Case& c) {
         for (int i = 0; i < 50; ++i) c.outage(10 + 0.6 * i, 10.3 + 0.6 * i);
       },
       good, "", "Camera 0 was disconnected 50 times for 15.0 s"},
      {"a hole breaks the way, so that lengths say nothing",
       [](Case& c) {
         c.analysis.scale = 1.045;
         for (std::size_t i = 400; i < 800; ++i) c.session.frames[i].posed = false;
         c.outage(20, 40);
       },
       care, "camera 0 was disconnected for 20.0 s"},
      {"a short outage leaves lengths to be judged",
       [](Case& c) { c.analysis.scale = 1.045, c.outage(20, 23); }, care, "lengths are 4",
       "Lengths disagree"},
  };
  for (const Row& row : rows) {
    SCOPED_TRACE(row.name);
    Case c;
    row.change(c);
    const Assessment v = assess(c.session, c.analysis);
    EXPECT_EQ(v.grade, row.grade) << v.message;
    EXPECT_TRUE(row.reason.empty() || any_has(v.reasons, row.reason)) << v.message;
    EXPECT_TRUE(row.advice.empty() || any_has(v.advice, row.advice))
        << (v.advice.empty() ? "" : v.advice.front());
    if (row.grade == good && row.advice.empty()) {
      EXPECT_TRUE(v.reasons.empty() && v.advice.empty());
    }
  }
}

TEST(Assessment, worstReasonComesFirst) {
  Case c;
  c.session.missing = {"events.jsonl is missing"};
  c.frames_of(0, 500);
  const Assessment v = assess(c.session, c.analysis);
  EXPECT_EQ(v.grade, bad);
  ASSERT_EQ(v.reasons.size(), 2U);
  EXPECT_EQ(v.reasons.back(), "session files are incomplete");
  EXPECT_EQ(assess(Session{}, analyse(Session{})).grade, bad);
}

TEST(Assessment, everyReasonOfPoseHasAdvice) {
  for (int i = 1; i <= static_cast<int>(Reason::pairing_ambiguous); ++i) {
    Case c;
    c.analysis.by_reason[static_cast<std::size_t>(i)] = 3;
    c.event(1, "rig_changed");
    EXPECT_TRUE(any_has(assess(c.session, c.analysis).advice, "3 frames"))
        << to_string(static_cast<Reason>(i));
    c.session.events.clear();
    if (static_cast<Reason>(i) == Reason::recalibrating) {
      EXPECT_FALSE(any_has(assess(c.session, c.analysis).advice, "knocked")) << "a passing doubt";
    }
  }
}

/// Frames that are all degraded for one reason, the last `lost` of them without a pose.
Session degraded_drive(std::size_t frames, Reason reason, std::size_t lost = 0) {
  Session s;
  for (std::size_t i = 0; i < frames; ++i) {
    Frame f{.stamp = at(0.1 * static_cast<double>(i)), .posed = i + lost < frames};
    f.status = f.posed ? PoseStatus::degraded : PoseStatus::lost;
    f.reason = reason;
    s.frames.push_back(f);
  }
  s.summary = nlohmann::json::object();
  return s;
}

TEST(Usability, driveWithoutOkFrameIsNotUsable) {
  struct Drive {
    Session session;
    bool usable;
    std::string main_reason;
  };
  std::vector<Drive> drives{
      {degraded_drive(100, Reason::few_inliers), false, "few_inliers (100 of 100 frames)"},
      {degraded_drive(30, Reason::few_inliers), false, "few_inliers"},
      {degraded_drive(40, Reason::cameras_swapped, 40), false,
       "no frame has a pose: cameras_swapped"},
      {degraded_drive(30, Reason::unverified_calibration, 10), false, ""},
  };
  for (const Reason waits : {Reason::unverified_calibration, Reason::uncalibrated}) {
    drives.push_back({degraded_drive(59, waits), true, ""});
    drives.push_back({degraded_drive(60, waits), false, std::string(to_string(waits))});
  }
  // Why no calibration was found is the main reason.
  drives.push_back(
      {degraded_drive(100, Reason::uncalibrated), false, "the right camera is on the left"});
  CalibrationRow rejected{.reason = "the right camera is on the left"};
  drives.back().session.calibrations = {rejected};
  // Frames that stand still confirm nothing: fifty moved.
  drives.push_back({degraded_drive(100, Reason::unverified_calibration), true, ""});
  drives.back().session.summary = {{"calibration", {{"baseline_m", 0.5}}}};
  for (std::size_t i = 50; i < 100; ++i)
    drives.back().session.frames[i].T_world_left.t.z() = 0.2 * static_cast<double>(i - 50);
  // Frames that were not read are the reason where they are most.
  drives.push_back(
      {degraded_drive(1, Reason::unverified_calibration), false, "image_truncated (99 of 100"});
  drives.back().session.summary = {{"frames", {{"skipped", 99}}}};
  for (int i = 0; i < 99; ++i)
    drives.back().session.events.push_back({Stamp(i), "image_truncated", ""});
  // One ok frame.
  drives.push_back({degraded_drive(100, Reason::unverified_calibration), true, ""});
  drives.back().session.frames.back().status = PoseStatus::ok;
  for (std::size_t i = 0; i < drives.size(); ++i) {
    const Assessment v = assess(drives[i].session, analyse(drives[i].session));
    EXPECT_EQ(v.usable, drives[i].usable) << i;
    EXPECT_NE(v.main_reason.find(drives[i].main_reason), std::string::npos)
        << i << ": " << v.main_reason;
  }
}

}  // namespace
}  // namespace vergence::app::report
