// Speed of the Xbus decoder on one core: frames found and every field of both generations' messages
// decoded, clean and among noise.
#include <chrono>
#include <cstdio>
#include <vector>

#include <algorithm>

#include "core/math/random.hpp"
#include "firmware_iface/xbus/xbus.hpp"

namespace {

using namespace vergence;
using namespace vergence::xbus;
using Bytes = std::vector<std::uint8_t>;

constexpr MtdataLayout kLayout{0x0836, 0x203};
constexpr std::size_t kStreamBytes = 4'000'000;

void add_frame(MessageId id, std::span<const std::uint8_t> payload, Bytes* out) {
  Bytes frame(kMaxFrame);
  frame.resize(write_frame({kBusMaster, static_cast<std::uint8_t>(id), payload}, frame).size);
  out->insert(out->end(), frame.begin(), frame.end());
}

Bytes mtdata2_stream(Random& r, double noise) {
  Bytes out, payload(400);
  for (std::uint16_t n = 0; out.size() < kStreamBytes; ++n) {
    PacketWriter w(payload);
    w.put_u16(0x1020, n);
    w.put_u32(0x1060, n * 100U);
    w.put_utc({n, 2026, 1, 2, 3, 4, 5, 7});
    const std::array<double, 4> q{r.normal(), r.normal(), r.normal(), r.normal()};
    for (const std::uint16_t id :
         std::array<std::uint16_t, 6>{0x2013, 0x4020, 0x8020, 0x5042, 0x5022, 0xD012})
      w.put_numbers(id, std::span(q).first(id == 0x2013   ? 4
                                           : id == 0x5042 ? 2
                                           : id == 0x5022 ? 1
                                                          : 3));
    w.put_u32(0xE020, 0x1800007U);
    if (n % 25 == 0) w.put_pvt({});
    add_frame(MessageId::mtdata2, w.payload(), &out);
    if (r.uniform() < noise)
      for (std::uint32_t i = r.below(30); i > 0; --i)
        out.push_back(r.below(4) == 0 ? kPreamble : static_cast<std::uint8_t>(r.next()));
  }
  return out;
}

Bytes mtdata_stream(Random& r) {
  Bytes out, payload(400);
  for (std::uint16_t n = 0; out.size() < kStreamBytes; ++n) {
    Mtdata d;
    d.acceleration = Three{r.normal(), r.normal(), r.normal()};
    d.quaternion = std::array<double, 4>{1, 0, 0, r.normal()};
    d.latitude_longitude_deg = std::array<double, 2>{-27.5, 153};
    d.sample_counter = n;
    add_frame(MessageId::mtdata, std::span(payload).first(encode_mtdata(d, kLayout, payload)),
              &out);
  }
  return out;
}

/// Megabytes a second over the stream in reads of 496 bytes; the best, the median and the worst of
/// several passes.
void run(const char* name, const Bytes& bytes) {
  constexpr int kPasses = 9;
  constexpr std::size_t kRead = 496;
  std::vector<double> speeds;
  std::uint64_t messages = 0;
  double sum = 0;
  for (int pass = 0; pass < kPasses; ++pass) {
    FrameStream stream;
    const auto begin = std::chrono::steady_clock::now();
    for (std::span<const std::uint8_t> rest(bytes); !rest.empty();) {
      rest = rest.subspan(stream.accept(rest.first(std::min(kRead, rest.size()))));
      for (Message m; stream.next(&m);) {
        if (m.is(MessageId::mtdata2)) {
          Mtdata2 d;
          if (decode_mtdata2(m.payload, &d) == PacketStatus::ok && d.quaternion)
            sum += (*d.quaternion)[0];
        } else if (m.is(MessageId::mtdata)) {
          Mtdata d;
          if (decode_mtdata(m.payload, kLayout, &d) == MtdataStatus::ok) sum += (*d.quaternion)[0];
        }
      }
    }
    speeds.push_back(
        static_cast<double>(bytes.size()) /
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() / 1e6);
    messages = stream.counters().messages;
  }
  std::sort(speeds.begin(), speeds.end());
  std::printf("%-28s %8zu bytes  %7llu messages   %6.0f MB/s median (%.0f to %.0f)   [%g]\n", name,
              bytes.size(), static_cast<unsigned long long>(messages), speeds[kPasses / 2],
              speeds.front(), speeds.back(), sum);
}

}  // namespace

int main() {
  Random random(7, 15);
  run("MTData2", mtdata2_stream(random, 0));
  run("MTData2 among noise", mtdata2_stream(random, 0.5));
  run("MTData, 16.32", mtdata_stream(random));
  Bytes noise(kStreamBytes);
  for (std::uint8_t& b : noise) b = static_cast<std::uint8_t>(random.next() >> 24U);
  run("noise", noise);
  return 0;
}
