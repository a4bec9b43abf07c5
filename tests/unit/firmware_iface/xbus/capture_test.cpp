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

std::vector<double> pvt_fields(const std::optional<GnssPvt>& fix) {
  if (!fix) return {};
  const GnssPvt& p = *fix;
  const auto d = [](auto number) { return static_cast<double>(number); };
  std::vector<double> all = {d(p.itow_ms),
                             d(p.year),
                             d(p.month),
                             d(p.day),
                             d(p.hour),
                             d(p.minute),
                             d(p.second),
                             d(p.valid),
                             d(p.time_accuracy_ns),
                             d(p.nanosecond),
                             d(p.fix),
                             d(p.flags),
                             d(p.satellites),
                             0.0 /* reserved */,
                             d(p.longitude_1e7_deg),
                             d(p.latitude_1e7_deg),
                             d(p.height_ellipsoid_mm),
                             d(p.height_msl_mm),
                             d(p.horizontal_accuracy_mm),
                             d(p.vertical_accuracy_mm),
                             d(p.velocity_north_mm_s),
                             d(p.velocity_east_mm_s),
                             d(p.velocity_down_mm_s),
                             d(p.ground_speed_mm_s),
                             d(p.heading_of_motion_1e5_deg),
                             d(p.speed_accuracy_mm_s),
                             d(p.heading_accuracy_1e5_deg),
                             d(p.heading_of_vehicle_1e5_deg)};
  for (const std::uint16_t dop : p.dop_1e2) all.push_back(dop);
  return all;
}

/// The decoded numbers of an item under the name the text uses. Times and status are compared as
/// text elsewhere.
std::vector<double> values_of(const Mtdata2& m, const std::string& item) {
  static const std::map<std::string, std::vector<double> (*)(const Mtdata2&)> kItems = {
      {"PacketCounter", [](const Mtdata2& x) { return single(x.packet_counter); }},
      {"SampleTimeFine", [](const Mtdata2& x) { return single(x.sample_time_fine); }},
      {"SampleTimeCoarse", [](const Mtdata2& x) { return single(x.sample_time_coarse_s); }},
      {"Acceleration", [](const Mtdata2& x) { return list(x.acceleration); }},
      {"FreeAcceleration", [](const Mtdata2& x) { return list(x.free_acceleration); }},
      {"DeltaV", [](const Mtdata2& x) { return list(x.delta_v); }},
      {"RateOfTurn", [](const Mtdata2& x) { return list(x.rate_of_turn); }},
      {"DeltaQ", [](const Mtdata2& x) { return list(x.delta_q); }},
      {"EulerAngles", [](const Mtdata2& x) { return list(x.euler_deg); }},
      {"Quaternion", [](const Mtdata2& x) { return list(x.quaternion); }},
      {"RotationMatrix", [](const Mtdata2& x) { return list(x.rotation_matrix); }},
      {"LatLon", [](const Mtdata2& x) { return list(x.latitude_longitude_deg); }},
      {"AltitudeEllipsoid", [](const Mtdata2& x) { return single(x.altitude_ellipsoid_m); }},
      {"PositionECEF", [](const Mtdata2& x) { return list(x.position_ecef_m); }},
      {"VelocityXYZ", [](const Mtdata2& x) { return list(x.velocity); }},
      {"MagneticField", [](const Mtdata2& x) { return list(x.magnetic_field); }},
      {"Temperature", [](const Mtdata2& x) { return single(x.temperature_c); }},
      {"BaroPressure", [](const Mtdata2& x) { return single(x.pressure_pa); }},
      {"GNSSPVTData", [](const Mtdata2& x) { return pvt_fields(x.gnss_pvt); }},
  };
  const auto found = kItems.find(item);
  return found == kItems.end() ? std::vector<double>{} : found->second(m);
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
      EXPECT_TRUE(m.satellites && m.satellites->count == 28);  // the text has the header only
      continue;
    } else {
      const std::vector<double> decoded = values_of(m, item);
      EXPECT_EQ(decoded.size(), texts.size()) << item;
      for (std::size_t i = 0; i < std::min(decoded.size(), texts.size()); ++i) {
        const double expected = std::stod(texts[i]);
        EXPECT_NEAR(decoded[i], expected, 1e-9 * std::abs(expected)) << item << " " << i;
      }
    }
    values += static_cast<int>(texts.size());
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
      EXPECT_EQ(m.unknown_packets + m.refused_packets, 0U) << set << " message " << i;
      EXPECT_EQ(m.packets, blocks[i].size()) << set << " message " << i;
      values += compare(blocks[i], m);
    }
    messages += payloads.size();
  }
  EXPECT_EQ(messages, 500U);
  EXPECT_EQ(values, 12295 + 19 * 35)
      << "the data's README counts the nineteen fixes of 35 fields apart";
}

}  // namespace
}  // namespace vergence::xbus
