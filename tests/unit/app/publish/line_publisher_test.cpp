#include "app/publish/line_publisher.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/memory/allocation_guard.hpp"

namespace vergence::app {
namespace {

/// Keeps what it is sent; holds the publisher's thread while it is shut.
class Kept final : public LineSocket {
 public:
  explicit Kept(std::vector<std::string>* lines, std::atomic<bool>* open)
      : lines_(lines), open_(open) {}
  void send(std::string_view line) noexcept override {
    open_->wait(false);
    lines_->emplace_back(line);
  }
  [[nodiscard]] LineSocketCounters counters() const noexcept override { return {}; }

 private:
  std::vector<std::string>* lines_;
  std::atomic<bool>* open_;
};

PoseSample sample(std::uint64_t frame) {
  PoseSample s;
  s.frame = frame;
  s.stamp = Stamp(static_cast<std::int64_t>(frame) * 50'000'000);
  s.status = PoseStatus::ok;
  return s;
}

TEST(LinePublisher, aFullRingLosesTheNewestCountsThemAndNeverWaits) {
  std::vector<std::string> lines;
  std::atomic<bool> open{false};
  LinePublisher publisher(std::make_unique<Kept>(&lines, &open));
  publisher.on_start({});
  constexpr std::uint64_t kPoses = 1000;
  for (std::uint64_t i = 0; i < kPoses; ++i) publisher.on_pose(sample(i));  // the socket is shut
  open = true;
  open.notify_all();
  std::map<std::string, std::uint64_t> counters;
  for (const auto& [name, value] : publisher.counters()) counters[name] = value;
  EXPECT_EQ(counters["lines"] + counters["lines_dropped"], kPoses);
  EXPECT_EQ(counters["lines"], lines.size());
  EXPECT_GE(lines.size(), 64U) << "all that the ring held";
  EXPECT_LE(lines.size(), 65U) << "and the one in hand";
  EXPECT_EQ(counters.count("line_age_p99_us"), 0U) << "no clock to measure an age by";
  for (std::size_t i = 0; i < 64; ++i)
    EXPECT_EQ(nlohmann::json::parse(lines[i])["frame"], i) << "in order, the oldest";
  // The one in hand makes room when the publisher's thread comes to it: for whichever is next.
  if (lines.size() > 64) {
    EXPECT_GE(nlohmann::json::parse(lines[64])["frame"], 64U);
  }
}

TEST(LinePublisher, takesNoMemoryOnTheEstimatorsThreadAndBringsPosesToTheEarth) {
  std::vector<std::string> lines;
  std::atomic<bool> open{true};
  LinePublisher publisher(std::make_unique<Kept>(&lines, &open));
  publisher.on_start({});
  Placement placement;
  placement.T_enu_world.t = {1, 2, 3};
  AllocationGuard::seal_thread();
  const auto before = AllocationGuard::allocations_after_seal();
  publisher.on_placement(placement, {-27.4975, 153.0137, 60});
  publisher.on_pose(sample(0));
  const auto taken = AllocationGuard::allocations_after_seal() - before;
  AllocationGuard::unseal_thread();
  EXPECT_EQ(taken, 0U);
  (void)publisher.counters();
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(nlohmann::json::parse(lines[0])["earth"]["enu_m"], (std::vector<double>{1, 2, 3}));
}

}  // namespace
}  // namespace vergence::app
