#include <algorithm>
#include <cmath>

#include "firmware_iface/nmea/nmea.hpp"
#include "firmware_iface/ubx/ubx.hpp"
#include "tests/fuzz/require.hpp"

namespace vergence::test {
namespace {

bool within(const std::optional<double>& v, double least, double most) {
  return !v || (*v >= least && *v <= most);
}

void check(const nmea::Sentence& s) {
  require(within(s.latitude_deg, -90, 90) && within(s.longitude_deg, -180, 180),
          "a place is on the earth");
  require(within(s.course_deg, 0, 360) && within(s.heading_deg, 0, 360), "a heading is a turn");
  require(within(s.speed, 0, 1200) && within(s.altitude_m, -1e3, 1e5), "a number is in its range");
  require(!s.time_of_day_ns || (*s.time_of_day_ns >= 0 && *s.time_of_day_ns < 86'401'000'000'000),
          "a time is of a day");
  require(!s.days || (*s.days >= 3652 && *s.days < 40179), "a date is of 1980 to 2079");
}

void probe_nmea(std::span<const std::uint8_t> bytes) {
  nmea::SentenceStream stream;
  std::uint64_t heard = 0;
  for (const std::uint8_t b : bytes) {
    nmea::Sentence s;
    if (!stream.accept(b, &s)) continue;
    ++heard;
    check(s);
    require(stream.size() <= nmea::kMaxCharacters + 3, "a sentence is no longer than its buffer");
  }
  require(stream.counters().sentences == heard, "a sentence is counted once");
}

void probe_ubx(std::span<const std::uint8_t> bytes) {
  ubx::FrameStream stream;
  std::span<const std::uint8_t> rest = bytes;
  std::size_t piece = 1 + (bytes.empty() ? 0 : bytes[0] % 67U);
  while (!rest.empty()) {
    const std::size_t n = std::min(piece, rest.size());
    require(stream.accept(rest.first(n)) == n, "there is room for a read");
    rest = rest.subspan(n);
    for (ubx::Frame frame; stream.next(&frame);) {
      std::array<std::uint8_t, ubx::kMaxPayload + ubx::kOverhead> again{};
      const std::size_t size =
          ubx::write_frame(frame.message_class, frame.id, frame.payload, again);
      require(size == frame.payload.size() + ubx::kOverhead, "a frame is written back");
      ubx::Pvt pvt;
      if (!ubx::decode_pvt(frame.payload, &pvt)) continue;
      require(std::abs(pvt.latitude_deg) <= 90 && std::abs(pvt.longitude_deg) <= 180,
              "a place is on the earth");
      require(!pvt.utc_ns || *pvt.utc_ns > 0, "a time is after 1970");
    }
    piece = piece % 1000U + 41;
  }
  const ubx::StreamCounters& c = stream.counters();
  require(c.frame_bytes + c.garbage_bytes + stream.waiting() == bytes.size(),
          "every byte is accounted for");
  ubx::Pvt pvt;
  (void)ubx::decode_pvt(bytes, &pvt);
}

}  // namespace
}  // namespace vergence::test

/// Any bytes as NMEA and as UBX. Entry point of libFuzzer.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  vergence::test::probe_nmea({data, size});
  vergence::test::probe_ubx({data, size});
  return 0;
}
