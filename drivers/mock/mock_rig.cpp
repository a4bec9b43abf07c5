#include "drivers/mock/mock_rig.hpp"

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "drivers/mock/detail/devices.hpp"
#include "drivers/mock/detail/scheduler.hpp"

namespace vergence::mock {

class MockRig::Impl {
 public:
  Impl(std::shared_ptr<const RigTruth> truth, const MockRigOptions& o)
      : context{std::move(truth), o, {}, {}},
        ins(&context),
        scheduler(&context, &cameras, &ins),
        trigger(&context, &scheduler) {
    if (o.blur_samples < 1) throw std::invalid_argument("mock: blur_samples must be 1 or more");
    const int count = context.truth->mounted().cameras;
    for (int k = 0; k < count; ++k) cameras.push_back(std::make_unique<MockCamera>(&context, k));
    for (const Fault& f : context.truth->faults())
      if (f.camera >= count)
        throw std::invalid_argument(std::string(to_string(f.kind)) + ": there is no camera " +
                                    std::to_string(f.camera) + " on this rig");
    scheduler.attach(&trigger);
  }
  ~Impl() { scheduler.halt(); }

  RigContext context;
  std::vector<std::unique_ptr<MockCamera>> cameras;
  MockIns ins;
  Scheduler scheduler;
  MockTrigger trigger;
};

MockRig::MockRig(std::shared_ptr<const RigTruth> truth, const MockRigOptions& options)
    : impl_(std::make_unique<Impl>(std::move(truth), options)) {}
MockRig::~MockRig() = default;

int MockRig::cameras() const noexcept { return static_cast<int>(impl_->cameras.size()); }
CameraDevice& MockRig::camera(int k) noexcept {
  return *impl_->cameras[static_cast<std::size_t>(k)];
}
InsDevice& MockRig::ins() noexcept { return impl_->ins; }
TriggerDevice& MockRig::trigger() noexcept { return impl_->trigger; }
const RigTruth& MockRig::truth() const noexcept { return *impl_->context.truth; }
std::size_t MockRig::image_bytes() const noexcept {
  std::size_t sum = 0;
  for (const auto& camera : impl_->cameras) sum += camera->bytes();
  return sum;
}
HostStamp MockRig::start() const noexcept { return impl_->scheduler.start(); }
std::vector<Duration> MockRig::pulse_times() const {
  const PulsePlan plan = impl_->scheduler.make_plan(impl_->trigger.configuration());
  std::vector<Duration> times;
  times.reserve(plan.size());
  for (std::size_t i = 0; i < plan.size(); ++i) times.push_back(plan.at(i).time);
  return times;
}
std::uint64_t MockRig::pulses(double rate_hz) const noexcept {
  return impl_->scheduler.pulses(rate_hz);
}

}  // namespace vergence::mock
