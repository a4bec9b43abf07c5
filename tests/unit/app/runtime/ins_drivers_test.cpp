#include "app/runtime/ins_drivers.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <thread>

#include "app/runtime/errors.hpp"
#include "drivers/mock/simulators/xsens_simulator.hpp"

namespace vergence::app {
namespace {

HostStamp now() {
  timespec t{};
  (void)::clock_gettime(CLOCK_MONOTONIC, &t);
  return HostStamp(t.tv_sec * 1'000'000'000 + t.tv_nsec);
}

InsSample still(std::uint64_t number, Duration /*time*/) {
  InsSample s;
  s.number = number;
  s.fix = FixStatus::fix_3d;
  s.attitude_valid = s.velocity_valid = true;
  s.position = {-27.4975, 153.0137, 60};
  return s;
}

/// A simulated INS at the far end of a pseudo-terminal, in real time.
class SensorOnTerminal {
 public:
  explicit SensorOnTerminal(mock::XsensSimulatorOptions options) : master_(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)) {
    if (master_ < 0 || ::grantpt(master_) != 0 || ::unlockpt(master_) != 0) throw std::runtime_error("no pseudo-terminal");
    port_ = ::ptsname(master_);
    options.power_on = now();
    sensor_ = std::make_unique<mock::XsensSimulator>(still, options);
    thread_ = std::thread([this] { work(); });
  }
  SensorOnTerminal(const SensorOnTerminal&) = delete;
  SensorOnTerminal& operator=(const SensorOnTerminal&) = delete;
  ~SensorOnTerminal() {
    stop_ = true;
    thread_.join();
    ::close(master_);
  }
  const std::string& port() const { return port_; }

 private:
  void work() {
    while (!stop_) {
      std::vector<std::uint8_t> out;
      for (auto next = sensor_->next(); next && *next <= now(); next = sensor_->next()) sensor_->produce(now(), &out);
      if (!out.empty()) (void)!::write(master_, out.data(), out.size());
      pollfd p{master_, POLLIN, 0};
      if (::poll(&p, 1, 1) <= 0) continue;
      std::array<std::uint8_t, 512> in{};
      const ssize_t n = ::read(master_, in.data(), in.size());
      if (n > 0)
        sensor_->receive(std::span(in).first(static_cast<std::size_t>(n)), now());
      else
        ::usleep(1000);  // nobody has the other end open: poll() does not wait
    }
  }
  int master_;
  std::string port_;
  std::unique_ptr<mock::XsensSimulator> sensor_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

std::string refusal(const InsRequest& request) {
  std::vector<std::string> remarks;
  try {
    (void)open_ins(request, &remarks);
  } catch (const InputError& e) {
    return e.what();
  }
  return "nothing was refused";
}

InsRequest xsens_on(const std::string& port, double rate) {
  InsRequest r;
  r.driver = "xsens";
  r.port = port;
  r.rate_hz = rate;
  return r;
}

TEST(InsDrivers, noneIsNoDevice) {
  std::vector<std::string> remarks;
  InsRequest none;
  none.driver = "none";
  EXPECT_EQ(open_ins(none, &remarks), nullptr);
}

TEST(InsDrivers, whatCannotBeOpenedIsToldInOneSentence) {
  InsRequest unknown;
  unknown.driver = "xsense";
  EXPECT_NE(refusal(unknown).find("did you mean"), std::string::npos) << refusal(unknown);
  EXPECT_NE(refusal(xsens_on("/dev/ttyNotThere", 100)).find("/dev/ttyNotThere cannot be opened: not found"), std::string::npos)
      << refusal(xsens_on("/dev/ttyNotThere", 100));
  InsRequest word = xsens_on("/dev/ttyNotThere", 100);
  word.sync_in = "upwards";
  EXPECT_NE(refusal(word).find("ins.sync_in"), std::string::npos);
}

TEST(InsDrivers, readsARealTerminalInRealTime) {
  for (const xbus::Generation generation : {xbus::Generation::legacy, xbus::Generation::mark4}) {
    mock::XsensSimulatorOptions sensor;
    sensor.generation = generation;
    SensorOnTerminal terminal(sensor);
    std::vector<std::string> remarks;
    const auto device = open_ins(xsens_on(terminal.port(), 120), &remarks);
    ASSERT_NE(device, nullptr);
    EXPECT_EQ(remarks.size(), generation == xbus::Generation::mark4 ? 1U : 0U) << "120 Hz are no rate of the newer one";
    EXPECT_EQ(refusal(xsens_on(terminal.port(), 120)).find("in use") == std::string::npos, false) << "the port is ours";
    ASSERT_EQ(device->start(nullptr), DeviceStatus::ok);
    std::vector<InsReading> all;
    for (InsReading r; all.size() < 60 && device->wait(Duration::seconds(5), &r) == DeviceStatus::ok;) all.push_back(r);
    ASSERT_EQ(all.size(), 60U);
    for (const InsReading& r : all) {
      EXPECT_EQ(r.sample.fix, FixStatus::fix_3d);
      // No converter is in between: a reading is here soon after it was measured.
      EXPECT_GT(r.arrival, r.host);
      EXPECT_LT(r.arrival - r.host, Duration::milliseconds(300)) << "a loaded machine";
    }
    device->stop();
  }
}

}  // namespace
}  // namespace vergence::app
