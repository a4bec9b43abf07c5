#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "firmware_iface/xbus/xbus.hpp"
#include "tests/fuzz/require.hpp"

namespace vergence::xbus {
namespace {

using test::require;

/// Reading and writing a layout gives the same bytes: no field is shifted or made up. Parts that no
/// INS sample is made of are written as zeros.
void probe_mtdata(std::span<const std::uint8_t> payload, const MtdataLayout& layout) {
  Mtdata data;
  if (!decode_mtdata(payload, layout, &data)) return;
  std::array<std::uint8_t, kMaxPayload> again{};
  require(encode_mtdata(data, layout, again) == payload.size(),
          "what was read is written in the same length");
  require(std::equal(payload.begin(), payload.end(), again.begin(),
                     [](std::uint8_t read, std::uint8_t written) {
                       return written == read || written == 0;
                     }),
          "what was read is written back the same");
}

void probe_payload(std::span<const std::uint8_t> payload) {
  Mtdata2 data;
  if (decode_mtdata2(payload, &data)) {
    if (data.quaternion)
      for (const double q : *data.quaternion) require(std::isfinite(q), "numbers are finite");
    if (data.utc && plausible(*data.utc)) {
      const Utc back = utc_of_unix_ns(unix_ns(*data.utc), data.utc->flags);
      require(data.utc->second == 60 || back.second == data.utc->second, "a time reads back");
    }
  }
  DeviceConfiguration configuration;
  if (read_configuration(payload, &configuration)) {
    probe_mtdata(payload, {configuration.output_mode, configuration.output_settings});
    std::array<std::uint8_t, kConfigurationSize> again{};
    write_configuration(configuration, again);
    DeviceConfiguration back;
    require(read_configuration(again, &back) && back.device_id == configuration.device_id,
            "a configuration reads back");
  }
  OutputConfiguration outputs;
  if (read_output_configuration(payload, &outputs)) {
    std::array<std::uint8_t, 4 * kMaxOutputs> again{};
    const std::size_t n = write_output_configuration(outputs, again);
    require(n == payload.size() && std::equal(payload.begin(), payload.end(), again.begin()),
            "outputs read back");
    require(line_budget(outputs, 115200).load >= 0, "a load is not negative");
  }
  SyncSettings sync;
  if (read_sync_settings(payload, &sync)) {
    std::array<std::uint8_t, kSyncEntrySize * kMaxSyncEntries> again{};
    const std::size_t n = write_sync_settings(sync, again);
    require(n == payload.size() && std::equal(payload.begin(), payload.end(), again.begin()),
            "sync settings read back");
  }
  LegacySync parameter{};
  std::uint32_t value = 0;
  (void)read_legacy_sync(payload, &parameter, &value);
  if (payload.size() >= 6) {
    const MtdataLayout layout{static_cast<std::uint16_t>(payload[0] << 8U | payload[1]),
                              static_cast<std::uint32_t>(payload[2]) << 24U |
                                  static_cast<std::uint32_t>(payload[3]) << 16U |
                                  static_cast<std::uint32_t>(payload[4]) << 8U | payload[5]};
    const auto rest = payload.subspan(6);
    const auto size = layout.payload_size();
    if (size && *size <= rest.size()) probe_mtdata(rest.first(*size), layout);
    probe_mtdata(rest, layout);
  }
}

/// Gives hostile bytes to everything that reads Xbus: frames, both data messages, every
/// configuration payload. Each property that must hold whatever the bytes are is checked; a breach
/// aborts with a message on stderr.
void probe(std::span<const std::uint8_t> bytes) {
  probe_payload(bytes);
  // The stream against a reader without memory: the same frames, however the bytes are cut into
  // pieces.
  FrameStream stream;
  // Position of the reader without memory.
  std::size_t at = 0;
  std::span<const std::uint8_t> rest = bytes;
  std::size_t piece = 1 + (bytes.empty() ? 0 : bytes[0] % 67U);
  while (!rest.empty()) {
    const std::size_t taken = stream.accept(rest.first(std::min(piece, rest.size())));
    rest = rest.subspan(taken);
    bool any = false;
    for (Message message; stream.next(&message);) {
      any = true;
      ParsedFrame expected;
      for (; at < bytes.size(); ++at) {
        expected = parse_frame(bytes.subspan(at));
        if (expected.status == FrameStatus::ok) break;
      }
      require(expected.status == FrameStatus::ok, "no frame is made up");
      require(expected.message.id == message.id &&
                  expected.message.payload.size() == message.payload.size() &&
                  std::equal(message.payload.begin(), message.payload.end(),
                             expected.message.payload.begin()),
              "the same frames however the bytes come");
      at += expected.size;
      probe_payload(message.payload);
    }
    require(taken > 0 || any, "the stream goes on");
    piece = piece % 67U + 1;
  }
  const StreamCounters& c = stream.counters();
  require(c.message_bytes + c.garbage_bytes + stream.waiting() == bytes.size(),
          "every byte is accounted for");
  require(c.bus_refused + c.length_refused + c.checksum_wrong <= c.garbage_bytes,
          "a refusal costs a byte");
}

}  // namespace
}  // namespace vergence::xbus

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  vergence::xbus::probe({data, size});
  return 0;
}
