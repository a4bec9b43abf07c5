#include "drivers/xsens/request_reply.hpp"

#include <algorithm>
#include <string_view>

namespace vergence::xsens {
namespace {

constexpr Duration kAskAgain = Duration::milliseconds(150);
constexpr Duration kListen = Duration::milliseconds(50);
constexpr Duration kWrite = Duration::milliseconds(100);

}  // namespace

void RequestReply::ask(xbus::MessageId id, std::span<const std::uint8_t> payload, Reply* reply,
                       Duration limit) {
  std::array<std::uint8_t, xbus::kMaxFrame> frame{};
  const xbus::WrittenFrame w =
      xbus::write_frame({xbus::kBusMaster, static_cast<std::uint8_t>(id), payload}, frame);
  const HostStamp end = line_.now() + limit;
  reply->answer = Answer::silent;
  do {  // ends: each turn listens for kAskAgain of the limit
    const DeviceStatus sent = line_.write(std::span(frame).first(w.size), kWrite);
    if (sent == DeviceStatus::gone || sent == DeviceStatus::failed) {
      reply->answer = Answer::gone;
      return;
    }
    const HostStamp until = std::min(end, line_.now() + kAskAgain);
    reply->answer = listen(static_cast<std::uint8_t>(static_cast<unsigned>(id) + 1U), until, reply);
  } while (reply->answer == Answer::silent && line_.now() < end);
}

Answer RequestReply::listen(std::uint8_t requested, HostStamp until, Reply* reply) {
  std::array<std::uint8_t, 512> bytes{};
  for (;;) {  // ends at `until`: reading lets time pass
    for (xbus::Message m; stream_.next(&m);) {
      ++messages_;
      if (m.id != requested && !m.is(xbus::MessageId::error)) continue;
      reply->size = m.payload.size();
      std::copy(m.payload.begin(), m.payload.end(), reply->payload.begin());
      if (m.id == requested) return Answer::ok;
      reply->error = m.payload.empty() ? std::uint8_t{0} : m.payload[0];
      // A dip of the supply is told unasked: it answers nothing.
      if (reply->error != xbus::kErrorPowerDip) return Answer::refused;
    }
    if (stop_.load(std::memory_order_acquire)) return Answer::stopped;
    const HostStamp now = line_.now();
    if (now >= until) return Answer::silent;
    const LineRead r = line_.read(bytes, std::min(kListen, until - now));
    if (r.status == DeviceStatus::gone || r.status == DeviceStatus::failed ||
        r.status == DeviceStatus::ended)
      return Answer::gone;
    if (r.status != DeviceStatus::ok) continue;
    const std::span<const std::uint8_t> got(bytes.data(), r.size);
    remember(got);
    (void)stream_.accept(got);  // 512 bytes fit beside any frame that waits
  }
}

void RequestReply::remember(std::span<const std::uint8_t> bytes) noexcept {
  const std::size_t n = std::min(bytes.size(), received_.size() - received_size_);
  std::copy_n(bytes.begin(), n, received_.begin() + static_cast<std::ptrdiff_t>(received_size_));
  received_size_ += n;
}

void RequestReply::forget() noexcept {
  stream_.reset();
  messages_ = 0;
  received_size_ = 0;
}

std::string RequestReply::received_instead() const {
  const std::string_view received(reinterpret_cast<const char*>(received_.data()), received_size_);
  if (received.empty() || messages_ > 0) return {};
  if (received.find("$G") != std::string_view::npos &&
      received.find("\r\n") != std::string_view::npos)
    return "it speaks NMEA 0183";
  if (received.find("\xB5\x62") != std::string_view::npos) return "it speaks u-blox's protocol";
  if (received.find("\xAA\x44\x12") != std::string_view::npos)
    return "it speaks NovAtel's protocol";
  if (received.find("snp") != std::string_view::npos)
    return "it speaks the protocol of a Redshift or CH Robotics sensor";
  if (received.find("VNYMR") != std::string_view::npos ||
      received.find("$VN") != std::string_view::npos)
    return "it speaks VectorNav's protocol";
  return "its bytes are no Xbus";
}

}  // namespace vergence::xsens
