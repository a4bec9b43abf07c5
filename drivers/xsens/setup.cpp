#include "drivers/xsens/setup.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "drivers/xsens/detail/format_text.hpp"

namespace vergence::xsens {
namespace {

using namespace xbus;

constexpr Duration kProbe = Duration::milliseconds(
    500);  // a device that measures speaks within this, one that listens answers
constexpr Duration kAfterReset = Duration::milliseconds(2500);

DeviceStatus status_of(Answer answer) noexcept {
  switch (answer) {
    case Answer::ok:
      return DeviceStatus::ok;
    case Answer::refused:
      return DeviceStatus::failed;
    case Answer::silent:
    case Answer::gone:
      return DeviceStatus::gone;
    case Answer::stopped:
      return DeviceStatus::stopped;
  }
  return DeviceStatus::failed;
}

}  // namespace

DeviceStatus Setup::probe(std::uint32_t baud, Duration limit) {
  if (line_.baud() != baud) {
    const DeviceStatus status = line_.set_baud(baud);
    if (status != DeviceStatus::ok) return status;
    dialogue_.forget();
  }
  dialogue_.ask(MessageId::go_to_config, {}, &reply_, limit);
  return reply_.answer == Answer::silent ? DeviceStatus::timeout : status_of(reply_.answer);
}

DeviceStatus Setup::find() {
  std::array<std::uint32_t, kBaudScan.size() + 2> bauds{};
  bauds[0] = options_.baud != 0 ? options_.baud : line_.baud();
  bauds[1] = line_.baud();
  std::copy(kBaudScan.begin(), kBaudScan.end(), bauds.begin() + 2);
  std::string instead;
  for (std::size_t i = 0; i < bauds.size(); ++i) {
    if (std::count(bauds.begin(), bauds.begin() + static_cast<std::ptrdiff_t>(i), bauds[i]) > 0)
      continue;
    const DeviceStatus status = probe(bauds[i], kProbe);
    if (status == DeviceStatus::ok || status == DeviceStatus::stopped) return status;
    if (status == DeviceStatus::gone) {
      last_error_ = "the line went dead while the device was looked for; check its cable";
      return status;
    }
    const std::string received = dialogue_.received_instead();
    // At the wrong rate any device is noise: what is recognised outranks what is not.
    if (!received.empty() && (instead.empty() || instead == "its bytes are no Xbus"))
      instead = received;
    if (dialogue_.messages_received() > 0)
      instead = format_text(
          "it sends Xbus messages at %u baud, but does not answer: check the line towards it",
          bauds[i]);
  }
  last_error_ = instead.empty()
                    ? "it is silent at every baud rate; check its power, its cable and the port"
                    : "no XSens INS answers: " + instead + "; check that ins.port is the INS's";
  return DeviceStatus::not_found;
}

DeviceStatus Setup::failed(const char* what) {
  last_error_ = reply_.answer == Answer::refused
                    ? format_text("it refuses %s: %.*s (error %02X)", what,
                                  static_cast<int>(error_text(reply_.error).size()),
                                  error_text(reply_.error).data(), reply_.error)
                    : format_text("it does not answer to %s; check its cable", what);
  return status_of(reply_.answer);
}

DeviceStatus Setup::write(MessageId id, std::span<const std::uint8_t> payload, const char* what) {
  dialogue_.ask(id, payload, &reply_);
  return reply_.answer == Answer::ok ? DeviceStatus::ok : failed(what);
}

DeviceStatus Setup::identify(Identity* identity) {
  if (const DeviceStatus s = write(MessageId::device_id_request, {}, "the question for its id");
      s != DeviceStatus::ok)
    return s;
  if (reply_.size < 4) {
    last_error_ = "its id has fewer than four bytes: no XSens INS";
    return DeviceStatus::unsupported;
  }
  Identity found;
  found.device_id = read_u32(reply_.bytes());
  dialogue_.ask(MessageId::product_code_request, &reply_);
  if (reply_.answer == Answer::ok) {
    std::size_t n = std::min(reply_.size, sizeof(found.product) - 1);
    while (n > 0 && (reply_.payload[n - 1] == ' ' || reply_.payload[n - 1] == 0)) --n;
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint8_t c = reply_.payload[i];
      found.product[i] = c >= 0x20 && c < 0x7F ? static_cast<char>(c) : '?';
    }
  }
  dialogue_.ask(MessageId::firmware_request, &reply_);
  if (reply_.answer == Answer::ok && reply_.size >= 3)
    std::copy_n(reply_.payload.begin(), 3, std::begin(found.firmware));
  // What decides is what it can: only the newer ones know an output configuration.
  dialogue_.ask(MessageId::output_configuration, &reply_);
  if (reply_.answer == Answer::ok) {
    found.generation = Generation::mark4;
  } else if (reply_.answer == Answer::refused) {
    found.generation = Generation::legacy;
  } else {
    return failed("the question for its outputs");
  }
  *identity = found;
  return DeviceStatus::ok;
}

