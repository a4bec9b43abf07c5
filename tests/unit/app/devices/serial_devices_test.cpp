#include "app/devices/serial_devices.hpp"

#include <gtest/gtest.h>

#include "tests/support/refusal.hpp"
#include "tests/support/xsens_terminal.hpp"

namespace vergence::app {
namespace {

std::string refusal(const InsSettings& request) {
  std::vector<std::string> remarks;
  return test::refusal_of([&] { (void)open_ins(request, &remarks); });
}

InsSettings xsens_on(const std::string& port, double rate) {
  InsSettings r{.driver = "xsens", .port = port, .rate = rate};
  return r;
}

TEST(InsDrivers, terminalIsReadInRealTime) {
  for (const xbus::Generation generation : {xbus::Generation::legacy, xbus::Generation::mark4}) {
    test::DeviceOnTerminal terminal(test::resting_xsens({.generation = generation}));
    std::vector<std::string> remarks;
    const auto device = open_ins(xsens_on(terminal.port(), 120), &remarks);
    ASSERT_NE(device, nullptr);
    EXPECT_EQ(remarks.size(), generation == xbus::Generation::mark4 ? 1U : 0U)
        << "120 Hz are no rate of the newer one";
    EXPECT_EQ(refusal(xsens_on(terminal.port(), 120)).find("in use") == std::string::npos, false)
        << "the port is ours";
    ASSERT_EQ(device->start(nullptr), DeviceStatus::ok);
    std::vector<InsReading> all;
    for (InsReading r;
         all.size() < 60 && device->wait(Duration::seconds(5), &r) == DeviceStatus::ok;)
      all.push_back(r);
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
