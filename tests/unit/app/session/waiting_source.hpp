#pragma once
#include <chrono>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include "app/session/session_runner.hpp"

namespace vergence::test {

/// A rig whose devices bring one black frame, if that, and whose drive is over after a while.
class WaitingSource : public app::FrameSource {
 public:
  using Milliseconds = std::chrono::milliseconds;

  explicit WaitingSource(Milliseconds drive) : drive_(drive), pixels_(160 * 120) {
    RigCalibration& rig = facts_.begin.file.rig;
    rig.cameras = 2;
    for (std::size_t k = 0; k < 2; ++k) {
      Intrinsics& lens = rig.intrinsics[k];
      lens.width = 160, lens.height = 120;
      lens.fx = lens.fy = 100;
      lens.cx = 79.5, lens.cy = 59.5;
    }
    rig.T_camera_left[1].t = {-0.5, 0, 0};
    rig.baseline = 0.5;
    facts_.begin.nominal = rig;
    facts_.first = Stamp(1'577'836'800'000'000'000);
  }

  [[nodiscard]] const app::SourceFacts& facts() const noexcept override { return facts_; }
  void start(std::vector<std::string>* /*faults*/) override {}
  [[nodiscard]] bool next(app::SourceItem* item) noexcept override {
    if (frames_ == 0) {
      std::this_thread::sleep_for(drive_);
      return false;
    }
    --frames_;
    *item = black_frame(0, facts_.first);
    return true;
  }
  void done(const PoseSample& /*sample*/) noexcept override {}
  void stop() noexcept override {}
  void finish(app::Progress* /*progress*/, std::vector<std::string>* /*faults*/) override {}
  void describe(const app::SessionTotals& /*totals*/, const Estimator& /*estimator*/,
                app::SummaryInput* /*input*/) const override {}
  void print_figures(const app::SessionTotals& /*totals*/, const app::SummaryInput& /*input*/,
                     app::Progress* /*progress*/) const override {}

 protected:
  [[nodiscard]] app::SourceFrame black_frame(std::uint64_t number, Stamp stamp) const {
    app::SourceFrame frame;
    frame.rig.number = number;
    frame.rig.stamp = stamp;
    frame.rig.cameras = 2;
    for (std::size_t k = 0; k < 2; ++k) frame.rig.images[k] = {pixels_.data(), 160, 120, 160};
    return frame;
  }

  app::SourceFacts facts_;
  int frames_ = 0;  // that come before the waiting

 private:
  Milliseconds drive_;
  std::vector<std::uint8_t> pixels_;
};

}  // namespace vergence::test
