// Seeded random inputs for the same probe, without a fuzzer's library:  xbus_random [INPUTS] [SEED]
// Pure noise never passes a checksum: half of the inputs are real frames, mutated, among noise.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "core/math/random.hpp"
#include "firmware_iface/xbus/xbus.hpp"
#include "tests/fuzz/xbus/probe.hpp"

namespace vergence::xbus {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::array kIds{0x0810, 0x1010, 0x1020, 0x1060, 0x2010, 0x2015, 0x2020, 0x2030,
                          0x3010, 0x4020, 0x5042, 0x5022, 0x7010, 0x7020, 0x8020, 0x8030,
                          0xC020, 0xD012, 0xE010, 0xE020, 0x8830, 0xFFFF};

std::uint8_t any_byte(Random& r) { return static_cast<std::uint8_t>(r.next() >> 24U); }

void add_noise(Random& r, std::size_t n, Bytes* out) {
  for (std::size_t i = 0; i < n; ++i) out->push_back(r.below(16) == 0 ? kPreamble : any_byte(r));
}

void add_payload(Random& r, Bytes* payload) {
  switch (r.below(4)) {
    case 0:  // packets, mostly of the right size
      for (std::uint32_t i = r.below(6); i > 0; --i) {
        const auto id = static_cast<std::uint16_t>(kIds[r.below(kIds.size())] +
                                                   (r.below(4) == 0 ? r.below(16) : 0));
        const std::size_t size =
            r.below(8) == 0 ? r.below(40) : packet_size(id).value_or(r.below(40));
        payload->insert(payload->end(),
                        {static_cast<std::uint8_t>(id >> 8U), static_cast<std::uint8_t>(id),
                         static_cast<std::uint8_t>(size)});
        add_noise(r, size, payload);
      }
      return;
    case 1: {  // a legacy layout and its data
      const auto mode = static_cast<std::uint16_t>(r.next() & 0x583FU);
      const std::uint32_t settings = r.next() & 0x80000FFFU;
      for (const unsigned shift : {8U, 0U})
        payload->push_back(static_cast<std::uint8_t>(mode >> shift));
      for (const unsigned shift : {24U, 16U, 8U, 0U})
        payload->push_back(static_cast<std::uint8_t>(settings >> shift));
      const std::size_t size = MtdataLayout{mode, settings}.payload_size().value_or(r.below(60));
      for (std::size_t i = 0; i < size; ++i) payload->push_back(any_byte(r));
      return;
    }
    case 2:
      add_noise(r, r.below(12) == 0 ? r.below(2049) : r.below(120), payload);
      return;
    default:
      add_noise(r, 12 * r.below(4), payload);
      return;
  }
}

void make(Random& r, Bytes* out) {
  out->clear();
  if (r.below(4) == 0) {
    add_payload(r, out);
    return;
  }
  for (std::uint32_t parts = 1 + r.below(4); parts > 0; --parts) {
    if (r.below(3) == 0) add_noise(r, r.below(40), out);
    Bytes payload;
    add_payload(r, &payload);
    Bytes frame(kMaxFrame);
    const WrittenFrame w = write_frame({kBusMaster, any_byte(r), payload}, frame);
    frame.resize(w.size);
    if (r.below(4) == 0 && !frame.empty())
      frame[r.below(static_cast<std::uint32_t>(frame.size()))] ^=
          static_cast<std::uint8_t>(1U << r.below(8));
    if (r.below(8) == 0 && !frame.empty())
      frame.resize(r.below(static_cast<std::uint32_t>(frame.size())));
    out->insert(out->end(), frame.begin(), frame.end());
  }
}

}  // namespace
}  // namespace vergence::xbus

int main(int argc, char** argv) {
  const unsigned long long inputs = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 1'000'000;
  const unsigned long long seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  vergence::Random random(seed, 15);
  std::vector<std::uint8_t> bytes;
  unsigned long long total = 0;
  for (unsigned long long i = 0; i < inputs; ++i) {
    vergence::xbus::make(random, &bytes);
    vergence::xbus::probe(bytes);
    total += bytes.size();
  }
  std::printf("%llu inputs, %llu bytes, seed %llu: no finding\n", inputs, total, seed);
  return 0;
}
