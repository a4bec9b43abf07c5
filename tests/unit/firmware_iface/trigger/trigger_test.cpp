#include "firmware_iface/trigger/trigger.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <numeric>
#include <vector>

namespace vergence {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes framed(std::uint8_t type, std::uint8_t sequence, const Bytes& payload) {
  Bytes out(trigger_max_frame);
  out.resize(trigger_write_frame(type, sequence, payload.data(), payload.size(), out.data()));
  return out;
}

struct Decoded {
  std::vector<TriggerFrame> frames;
  TriggerDecoder decoder{};
};

Decoded decode_all(const Bytes& bytes) {
  Decoded all;
  TriggerFrame frame{};
  for (const std::uint8_t b : bytes)
    if (trigger_decode(&all.decoder, b, &frame) == trigger_frame_ready) all.frames.push_back(frame);
  return all;
}

Bytes payload_of(const TriggerFrame& frame) { return {frame.payload, frame.payload + frame.size}; }

Bytes noise(std::size_t n, std::uint32_t seed) {
  Bytes bytes(n);
  for (std::uint8_t& b : bytes) {
    seed = seed * 1664525U + 1013904223U;
    b = static_cast<std::uint8_t>(seed >> 24U);
  }
  return bytes;
}

TEST(TriggerCrc, isThatOfIeee8023) {
  const char* check = "123456789";
  EXPECT_EQ(trigger_crc32(reinterpret_cast<const std::uint8_t*>(check), 9), 0xCBF43926U);
  EXPECT_EQ(trigger_crc32(nullptr, 0), 0U);
}

TEST(TriggerFrames, everyPayloadLengthRoundTripsWithoutZeros) {
  for (std::size_t n = 0; n <= trigger_max_payload; ++n)
    for (const Bytes& payload : {Bytes(n, 0), Bytes(n, 0xFF), noise(n, 7)}) {
      const Bytes frame = framed(0x90, static_cast<std::uint8_t>(n), payload);
      ASSERT_EQ(frame.size(), n + trigger_overhead + 2);
      EXPECT_EQ(std::count(frame.begin(), frame.end(), 0), 1);
      EXPECT_EQ(frame.back(), 0);
      const Decoded all = decode_all(frame);
      ASSERT_EQ(all.frames.size(), 1U);
      EXPECT_EQ(all.frames[0].type, 0x90);
      EXPECT_EQ(all.frames[0].sequence, n);
      EXPECT_EQ(payload_of(all.frames[0]), payload);
    }
}

TEST(TriggerFrames, tooLongPayloadIsRefused) {
  const Bytes payload(trigger_max_payload + 1);
  Bytes out(200, 0x55);
  EXPECT_EQ(trigger_write_frame(1, 0, payload.data(), payload.size(), out.data()), 0U);
  EXPECT_EQ(out, Bytes(200, 0x55));
}

TEST(TriggerFrames, anySingleDamagedByteIsRefused) {
  const Bytes good = framed(trigger_pong, 9, noise(24, 3));
  for (std::size_t i = 0; i < good.size(); ++i)
    for (const unsigned flip : {0x01U, 0x80U, 0xFFU}) {
      Bytes bad = good;
      bad[i] = static_cast<std::uint8_t>(bad[i] ^ flip);
      // The extra zero ends the frame if the damage hit its end.
      bad.push_back(0);
      EXPECT_TRUE(decode_all(bad).frames.empty()) << i << " " << flip;
    }
}

TEST(TriggerFrames, frameAfterGarbageIsFoundAndLossesCounted) {
  // The noise is longer than a frame and contains zeros.
  Bytes bytes = noise(300, 5);
  bytes.push_back(0);
  const Bytes cut = framed(trigger_event, 1, noise(50, 6));
  bytes.insert(bytes.end(), cut.begin() + 20, cut.end());
  // The next bytes have no end marker.
  bytes.insert(bytes.end(), 200, 0x11);
  bytes.push_back(0);
  // The COBS block is one byte too short for a frame.
  bytes.insert(bytes.end(), {2, 1, 0});
  const Bytes good = framed(trigger_event, 2, noise(50, 6));
  bytes.insert(bytes.end(), good.begin(), good.end());
  const Decoded all = decode_all(bytes);
  ASSERT_EQ(all.frames.size(), 1U);
  EXPECT_EQ(all.frames[0].sequence, 2);
  EXPECT_EQ(all.decoder.frames, 1U);
  EXPECT_GE(all.decoder.bad_coding, 1U);
  EXPECT_GE(all.decoder.bad_length, 2U);
}

template <std::size_t kSize, class Message>
Bytes laid(void (*put)(const Message*, std::uint8_t*), const Message& message) {
  Bytes bytes(kSize);
  put(&message, bytes.data());
  return bytes;
}

TEST(TriggerFrames, idleZerosAreIgnored) {
  const Decoded all = decode_all(Bytes(100, 0));
  EXPECT_TRUE(all.frames.empty());
  EXPECT_EQ(all.decoder.bad_coding + all.decoder.bad_length + all.decoder.bad_crc, 0U);
}

/// The bytes of firmware_iface/trigger/README.md, worked out by hand from its tables.
TEST(TriggerPayloads, layoutsAreThoseOfTheReadme) {
  TriggerInfo info{1, 2, 3, 4, 0x11223344, 84'000'000, 4, 2, 1, 0, {}};
  std::iota(std::begin(info.serial), std::end(info.serial), std::uint8_t{1});
  EXPECT_EQ((laid<trigger_info_payload_size, TriggerInfo>(trigger_put_info, info)),
            (Bytes{1, 2, 3, 4, 0x44, 0x33, 0x22, 0x11, 0x00, 0xBD, 0x01, 0x05, 4,  2,
                   1, 0, 1, 2, 3,    4,    5,    6,    7,    8,    9,    10,   11, 12}));
  EXPECT_EQ((laid<trigger_config_payload_size, TriggerConfig>(
                trigger_put_config, {30'000, 200, 1500, 0x03, 0x02, 0x01, 0x80, trigger_edge_rising,
                                     trigger_edge_falling})),
            (Bytes{0x30, 0x75, 0, 0, 0xC8, 0, 0, 0, 0xDC, 0x05, 0, 0, 3, 2, 1, 0x80, 1, 2}));
  EXPECT_EQ((laid<trigger_pause_payload_size, TriggerPause>(trigger_put_pause, {0x01020304})),
            (Bytes{4, 3, 2, 1}));
  EXPECT_EQ((laid<trigger_ping_payload_size, TriggerPing>(trigger_put_ping, {0xA1A2A3A4})),
            (Bytes{0xA4, 0xA3, 0xA2, 0xA1}));
  EXPECT_EQ(
      (laid<trigger_pong_payload_size, TriggerPong>(
          trigger_put_pong, {0xA1A2A3A4, 0x11223344, 0x0102030405060708, 0x1112131415161718})),
      (Bytes{0xA4, 0xA3, 0xA2, 0xA1, 0x44, 0x33, 0x22, 0x11, 8,    7,    6,    5,
             4,    3,    2,    1,    0x18, 0x17, 0x16, 0x15, 0x14, 0x13, 0x12, 0x11}));
  EXPECT_EQ(
      (laid<trigger_edge_payload_size, TriggerEdge>(trigger_put_edge, {0x11223344, 7, 1'000'000})),
      (Bytes{0x44, 0x33, 0x22, 0x11, 7, 0, 0, 0, 0x40, 0x42, 0x0F, 0, 0, 0, 0, 0}));
  EXPECT_EQ((laid<trigger_status_payload_size, TriggerStatus>(
                trigger_put_status,
                {0x11223344, 1'000'000, 7, 0xCAFEBABE, 1, 2, 3, 0xFFFFFFFF, trigger_paused, 1})),
            (Bytes{0x44, 0x33, 0x22, 0x11, 0x40, 0x42, 0x0F, 0,    0,    0,    0, 0, 7,
                   0,    0,    0,    0xBE, 0xBA, 0xFE, 0xCA, 1,    0,    0,    0, 2, 0,
                   0,    0,    3,    0,    0,    0,    0xFF, 0xFF, 0xFF, 0xFF, 2, 1}));
  EXPECT_EQ((laid<trigger_error_payload_size, TriggerError>(trigger_put_error,
                                                            {trigger_config, trigger_error_rate})),
            (Bytes{2, 6}));
}

/// Any bytes → struct → the same bytes: every byte of the layout is read and written, and none
/// twice.
template <class Message, std::size_t kSize, class Get, class Put>
void expect_bijective(Get get, Put put) {
  const Bytes bytes = noise(kSize, 42);
  Message m{};
  ASSERT_TRUE(get(bytes.data(), kSize, &m));
  Bytes again(kSize + 1, 0xA5);
  put(&m, again.data());
  EXPECT_EQ(again.back(), 0xA5) << "writes past its size";
  again.pop_back();
  EXPECT_EQ(again, bytes);
  EXPECT_FALSE(get(bytes.data(), kSize - 1, &m));
  EXPECT_FALSE(get(bytes.data(), kSize + 1, &m));
}

TEST(TriggerPayloads, everyByteIsReadAndWrittenOnce) {
  expect_bijective<TriggerInfo, trigger_info_payload_size>(trigger_get_info, trigger_put_info);
  expect_bijective<TriggerConfig, trigger_config_payload_size>(trigger_get_config,
                                                               trigger_put_config);
  expect_bijective<TriggerPause, trigger_pause_payload_size>(trigger_get_pause, trigger_put_pause);
  expect_bijective<TriggerPing, trigger_ping_payload_size>(trigger_get_ping, trigger_put_ping);
  expect_bijective<TriggerPong, trigger_pong_payload_size>(trigger_get_pong, trigger_put_pong);
  expect_bijective<TriggerEvent, trigger_event_payload_size>(trigger_get_event, trigger_put_event);
  expect_bijective<TriggerEdge, trigger_edge_payload_size>(trigger_get_edge, trigger_put_edge);
  expect_bijective<TriggerStatus, trigger_status_payload_size>(trigger_get_status,
                                                               trigger_put_status);
  expect_bijective<TriggerError, trigger_error_payload_size>(trigger_get_error, trigger_put_error);
}

TEST(TriggerVariedIntervals, noRunOf24FitsItselfShifted) {
  constexpr std::uint32_t kPulses = 100'000, kRun = 24;
  std::uint32_t longer = 0;
  for (std::uint32_t i = 0; i < kPulses; ++i) longer += trigger_interval_is_longer(i) ? 1U : 0U;
  EXPECT_NEAR(longer, kPulses / 2, 5 * 158) << "five sigmas of a fair coin: the mean rate is kept";
  for (std::uint32_t start = 0; start < kPulses; ++start)
    for (std::uint32_t shift = 1; shift <= 8; ++shift) {
      std::uint32_t same = 0;
      while (same < kRun && trigger_interval_is_longer(start + same) ==
                                trigger_interval_is_longer(start + same + shift))
        ++same;
      ASSERT_LT(same, kRun) << "from pulse " << start << " shifted by " << shift;
    }
}

}  // namespace
}  // namespace vergence
