// Seeded random inputs for the probe:  gnss_random [INPUTS] [SEED]
// Noise never passes a checksum: most inputs are real messages, mutated before their checksum is
// made or after, among noise.
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "core/math/random.hpp"
#include "tests/fuzz/gnss/probe.hpp"
#include "tests/support/gnss_bytes.hpp"

namespace vergence::test {
namespace {

constexpr const char* kBodies[] = {
    "GNGGA,012345.250,2729.85000,S,15300.82200,E,4,17,0.62,20.125,M,39.5,M,1.0,0000",
    "GPRMC,235959,A,2729.85,S,15300.822,W,36.0,270.5,290224,,,A",
    "GNVTG,10.5,T,,M,1.0,N,36.0,K,A",
    "GNGST,120000,1,2,1,0,0.3,0.4,0.9",
    "HEHDT,123.4,T",
};
constexpr char kCharacters[] = "0123456789.,-NSEWATM$*\r";

std::uint8_t any_byte(Random& r) { return static_cast<std::uint8_t>(r.next() >> 24U); }

std::string nmea_input(Random& r) {
  std::string body = kBodies[r.below(5)];
  for (std::uint32_t n = r.below(6); n > 0; --n)
    body[r.below(static_cast<std::uint32_t>(body.size()))] =
        r.below(4) == 0 ? static_cast<char>(any_byte(r)) : kCharacters[r.below(23)];
  return nmea_sentence(body);
}

std::string ubx_input(Random& r) {
  PvtBytes pvt;
  for (std::uint32_t n = r.below(10); n > 0; --n) pvt.bytes[r.below(92)] = any_byte(r);
  if (r.below(4) == 0) pvt.bytes.resize(r.below(200));
  return pvt.frame();
}

void make(Random& r, std::vector<std::uint8_t>* out) {
  out->clear();
  for (std::uint32_t parts = 1 + r.below(4); parts > 0; --parts) {
    for (std::uint32_t n = r.below(3) == 0 ? r.below(40) : 0; n > 0; --n)
      out->push_back(any_byte(r));
    std::string message = r.below(2) == 0 ? nmea_input(r) : ubx_input(r);
    if (r.below(4) == 0)
      message[r.below(static_cast<std::uint32_t>(message.size()))] = static_cast<char>(any_byte(r));
    if (r.below(8) == 0) message.resize(r.below(static_cast<std::uint32_t>(message.size())));
    out->insert(out->end(), message.begin(), message.end());
  }
}

}  // namespace
}  // namespace vergence::test

int main(int argc, char** argv) {
  const unsigned long long inputs = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 1'000'000;
  const unsigned long long seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  vergence::Random random(seed, 15);
  std::vector<std::uint8_t> bytes;
  unsigned long long total = 0;
  for (unsigned long long i = 0; i < inputs; ++i) {
    vergence::test::make(random, &bytes);
    vergence::test::probe_gnss(bytes);
    total += bytes.size();
  }
  std::printf("%llu inputs, %llu bytes, seed %llu: no finding\n", inputs, total, seed);
  return 0;
}
