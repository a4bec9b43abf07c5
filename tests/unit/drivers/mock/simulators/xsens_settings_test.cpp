#include "drivers/mock/simulators/xsens_settings.hpp"

#include <gtest/gtest.h>

#include "drivers/mock/simulators/xsens_messages.hpp"

namespace vergence::mock {
namespace {

using namespace xbus;

XsensSimulatorOptions options(Generation generation) {
  XsensSimulatorOptions o;
  o.generation = generation;
  return o;
}

XsensSettings::Reply ask(XsensSettings* settings, MessageId id,
                         std::vector<std::uint8_t> payload = {}) {
  Message m;
  m.id = static_cast<std::uint8_t>(id);
  m.payload = payload;
  return settings->handle(m);
}

TEST(XsensSettings, aRequestWithoutDataAsksAndOneWithDataChanges) {
  XsensSettings settings(options(Generation::legacy));
  EXPECT_EQ(ask(&settings, MessageId::period).payload, (std::vector<std::uint8_t>{0x04, 0x80}));
  EXPECT_NEAR(settings.rate_hz(), 100, 1e-9);
  const auto reply = ask(&settings, MessageId::period, {0x09, 0x00});
  EXPECT_EQ(reply.id, static_cast<std::uint8_t>(MessageId::period) + 1);
  EXPECT_TRUE(reply.payload.empty());
  EXPECT_NEAR(settings.rate_hz(), 50, 1e-9);
  EXPECT_EQ(settings.writes().period, 1);
  EXPECT_EQ(settings.configuration().period, 0x0900);
}

TEST(XsensSettings, whatTheGenerationDoesNotKnowIsRefusedAndCounted) {
  for (const Generation g : {Generation::legacy, Generation::mark4}) {
    XsensSettings settings(options(g));
    const MessageId other =
        g == Generation::legacy ? MessageId::output_configuration : MessageId::period;
    const auto reply = ask(&settings, other);
    EXPECT_EQ(reply.id, static_cast<std::uint8_t>(MessageId::error));
    EXPECT_EQ(reply.payload, std::vector<std::uint8_t>{kErrorMessageUnknown});
    EXPECT_EQ(settings.writes().refused, 1);
  }
}

TEST(XsensSettings, aRateThatTheDeviceDoesNotHaveIsTheNearestItHas) {
  XsensSettings settings(options(Generation::mark4));
  OutputConfiguration wanted;
  ASSERT_TRUE(wanted.add({0x2030, 120}));
  std::array<std::uint8_t, 64> payload{};
  const std::size_t n = write_output_configuration(wanted, payload);
  (void)ask(&settings, MessageId::output_configuration,
            {payload.begin(), payload.begin() + static_cast<std::ptrdiff_t>(n)});
  EXPECT_EQ(settings.outputs().items()[0].rate_hz, 100);
  EXPECT_EQ(settings.period_ns(), 10'000'000);
  EXPECT_LT(settings.line_load(921600), settings.line_load(115200));
}

TEST(XsensMessages, anInertialMessageASampleAndAFixEveryFixInterval) {
  XsensSimulatorOptions o = options(Generation::mark4);
  ASSERT_TRUE(o.outputs.add({0x1060, kEveryMessage}));
  ASSERT_TRUE(o.outputs.add({0x2030, 100}));
  ASSERT_TRUE(o.outputs.add({0x7010, 4}));
  const XsensSettings settings(o);
  XsensMessages messages(o, settings);
  messages.begin(0);
  Random random(1, 2);
  std::size_t inertial = 0, fixes = 0;
  for (int n = 0; n < 100; ++n) {
    std::vector<XsensMessages::Message> sent;
    messages.add({{}, n * settings.period_ns()}, &random, &sent);
    ++inertial;
    fixes += sent.size() - 1;
  }
  EXPECT_EQ(inertial, 100U);
  EXPECT_EQ(fixes, 4U) << "in one second";
}

TEST(XsensMessages, aPowerCycleBeginsTheSampleTimeAtZero) {
  const XsensSimulatorOptions o = options(Generation::mark4);
  const XsensSettings settings(o);
  XsensMessages messages(o, settings);
  EXPECT_EQ(messages.sample_time_origin_ns(), std::int64_t{o.first_sample_time} * 100'000);
  messages.power_cycle(5'000'000'000);
  EXPECT_EQ(messages.sample_time_origin_ns(), 0);
}

}  // namespace
}  // namespace vergence::mock
