// Bytes that real sensors sent, against values decoded by others.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <map>
#include <sstream>
#include <string>
#include <utility>

#include "firmware_iface/xbus/xbus.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::xbus {
namespace {

constexpr const char* kFolder = "data/xsens_mtdata2";

/// What a message's text block says: item → its values' texts in order.
using Block = std::vector<std::pair<std::string, std::vector<std::string>>>;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::vector<Block> blocks_of(const std::string& golden) {
  std::vector<Block> blocks(1);
  for (const std::string& line : lines_of(golden)) {
    if (line.empty()) {
      blocks.emplace_back();
    } else if (line[0] != ' ') {
      blocks.back().emplace_back(line.substr(0, line.find_first_of("(:")),
                                 std::vector<std::string>{});
    } else {
      const std::string text = line.substr(line.find_first_not_of(' '));
      const std::size_t colon = text.find(':');
      const bool clock = text.find('T') != std::string::npos && text.back() == 'Z';
      blocks.back().back().second.push_back(
          colon == std::string::npos || clock ? text : text.substr(colon + 1));
    }
  }
  if (blocks.back().empty()) blocks.pop_back();
  return blocks;
}

template <std::size_t N>
std::vector<double> list(const std::optional<std::array<double, N>>& values) {
  return values ? std::vector<double>(values->begin(), values->end()) : std::vector<double>{};
}
template <class T>
std::vector<double> single(const std::optional<T>& value) {
  return value ? std::vector<double>{static_cast<double>(*value)} : std::vector<double>{};
}

/// The decoded numbers of an item under the name the text uses; nothing: an INS sample is not made
/// of it. Times and status are compared as text elsewhere.
std::optional<std::vector<double>> values_of(const Mtdata2& m, const std::string& item) {
  static const std::map<std::string, std::vector<double> (*)(const Mtdata2&)> kItems = {
      {"PacketCounter", [](const Mtdata2& x) { return single(x.packet_counter); }},
      {"SampleTimeFine", [](const Mtdata2& x) { return single(x.sample_time_fine); }},
      {"EulerAngles", [](const Mtdata2& x) { return list(x.euler_deg); }},
      {"Quaternion", [](const Mtdata2& x) { return list(x.quaternion); }},
      {"RotationMatrix", [](const Mtdata2& x) { return list(x.rotation_matrix); }},
      {"LatLon", [](const Mtdata2& x) { return list(x.latitude_longitude_deg); }},
      {"AltitudeEllipsoid", [](const Mtdata2& x) { return single(x.altitude_ellipsoid_m); }},
      {"VelocityXYZ", [](const Mtdata2& x) { return list(x.velocity); }},
      {"GNSSPVTData",
       [](const Mtdata2& x) {
         const GnssPvt p = x.gnss_pvt.value_or(GnssPvt{});
         return std::vector<double>{static_cast<double>(p.fix),
                                    static_cast<double>(p.flags),
                                    static_cast<double>(p.satellites),
                                    static_cast<double>(p.horizontal_accuracy_mm),
                                    static_cast<double>(p.vertical_accuracy_mm),
                                    static_cast<double>(p.speed_accuracy_mm_s),
                                    static_cast<double>(p.position_dop_1e2)};
       }},
  };
  const auto found = kItems.find(item);
  if (found == kItems.end()) return std::nullopt;
  return found->second(m);
}

/// The fields of a fix that are decoded, of those that the text has.
std::vector<std::string> of_fix(const std::vector<std::string>& texts) {
  std::vector<std::string> some;
  for (const std::size_t i : {10, 11, 12, 18, 19, 25, 29}) some.push_back(texts.at(i));
  return some;
}

std::string utc_text(const Utc& utc) {
  char text[64];
  std::snprintf(text, sizeof text, "%04d-%02d-%02dT%02d:%02d:%02d.%09u", utc.year, utc.month,
                utc.day, utc.hour, utc.minute, utc.second, utc.nanosecond);
  std::string trimmed = text;
  trimmed.erase(trimmed.find_last_not_of('0') + 1);
  if (trimmed.back() == '.') trimmed.pop_back();
  return trimmed + "Z";
}

std::string binary(std::uint32_t value, unsigned bits) {
  std::string text;
  for (unsigned i = bits; i-- > 0;) text += ((value >> i) & 1U) != 0 ? '1' : '0';
  return text;
}

std::vector<std::vector<std::uint8_t>> messages_of(const std::string& stream_bytes,
                                                   std::size_t piece, StreamCounters* counters) {
  std::vector<std::vector<std::uint8_t>> messages;
  FrameStream stream;
  std::span<const std::uint8_t> rest(reinterpret_cast<const std::uint8_t*>(stream_bytes.data()),
                                     stream_bytes.size());
  while (!rest.empty()) {
    rest = rest.subspan(stream.accept(rest.first(std::min(piece, rest.size()))));
    for (Message message; stream.next(&message);) {
      EXPECT_TRUE(message.is(MessageId::mtdata2));
      messages.emplace_back(message.payload.begin(), message.payload.end());
    }
  }
  *counters = stream.counters();
  return messages;
}

/// One block of text against one decoded message; returns how many values were compared.
int compare(const Block& block, const Mtdata2& m) {
  int values = 0;
  for (const auto& [item, texts] : block) {
    if (item == "UTCTime") {
      EXPECT_TRUE(m.utc && texts.size() == 1 && utc_text(*m.utc) == texts[0])
          << texts[0] << " " << (m.utc ? utc_text(*m.utc) : "none");
    } else if (item == "StatusWord") {
      EXPECT_TRUE(m.status_word && binary(*m.status_word, 32) == texts.at(0));
    } else if (item == "StatusByte") {
      EXPECT_TRUE(m.status_byte && binary(*m.status_byte, 8) == texts.at(0)) << texts.at(0);
    } else if (item == "GNSSSatInfo") {
      EXPECT_TRUE(m.satellites);
    } else if (const auto decoded = values_of(m, item)) {
      const auto expected = item == "GNSSPVTData" ? of_fix(texts) : texts;
      EXPECT_EQ(decoded->size(), expected.size()) << item;
      for (std::size_t i = 0; i < std::min(decoded->size(), expected.size()); ++i) {
        const double number = std::stod(expected[i]);
        EXPECT_NEAR((*decoded)[i], number, 1e-9 * std::abs(number)) << item << " " << i;
        ++values;
      }
    }
  }
  return values;
}

TEST(Captures, everyValueOfFiveHundredMessagesAgrees) {
  const auto folder = test::shared_data(kFolder);
  if (!folder) GTEST_SKIP() << test::shared_data_missing(kFolder);
  std::size_t messages = 0;
  int values = 0;
  for (const char* set : {"1", "2", "3", "4", "5"}) {
    StreamCounters counters;
    const auto payloads = messages_of(test::read_file(*folder / set / "output.bin"), 61, &counters);
    EXPECT_EQ(counters.garbage_bytes, 0U);
    const std::vector<Block> blocks = blocks_of(test::read_file(*folder / set / "output.golden"));
    ASSERT_EQ(payloads.size(), blocks.size()) << set;
    for (std::size_t i = 0; i < payloads.size(); ++i) {
      Mtdata2 m;
      ASSERT_EQ(decode_mtdata2(payloads[i], &m), PacketStatus::ok) << set << " message " << i;
      values += compare(blocks[i], m);
    }
    messages += payloads.size();
  }
  EXPECT_EQ(messages, 500U);
  EXPECT_GT(values, 4000);
}

}  // namespace
}  // namespace vergence::xbus
