#include "firmware_iface/xbus/frame.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "tests/unit/firmware_iface/xbus/hex.hpp"

namespace vergence::xbus {
namespace {

using Bytes = std::vector<std::uint8_t>;

struct Found {
  std::uint8_t bus, id;
  Bytes payload;
  bool operator==(const Found&) const = default;
};

/// Everything a stream finds when the bytes come in pieces of `piece`.
std::vector<Found> find_all(FrameStream& stream, std::span<const std::uint8_t> bytes,
                            std::size_t piece) {
  std::vector<Found> found;
  while (!bytes.empty()) {
    const std::size_t taken = stream.accept(bytes.first(std::min(piece, bytes.size())));
    EXPECT_GT(taken, 0U) << "an emptied stream takes at least one byte";
    if (taken == 0) break;
    bytes = bytes.subspan(taken);
    Message message;
    while (stream.next(&message))
      found.push_back({message.bus, message.id, {message.payload.begin(), message.payload.end()}});
  }
  return found;
}

Bytes frame(std::uint8_t id, const Bytes& payload) {
  Bytes out(payload.size() + 7);
  const WrittenFrame written = write_frame({kBusMaster, id, payload}, out);
  EXPECT_EQ(written.status, WriteStatus::ok);
  out.resize(written.size);
  return out;
}

Bytes joined(std::initializer_list<Bytes> parts) {
  Bytes all;
  for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

/// xorshift: the same bytes on every machine.
Bytes noise(std::size_t n, std::uint32_t seed) {
  Bytes bytes(n);
  for (std::uint8_t& b : bytes) {
    seed ^= seed << 13U;
    seed ^= seed >> 17U;
    seed ^= seed << 5U;
    b = static_cast<std::uint8_t>(seed >> 11U);
  }
  return bytes;
}

TEST(WriteFrame, roundTripsAndExtendsLengthFrom255) {
  for (const std::size_t length : {0U, 1U, 253U, 254U, 255U, 256U, 1000U, 2047U, 2048U}) {
    Bytes payload(length);
    std::iota(payload.begin(), payload.end(), std::uint8_t{0xF0});
    const Bytes bytes = frame(0x36, payload);
    EXPECT_EQ(bytes.size(), length + (length < 255 ? 5 : 7));
    EXPECT_EQ(bytes[3] == kLengthExtended, length >= 255);
    const ParsedFrame parsed = parse_frame(bytes);
    ASSERT_EQ(parsed.status, FrameStatus::ok) << length;
    EXPECT_EQ(parsed.size, bytes.size());
    EXPECT_EQ(Bytes(parsed.message.payload.begin(), parsed.message.payload.end()), payload);
  }
}

TEST(WriteFrame, refusesWhatDoesNotFitUntouched) {
  const Bytes payload(2049);
  Bytes out(3000, 0x55);
  EXPECT_EQ(write_frame({kBusMaster, 0x36, payload}, out).status, WriteStatus::payload_too_long);
  EXPECT_EQ(write_frame({kBusMaster, 0x36, std::span(payload).first(10)}, std::span(out).first(14))
                .status,
            WriteStatus::no_room);
  EXPECT_EQ(out, Bytes(3000, 0x55));
}

TEST(ParseFrame, namesTheFault) {
  const Bytes good = from_hex("FA FF 01 04 00 50 01 23 88");
  for (std::size_t n = 0; n < good.size(); ++n)
    EXPECT_EQ(parse_frame(std::span(good).first(n)).status, FrameStatus::incomplete) << n;
  EXPECT_EQ(parse_frame(good).status, FrameStatus::ok);
  for (std::size_t i = 2; i < good.size(); ++i) {
    // Another length gives another frame.
    if (i == 3) continue;
    Bytes bad = good;
    bad[i] ^= 0x10U;
    EXPECT_EQ(parse_frame(bad).status, FrameStatus::checksum_wrong) << i;
  }
  EXPECT_EQ(parse_frame(from_hex("FB FF 01")).status, FrameStatus::no_preamble);
  EXPECT_EQ(parse_frame(from_hex("FA 02")).status, FrameStatus::bus_refused);
  EXPECT_EQ(parse_frame(from_hex("FA FF 36 FF 08 01")).status, FrameStatus::length_refused);
  EXPECT_EQ(parse_frame(from_hex("FA FF 36 FF 08 00")).status, FrameStatus::incomplete);
  EXPECT_EQ(parse_frame(from_hex("FA 01 30 00 CF")).message.bus, kBusFirst);
}

TEST(FrameStream, messagesDoNotDependOnChunkSizes) {
  const Bytes bytes = joined({from_hex("12 FA 00 36"), frame(0x31, {}), frame(0x36, noise(2048, 3)),
                              from_hex("FA FA FF"), frame(0x42, {0x21}), frame(0x36, noise(300, 4)),
                              from_hex("00")});
  FrameStream whole;
  const std::vector<Found> expected = find_all(whole, bytes, bytes.size());
  ASSERT_EQ(expected.size(), 4U);
  EXPECT_EQ(expected[1].payload, noise(2048, 3));
  for (const std::size_t piece : {1U, 2U, 3U, 7U, 64U, 1000U}) {
    FrameStream stream;
    EXPECT_EQ(find_all(stream, bytes, piece), expected) << piece;
    EXPECT_EQ(stream.counters().garbage_bytes, whole.counters().garbage_bytes);
  }
}

TEST(FrameStream, messagesInsideAFalseFrameAreFound) {
  // A false preamble whose claimed length covers the two real messages behind it.
  const Bytes bytes =
      joined({from_hex("FA FF 36 09"), frame(0x31, {}), frame(0x31, {}), noise(1, 1)});
  FrameStream stream;
  const std::vector<Found> found = find_all(stream, bytes, 1);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(stream.counters().checksum_wrong, 1U);
}

TEST(FrameStream, preambleInsideAPayloadIsPayload) {
  // SampleTimeFine is FAFF3600.
  const Bytes bytes = from_hex("FA FF 36 07 10 60 04 FA FF 36 00 21");
  FrameStream stream;
  const std::vector<Found> found = find_all(stream, bytes, 1);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].payload.size(), 7U);
  // Cut before its own preamble, the inner one begins nothing either.
  FrameStream cut;
  EXPECT_TRUE(find_all(cut, std::span(bytes).subspan(1), 1).empty());
}

TEST(FrameStream, abandonFindsTheMessageBehindALongClaim) {
  FrameStream stream;
  const Bytes bytes = joined({from_hex("FA FF 36 FF 08 00"), frame(0x31, {})});
  EXPECT_TRUE(find_all(stream, bytes, 4).empty()) << "2048 bytes may still come";
  EXPECT_EQ(stream.waiting(), bytes.size());
  stream.abandon();
  Message message;
  ASSERT_TRUE(stream.next(&message));
  EXPECT_EQ(message.id, 0x31);
  EXPECT_FALSE(stream.next(&message));
  EXPECT_EQ(stream.counters().abandoned, 1U);
  stream.abandon();
  EXPECT_EQ(stream.counters().abandoned, 1U) << "nothing was waited for";
}

TEST(FrameStream, resetCountsWaitingBytesAsGarbage) {
  FrameStream stream;
  EXPECT_TRUE(find_all(stream, from_hex("FA FF 36 20 01 02"), 2).empty());
  stream.reset();
  EXPECT_EQ(stream.waiting(), 0U);
  EXPECT_EQ(find_all(stream, frame(0x31, {}), 2).size(), 1U);
  EXPECT_EQ(stream.counters().garbage_bytes, 6U);
}

TEST(FrameStream, fullStreamTakesWhatFitsAndLosesNothing) {
  Bytes bytes;
  for (int i = 0; i < 40; ++i) {
    const Bytes one = frame(0x36, noise(2000, static_cast<std::uint32_t>(i) + 1));
    bytes.insert(bytes.end(), one.begin(), one.end());
  }
  FrameStream stream;
  std::span<const std::uint8_t> rest(bytes);
  const std::size_t first = stream.accept(rest);
  EXPECT_LT(first, bytes.size());
  EXPECT_EQ(stream.accept(rest.subspan(first)), 0U) << "full";
  rest = rest.subspan(first);
  std::size_t messages = 0;
  for (Message message;;) {
    while (stream.next(&message)) ++messages;
    if (rest.empty()) break;
    rest = rest.subspan(stream.accept(rest));
  }
  EXPECT_EQ(messages, 40U);
}

}  // namespace
}  // namespace vergence::xbus
