#include "firmware_iface/xbus/configuration.hpp"

#include <gtest/gtest.h>

#include "firmware_iface/xbus/line_budget.hpp"
#include "firmware_iface/xbus/mtdata2.hpp"
#include "tests/unit/firmware_iface/xbus/hex.hpp"

namespace vergence::xbus {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes frame(MessageId id, const Bytes& payload) {
  Bytes out(kMaxFrame);
  out.resize(write_frame({kBusMaster, static_cast<std::uint8_t>(id), payload}, out).size);
  return out;
}

Bytes legacy_sync(LegacySync parameter, std::uint32_t value) {
  Bytes out(5);
  out.resize(write_legacy_sync(parameter, value, out));
  return out;
}

TEST(Commands, bytesAreThoseDocumented) {
  EXPECT_EQ(frame(MessageId::go_to_config, {}), from_hex("FA FF 30 00 D1"));
  EXPECT_EQ(frame(MessageId::device_id_request, {}), from_hex("FA FF 00 00 01"));
  EXPECT_EQ(frame(MessageId::wake_up, {}), from_hex("FA FF 3E 00 C3"));
  EXPECT_EQ(frame(MessageId::wake_up_answer, {}), from_hex("FA FF 3F 00 C2"));
  EXPECT_EQ(frame(MessageId::error, {kErrorParameter}), from_hex("FA FF 42 01 21 9D"));
  EXPECT_EQ(frame(MessageId::period, from_hex("03C0")), from_hex("FA FF 04 02 03 C0 38"));
  EXPECT_EQ(frame(MessageId::output_skip, from_hex("0000")), from_hex("FA FF D4 02 00 00 2B"));
  EXPECT_EQ(frame(MessageId::output_mode, from_hex("0836")), from_hex("FA FF D0 02 08 36 F1"));
  EXPECT_EQ(frame(MessageId::output_settings, from_hex("00000203")),
            from_hex("FA FF D2 04 00 00 02 03 26"));
  EXPECT_EQ(frame(MessageId::lever_arm, from_hex("3F000000 BE800000 3F800000")),
            from_hex("FA FF 68 0C 3F 00 00 00 BE 80 00 00 3F 80 00 00 51"));
}

TEST(Commands, legacySyncOutHoldsOneParameterPerMessage) {
  // One millisecond of the 29.4912 MHz clock.
  constexpr std::uint32_t kMillisecond = 29491;
  EXPECT_EQ(kMillisecond, static_cast<std::uint32_t>(kLegacySyncClock * 1e-3));
  const auto message = [](LegacySync p, std::uint32_t v) {
    return frame(MessageId::legacy_sync_out, legacy_sync(p, v));
  };
  EXPECT_EQ(message(LegacySync::mode, kLegacySyncOutPulse | kLegacySyncOutPositive),
            from_hex("FA FF D8 03 00 00 12 14"));
  EXPECT_EQ(message(LegacySync::skip, 3), from_hex("FA FF D8 03 01 00 03 22"));
  EXPECT_EQ(message(LegacySync::offset, 0), from_hex("FA FF D8 05 02 00 00 00 00 22"));
  EXPECT_EQ(message(LegacySync::width, kMillisecond), from_hex("FA FF D8 05 03 00 00 73 33 7B"));
  LegacySync parameter{};
  std::uint32_t value = 0;
  ASSERT_TRUE(read_legacy_sync(from_hex("03 00 00 73 33"), &parameter, &value));
  EXPECT_EQ(parameter, LegacySync::width);
  EXPECT_EQ(value, kMillisecond);
  EXPECT_FALSE(read_legacy_sync(from_hex("03 73 33"), &parameter, &value)) << "a width has 32 bits";
  EXPECT_FALSE(read_legacy_sync(from_hex("04 00 00"), &parameter, &value));
  EXPECT_FALSE(read_legacy_sync({}, &parameter, &value));
}

TEST(Commands, syncSettingsAreTwelveByteEntries) {
  SyncSettings settings;
  settings.entries[settings.count++] = {
      kSyncIntervalTransition, kSyncLineOut, kSyncPositive, 0, 0, 12, 10, 0};
  Bytes payload(kSyncEntrySize);
  ASSERT_EQ(write_sync_settings(settings, payload), kSyncEntrySize);
  EXPECT_EQ(frame(MessageId::sync_settings, payload),
            from_hex("FA FF 2C 0C 04 04 01 00 00 00 00 0C 00 0A 00 00 AA"));
  SyncSettings back;
  ASSERT_TRUE(read_sync_settings(payload, &back));
  EXPECT_EQ(back, settings);
  EXPECT_FALSE(read_sync_settings(Bytes(13), &back));
  EXPECT_FALSE(read_sync_settings(Bytes((kMaxSyncEntries + 1) * kSyncEntrySize), &back));
  EXPECT_EQ(back, settings) << "untouched";
}

TEST(Commands, outputConfigurationIsPairsOfIdAndRate) {
  OutputConfiguration outputs;
  using O = OutputEntry;
  for (const O e : {O{0x1010, kEveryMessage}, O{0x1020, kEveryMessage}, O{0x1060, kEveryMessage},
                    O{0x2013, 100}, O{0x4020, 100}, O{0x8020, 100}, O{0x5042, 100}, O{0x5022, 100},
                    O{0xD012, 100}, O{0xE020, kEveryMessage}, O{0x7010, 4}})
    ASSERT_TRUE(outputs.add(e));
  Bytes payload(4 * outputs.count);
  ASSERT_EQ(write_output_configuration(outputs, payload), payload.size());
  EXPECT_EQ(frame(MessageId::output_configuration, payload),
            from_hex("FA FF C0 2C 10 10 FF FF 10 20 FF FF 10 60 FF FF 20 13 00 64 40 20 00 64 80 "
                     "20 00 64 50 42 00 64 50 22 00 64 D0 12 00 64 E0 20 FF FF 70 10 00 04 68"));
  OutputConfiguration back;
  ASSERT_TRUE(read_output_configuration(payload, &back));
  EXPECT_EQ(back, outputs);
  EXPECT_FALSE(read_output_configuration(Bytes(7), &back));
  EXPECT_FALSE(read_output_configuration(Bytes(4 * (kMaxOutputs + 1)), &back));
  EXPECT_EQ(wire_id(PacketId::quaternion, NumberFormat::float64), 0x2013);
  EXPECT_EQ(wire_id(PacketId::velocity, NumberFormat::fp16_32, LocalFrame::ned), 0xD016);
}

TEST(Configuration, configurationMessageRoundTrips) {
  // Values of an MTi-300, which fills the common fields.
  Bytes payload(kConfigurationSize);
  DeviceConfiguration written{.master_id = 0x037003F8,
                              .period = 1152,
                              .devices = 1,
                              .device_id = 0x037003F8,
                              .data_length = 75,
                              .output_mode = 0x0836,
                              .output_settings = 0x80000203,
                              .firmware = {2, 4, 6}};
  write_configuration(written, payload);
  EXPECT_EQ(Bytes(payload.begin(), payload.begin() + 8), from_hex("037003F8 0480 0000"));
  EXPECT_EQ(Bytes(payload.begin() + 96, payload.begin() + 102), from_hex("0001 037003F8"));
  DeviceConfiguration read;
  ASSERT_TRUE(read_configuration(payload, &read));
  EXPECT_EQ(read.period, 1152);
  EXPECT_EQ(read.device_id, 0x037003F8U);
  EXPECT_EQ(read.output_mode, 0x0836);
  EXPECT_EQ(read.output_settings, 0x80000203U);
  EXPECT_EQ(read.firmware[2], 6);
  EXPECT_FALSE(read_configuration(Bytes(kConfigurationSize - 1), &read)) << "short";
  EXPECT_FALSE(read_configuration(Bytes(kConfigurationSize), &read)) << "of no device";
}

TEST(Configuration, baudCodesRoundTripPerGeneration) {
  for (const std::uint32_t baud : kBaudScan) {
    for (const Generation g : {Generation::legacy, Generation::mark4}) {
      const auto code = baud_code(baud, g);
      ASSERT_TRUE(code) << baud;
      EXPECT_EQ(baud_of_code(*code), baud);
    }
  }
  EXPECT_EQ(baud_code(921600, Generation::legacy), 0x80);
  EXPECT_EQ(baud_code(921600, Generation::mark4), 0x0A);
  EXPECT_FALSE(baud_code(2000000, Generation::legacy));
  EXPECT_FALSE(baud_code(250000, Generation::mark4));
  EXPECT_FALSE(baud_of_code(0x55));
}

TEST(Configuration, periodsAreAllowedWholeTicks) {
  EXPECT_EQ(period_of_rate(120), 960);
  EXPECT_EQ(period_of_rate(100), 1152);
  EXPECT_FALSE(period_of_rate(110)) << "not a whole number of ticks";
  EXPECT_FALSE(period_of_rate(50)) << "the receiver's pulse cannot correct it";
  EXPECT_FALSE(period_of_rate(0));
  EXPECT_FALSE(period_of_rate(1000));
  EXPECT_FALSE(period_of_rate(std::nan("")));
}

TEST(Configuration, syncOutSkipGivesTheNearestRate) {
  double actual = 0;
  EXPECT_EQ(sync_out_skip(120, 30, &actual), 3);
  EXPECT_EQ(actual, 30);
  EXPECT_EQ(sync_out_skip(kSyncOutBase, 25, &actual), 15);
  EXPECT_EQ(actual, 25);
  EXPECT_EQ(sync_out_skip(kSyncOutBase, 30, &actual), 12);
  EXPECT_NEAR(actual, 30.77, 0.01);
}

TEST(LineBudget, legacyLayoutsHaveTheTabulatedLoad) {
  struct Row {
    std::uint16_t mode;
    std::uint32_t settings;
    std::size_t bytes;
    // Load in percent at 115200 baud and 120 Hz.
    double percent;
    // Time on the wire in ms.
    double ms;
  };
  for (const Row& r : {Row{0x0834, 0x001, 48, 50, 4.17}, Row{0x0834, 0x201, 68, 71, 5.90},
                       Row{0x0834, 0x203, 80, 83, 6.94}, Row{0x1834, 0x203, 124, 129, 10.76},
                       Row{0x0836, 0x203, 134, 140, 11.63}, Row{0x1836, 0x203, 178, 185, 15.45},
                       Row{0x1837, 0x303, 224, 233, 19.44}}) {
    const MtdataLayout layout{r.mode, r.settings};
    ASSERT_TRUE(layout.payload_size());
    EXPECT_EQ(frame_size(*layout.payload_size()), r.bytes);
    const LineBudget b = line_budget(layout, 120, 115200);
    EXPECT_NEAR(100 * b.load, r.percent, 0.5);
    EXPECT_EQ(b.fits(), r.percent < 90);
    EXPECT_NEAR(static_cast<double>(wire_time_ns(r.bytes, 115200)) * 1e-6, r.ms, 0.01);
    EXPECT_NEAR(b.greatest_rate, 0.9 * 11520 / static_cast<double>(r.bytes), 1e-6);
  }
  EXPECT_EQ(line_budget(MtdataLayout{0x1836, 0x203}, 120, 115200).baud_needed, 460800U);
  EXPECT_EQ(line_budget(MtdataLayout{0x0834, 0x201}, 120, 115200).baud_needed, 115200U);
}

TEST(LineBudget, packetsAreCountedAtTheirOwnRates) {
  OutputConfiguration outputs;
  using O = OutputEntry;
  for (const O e : {O{0x1020, kEveryMessage}, O{0x1060, kEveryMessage}, O{0x2010, 100},
                    O{0x5042, 100}, O{0x7010, 4}})
    (void)outputs.add(e);
  // A sample: 5 + (3+2) + (3+4) + (3+16) + (3+12) = 51; a fix: 5 + 5 + 7 + 97 = 114.
  const LineBudget b = line_budget(outputs, 115200);
  EXPECT_DOUBLE_EQ(b.bytes_per_second, 51 * 100 + 114 * 4);
  EXPECT_TRUE(b.fits());
  OutputConfiguration fast = outputs;
  for (std::size_t i = 0; i < fast.count; ++i)
    if (fast.entries[i].rate_hz == 100) fast.entries[i].rate_hz = 400;
  EXPECT_FALSE(line_budget(fast, 115200).fits());
  EXPECT_EQ(line_budget(fast, 115200).baud_needed, 460800U) << "230400 would carry it at 91 %";
  EXPECT_NEAR(line_budget(fast, 115200).greatest_rate, (0.9 * 11520 - 114 * 4) / 51, 1e-9);
}

}  // namespace
}  // namespace vergence::xbus