DeviceStatus Setup::refuse_load(const LineBudget& b, double rate_hz, std::uint32_t baud) {
  last_error_ = format_text(
      "%.0f Hz need %.0f %% of the line at %u baud, more than the %.0f %% that are safe; ", rate_hz,
      100 * b.load, baud, 100 * kLineLoadMost);
  last_error_ += b.baud_needed != 0
                     ? format_text("set ins.baud to %u, or ins.rate to %.0f or less", b.baud_needed,
                                   std::floor(b.greatest_rate))
                     : format_text("set ins.rate to %.0f or less", std::floor(b.greatest_rate));
  return DeviceStatus::no_bandwidth;
}

DeviceStatus Setup::set(const Identity& identity, double rate_hz, StreamSettings* stream) {
  StreamSettings requested;
  requested.generation = identity.generation;
  const DeviceStatus set = identity.generation == Generation::legacy
                               ? set_legacy(rate_hz, &requested)
                               : set_mark4(rate_hz, &requested);
  if (set != DeviceStatus::ok) return set;
  if (const DeviceStatus s = set_baud(identity); s != DeviceStatus::ok) return s;
  *stream = requested;
  return DeviceStatus::ok;
}

DeviceStatus Setup::set_baud(const Identity& identity) {
  if (options_.baud == 0 || options_.baud == line_.baud()) return DeviceStatus::ok;
  const auto code = baud_code(options_.baud, identity.generation);
  if (!code) {
    last_error_ = format_text("it has no %u baud; set ins.baud to 115200, 230400, 460800 or 921600",
                              options_.baud);
    return DeviceStatus::unsupported;
  }
  const std::array<std::uint8_t, 1> payload{*code};
  if (const DeviceStatus s = write(MessageId::baudrate, payload, "the baud rate");
      s != DeviceStatus::ok)
    return s;
  // It holds from the next reset on; whether the answer to the reset still comes through does not
  // matter.
  dialogue_.ask(MessageId::reset, {}, &reply_, Duration::milliseconds(100));
  const DeviceStatus status = probe(options_.baud, kAfterReset);
  if (status == DeviceStatus::timeout) {
    last_error_ = format_text(
        "it does not answer at %u baud after it was set to it; check that the converter can do "
        "that rate",
        options_.baud);
    return DeviceStatus::failed;
  }
  return status;
}

DeviceStatus Setup::measure() {
  constexpr std::uint8_t kTooMuch = 0x29;
  dialogue_.ask(MessageId::go_to_measurement, &reply_);
  if (reply_.answer == Answer::ok) return DeviceStatus::ok;
  const DeviceStatus status = failed("to measure");
  return reply_.answer == Answer::refused && reply_.error == kTooMuch ? DeviceStatus::no_bandwidth
                                                                      : status;
}

}  // namespace vergence::xsens
