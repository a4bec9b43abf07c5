#pragma once
#include <netinet/in.h>

#include <array>
#include <cstddef>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "core/math/random.hpp"
#include "core/types/time.hpp"

namespace vergence::test {

/// Exact counts of the simulated camera's exposures. A frame is one exposure since the
/// acquisition's start.
struct GigeCameraReport {
  std::uint64_t exposed = 0;
  /// Frames of which every packet was sent, at first or on request.
  std::uint64_t whole = 0;
  /// Frames of which the leader was sent, but not every other packet.
  std::uint64_t incomplete = 0;
  /// Frames of which the leader was not sent, but another packet was.
  std::uint64_t headless = 0;
  /// Frames of which no packet was sent.
  std::uint64_t nothing = 0;
  /// Packets that were not sent at first.
  std::uint64_t dropped = 0;
  /// Packets requested again, and those of them that were sent.
  std::uint64_t asked = 0, resent = 0;
  /// Number of acquisition starts.
  std::uint64_t starts = 0;
};

/// Bytes in network order, appended.
class Wire {
 public:
  Wire& u8(std::uint32_t v) {
    bytes_.push_back(static_cast<std::uint8_t>(v));
    return *this;
  }
  Wire& u16(std::uint32_t v) { return u8(v >> 8U & 0xFFU).u8(v & 0xFFU); }
  Wire& u32(std::uint32_t v) { return u16(v >> 16U).u16(v & 0xFFFFU); }
  Wire& u64(std::uint64_t v) {
    return u32(static_cast<std::uint32_t>(v >> 32U)).u32(static_cast<std::uint32_t>(v));
  }
  [[nodiscard]] const std::vector<std::uint8_t>& bytes() const noexcept { return bytes_; }

 private:
  std::vector<std::uint8_t> bytes_;
};

/// One frame to be sent.
struct GvspFrame {
  std::uint64_t number = 0, block = 0, ticks = 0;
  std::uint32_t pixel_format = 0;
  int width = 0, height = 0, offset_x = 0, offset_y = 0;
  /// Pixels, and the chunk data behind them.
  std::vector<std::uint8_t> pixels{};
};

/// The stream channel of the simulated camera: packets, their loss, what is sent again, and the
/// accounts of it all.
///
/// Threads  send(): one. Everything else: any.
class GvspSender {
 public:
  GvspSender(const std::string& address, bool extended_ids, std::uint64_t seed);
  ~GvspSender();
  GvspSender(const GvspSender&) = delete;
  GvspSender& operator=(const GvspSender&) = delete;

  void aim(const sockaddr_in& target, std::uint32_t packet_size, Duration packet_delay);
  /// Deliberate damage to a frame.
  enum class Fate : std::uint8_t { normal, unsent, incomplete };
  void send(GvspFrame frame, Fate fate);
  /// Answers a request; unknown blocks are answered as unavailable.
  void resend(std::uint64_t block, std::uint32_t first, std::uint32_t last);
  void fire_test_packet(std::uint32_t size);
  void set_loss(double share);

  void add_to(GigeCameraReport* report) const;

 private:
  /// Frames that can be asked for again.
  static constexpr std::size_t kHistory = 8;
  struct Record {
    GvspFrame frame;
    /// Bytes of a packet; packets of the frame, leader and trailer among them.
    std::uint32_t data_bytes = 0, packets = 0;
    std::size_t account = 0;
  };
  struct Account {
    /// By packet.
    std::vector<bool> went;
    /// Incomplete on purpose: packet `hole` is not sent again either.
    bool never = false;
    std::uint32_t hole = 0;
  };
  void packet(const Record& record, std::uint32_t id, bool again);
  void transmit(const std::vector<std::uint8_t>& head, std::span<const std::uint8_t> data);
  [[nodiscard]] Wire header(std::uint64_t block, std::uint32_t format, std::uint32_t id,
                            std::uint32_t status) const;

  int socket_ = -1;
  bool extended_;
  /// Held for one packet at a time while a frame goes out.
  mutable std::mutex mutex_;
  double loss_ = 0;
  Random random_;
  sockaddr_in target_{};
  std::uint32_t packet_size_ = 1500;
  Duration packet_delay_{};
  std::array<Record, kHistory> history_{};
  std::uint64_t frames_ = 0;
  std::vector<Account> accounts_;
  std::uint64_t dropped_ = 0, asked_ = 0, resent_ = 0;
};

void sleep_until(HostStamp when) noexcept;

}  // namespace vergence::test
