#include "tests/support/gvsp_sender.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <stdexcept>

#include "drivers/clock.hpp"

namespace vergence::test {
namespace {

constexpr std::uint32_t kLeader = 1, kTrailer = 2, kData = 3;
/// Payload type of an image.
constexpr std::uint32_t kImage = 1;
/// GEV_STATUS_PACKET_UNAVAILABLE.
constexpr std::uint32_t kUnavailable = 0x800C;

}  // namespace

void sleep_until(HostStamp when) noexcept {
  const timespec t{when.ns() / 1'000'000'000, when.ns() % 1'000'000'000};
  (void)::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr);
}

GvspSender::GvspSender(const std::string& address, bool extended_ids, std::uint64_t seed)
    : extended_(extended_ids), random_(seed, 77) {
  socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in own{};
  own.sin_family = AF_INET;
  if (socket_ < 0 || ::inet_pton(AF_INET, address.c_str(), &own.sin_addr) != 1 ||
      ::bind(socket_, reinterpret_cast<const sockaddr*>(&own), sizeof own) != 0)
    throw std::runtime_error("simulated camera: no stream socket on " + address);
  // Its own queue is not what is tested.
  const int room = 4 << 20;
  (void)::setsockopt(socket_, SOL_SOCKET, SO_SNDBUF, &room, sizeof room);
}

GvspSender::~GvspSender() { (void)::close(socket_); }

void GvspSender::aim(const sockaddr_in& target, std::uint32_t packet_size, Duration packet_delay) {
  const std::lock_guard lock(mutex_);
  target_ = target;
  packet_size_ = packet_size;
  packet_delay_ = packet_delay;
}

void GvspSender::set_loss(double share) {
  const std::lock_guard lock(mutex_);
  loss_ = share;
}

Wire GvspSender::header(std::uint64_t block, std::uint32_t format, std::uint32_t id,
                        std::uint32_t status) const {
  Wire w;
  if (extended_)
    w.u16(status).u16(0).u32((0x80U | format) << 24U).u64(block).u32(id);
  else
    w.u16(status).u16(static_cast<std::uint32_t>(block & 0xFFFFU)).u32(format << 24U | id);
  return w;
}

void GvspSender::transmit(const std::vector<std::uint8_t>& head,
                          std::span<const std::uint8_t> data) {
  std::array<iovec, 2> parts{{{const_cast<std::uint8_t*>(head.data()), head.size()},
                              {const_cast<std::uint8_t*>(data.data()), data.size()}}};
  msghdr message{};
  message.msg_name = &target_;
  message.msg_namelen = sizeof target_;
  message.msg_iov = parts.data();
  message.msg_iovlen = data.empty() ? 1 : 2;
  (void)::sendmsg(socket_, &message, 0);
}

/// Precondition: mutex_ held.
void GvspSender::packet(const Record& record, std::uint32_t id, bool again) {
  Account& account = accounts_[record.account];
  const bool lost =
      (account.never && id == account.hole) || (loss_ > 0 && random_.uniform() < loss_);
  if (lost) {
    dropped_ += again ? 0 : 1;
    return;
  }
  const GvspFrame& f = record.frame;
  if (id == 0) {
    Wire w = header(f.block, kLeader, id, 0);
    w.u16(0)
        .u16(kImage)
        .u64(f.ticks)
        .u32(f.pixel_format)
        .u32(static_cast<std::uint32_t>(f.width))
        .u32(static_cast<std::uint32_t>(f.height))
        .u32(static_cast<std::uint32_t>(f.offset_x))
        .u32(static_cast<std::uint32_t>(f.offset_y))
        .u16(0)
        .u16(0);
    transmit(w.bytes(), {});
  } else if (id + 1 == record.packets) {
    Wire w = header(f.block, kTrailer, id, 0);
    w.u32(kImage).u32(static_cast<std::uint32_t>(f.height));
    transmit(w.bytes(), {});
  } else {
    const std::size_t begin = static_cast<std::size_t>(id - 1) * record.data_bytes;
    const std::size_t length = std::min<std::size_t>(record.data_bytes, f.pixels.size() - begin);
    transmit(header(f.block, kData, id, 0).bytes(), std::span(f.pixels).subspan(begin, length));
  }
  account.went[id] = true;
  resent_ += again ? 1 : 0;
}

void GvspSender::send(GvspFrame frame, Fate fate) {
  std::unique_lock lock(mutex_);
  Record& record = history_[frames_++ % kHistory];
  record.frame = std::move(frame);
  record.data_bytes = packet_size_ - (extended_ ? 48U : 36U);
  record.packets = static_cast<std::uint32_t>((record.frame.pixels.size() + record.data_bytes - 1) /
                                              record.data_bytes) +
                   2;
  record.account = accounts_.size();
  accounts_.push_back({std::vector<bool>(record.packets, false), fate == Fate::incomplete,
                       1 + (record.packets - 2) / 2});
  if (fate == Fate::unsent) {
    record.packets = 0;
    dropped_ += accounts_.back().went.size();
    return;
  }
  const std::uint32_t packets = record.packets;
  HostStamp due = monotonic_now();
  for (std::uint32_t id = 0; id < packets; ++id) {
    packet(record, id, false);
    due = due + packet_delay_;
    const Duration ahead = due - monotonic_now();
    // Requests to send again are answered between packets, as a camera does.
    lock.unlock();
    if (ahead > Duration::microseconds(60)) sleep_until(due);
    lock.lock();
  }
}

void GvspSender::resend(std::uint64_t block, std::uint32_t first, std::uint32_t last) {
  const std::lock_guard lock(mutex_);
  for (const Record& record : history_) {
    if (record.packets == 0 || record.frame.block != block) continue;
    for (std::uint32_t id = first; id <= std::min(last, record.packets - 1); ++id) {
      ++asked_;
      packet(record, id, true);
    }
    return;
  }
  for (std::uint32_t id = first; id <= last && id - first < 64; ++id) {
    ++asked_;
    transmit(header(block, kData, id, kUnavailable).bytes(), {});
  }
}

void GvspSender::fire_test_packet(std::uint32_t size) {
  const std::lock_guard lock(mutex_);
  transmit(std::vector<std::uint8_t>(size - 28), {});
}

void GvspSender::add_to(GigeCameraReport* r) const {
  const std::lock_guard lock(mutex_);
  for (const Account& a : accounts_) {
    const auto went = static_cast<std::size_t>(std::count(a.went.begin(), a.went.end(), true));
    ++(went == a.went.size() ? r->whole
       : went == 0           ? r->nothing
       : a.went[0]           ? r->incomplete
                             : r->headless);
  }
  r->exposed += accounts_.size();
  r->dropped += dropped_;
  r->asked += asked_;
  r->resent += resent_;
}

}  // namespace vergence::test
