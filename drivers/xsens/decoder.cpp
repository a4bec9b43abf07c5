#include "drivers/xsens/decoder.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vergence::xsens {
namespace {

using namespace xbus;

constexpr Duration kWithoutPlace =
    Duration::milliseconds(200);  // so long a position may be missing while there is a fix

bool answers(const Message& m, MessageId request) noexcept {
  return m.id == static_cast<std::uint8_t>(static_cast<unsigned>(request) + 1U);
}

}  // namespace

void Decoder::begin(const StreamSettings& stream, std::uint32_t baud,
                    Duration processing) noexcept {
  set_ = stream;
  stream_.reset();
  const StreamCounters& c = stream_.counters();
  base_ = c.message_bytes + c.garbage_bytes;
  received_ = 0;
  timing_ = ArrivalTiming(baud, processing);
  sample_time_ = {};
  sample_counter_ = {};
  receiver_ = {};
  counted_ = false;
  said_ = {};
  any_ = false;
  last_sample_ = {};
}

void Decoder::accept(std::span<const std::uint8_t> bytes, HostStamp arrival) noexcept {
  arrival_ = arrival;
  received_ += bytes.size();
  timing_.read(received_, arrival);
  (void)stream_.accept(bytes);  // kMostBytes fit beside any frame that waits
}

bool Decoder::woke() noexcept { return std::exchange(said_.woke, false); }

bool Decoder::answered(MessageId request) noexcept {
  return std::exchange(request == MessageId::go_to_config ? said_.stopped : said_.going_on, false);
}

bool Decoder::next(InsReading* reading) noexcept {
  for (Message m; stream_.next(&m);) {
    const StreamCounters& c = stream_.counters();
    const std::uint64_t end = c.message_bytes + c.garbage_bytes - base_;
    const std::uint64_t begin = end - frame_size(m.payload.size());
    if (m.is(MessageId::mtdata2) && set_.generation == Generation::mark4) {
      if (take_mtdata2(m, begin, end, reading)) return true;
    } else if (m.is(MessageId::mtdata) && set_.generation == Generation::legacy) {
      if (take_mtdata(m, begin, end, reading)) return true;
    } else {
      take_other(m);
    }
    timing_.other(end);
  }
  return false;
}

void Decoder::take_other(const Message& m) noexcept {
  ++counters_.other;
  if (m.is(MessageId::wake_up)) said_.woke = true;
  if (answers(m, MessageId::go_to_config)) said_.stopped = true;
  if (answers(m, MessageId::go_to_measurement)) said_.going_on = said_.resumed = true;
  if (!m.is(MessageId::error)) return;
  ++counters_.errors;
  counters_.last_error = m.payload.empty() ? std::uint8_t{0} : m.payload[0];
  if (counters_.last_error == kErrorPowerDip) said_.woke = true;
}

void Decoder::count_messages(std::uint16_t counter) noexcept {
  if (counted_) {
    const auto ahead = static_cast<std::uint16_t>(counter - last_message_);
    constexpr std::uint16_t kBelievable = 4096;  // beyond: the device restarted
    if (ahead > 1 && ahead < kBelievable) counters_.lost += ahead - 1U;
  }
  counted_ = true;
  last_message_ = counter;
}

bool Decoder::step(ClockStep step) noexcept {
  switch (step) {
    case ClockStep::first:
    case ClockStep::forward:
      return true;
    case ClockStep::backward:
      ++counters_.backward;
      return false;
    case ClockStep::restart:
      ++counters_.restarts;
      timing_.restart();
      counted_ = false;
      return true;
  }
  return false;
}

bool Decoder::take_mtdata2(const Message& m, std::uint64_t begin, std::uint64_t end,
                           InsReading* reading) noexcept {
  Mtdata2 d;
  if (decode_mtdata2(m.payload, &d) != PacketStatus::ok) {
    ++counters_.malformed;
    return false;
  }
  if (d.packet_counter) count_messages(*d.packet_counter);
  if (d.gnss_pvt) {
    ++counters_.fixes;
    receiver_ = receiver_of(*d.gnss_pvt, arrival_);
  }
  // A receiver's message has no sample of its own.
  if (!d.sample_time_fine ||
      !(d.quaternion || d.euler_deg || d.rotation_matrix || d.latitude_longitude_deg)) {
    const bool receivers = d.gnss_pvt || d.satellites;
    counters_.malformed += receivers || d.sample_time_fine ? 0U : 1U;
    counters_.incomplete += !receivers && d.sample_time_fine ? 1U : 0U;
    return false;
  }
  if (!step(sample_time_.next(*d.sample_time_fine,
                              last_sample_ != HostStamp{} ? arrival_ - last_sample_ : Duration{})))
    return false;
  InsReading r;
  fill(d, receiver_, arrival_, &r);
  if (!finish(sample_time_.stamp(), begin, end, &r)) return false;
  const bool lacks_place =
      r.sample.fix == FixStatus::none && (r.quality.status & kStatusGnssFix) != 0;
  if (lacks_place && arrival_ - last_place_ < kWithoutPlace) {
    ++counters_.incomplete;
    return false;
  }
  if (!lacks_place) last_place_ = arrival_;
  return hand_out(r, reading);
}

bool Decoder::take_mtdata(const Message& m, std::uint64_t begin, std::uint64_t end,
                          InsReading* reading) noexcept {
  Mtdata d;
  const MtdataStatus status = decode_mtdata(m.payload, set_.layout, &d);
  if (status != MtdataStatus::ok || !d.sample_counter) {
    ++counters_.malformed;
    if (status == MtdataStatus::length_wrong) ++counters_.layout_wrong;
    return false;
  }
  const double elapsed = last_sample_ != HostStamp{} ? (arrival_ - last_sample_).to_seconds() : 0;
  const std::int64_t before = sample_counter_.count();
  const ClockStep how =
      sample_counter_.next(*d.sample_counter, std::llround(elapsed * set_.rate_hz()));
  if (!step(how)) return false;
  if (how == ClockStep::forward)
    counters_.lost +=
        static_cast<std::uint64_t>(std::max<std::int64_t>(0, sample_counter_.count() - before - 1));
  if (d.fix) {
    // The block is repeated in every sample; its age drops when a new one has come.
    if (d.fix->age <= last_fix_age_ || !receiver_.known) {
      if (d.fix->age < last_fix_age_ || !receiver_.known) ++counters_.fixes;
      receiver_ = receiver_of(*d.fix, d.status.value_or(0), arrival_);
    }
    last_fix_age_ = d.fix->age;
  }
  InsReading r;
  fill(d, receiver_, arrival_, &r);
  if (!finish(DeviceStamp(set_.time_ns(sample_counter_.count())), begin, end, &r)) return false;
  return hand_out(r, reading);
}

/// Just after a start the map still improves: a reading that falls before one that went out already
/// would turn time back.
bool Decoder::hand_out(const InsReading& r, InsReading* reading) noexcept {
  if (counters_.readings > 0 && r.host <= last_host_) {
    ++counters_.unsettled;
    return false;
  }
  last_host_ = r.host;
  ++counters_.readings;
  *reading = r;
  reading->resumed = std::exchange(said_.resumed, false);
  return true;
}

/// False: the clocks are not tied yet.
bool Decoder::finish(DeviceStamp measured, std::uint64_t begin, std::uint64_t end,
                     InsReading* r) noexcept {
  timing_.message(begin, end, measured);
  last_sample_ = arrival_;
  if (!timing_.known()) {
    ++counters_.unsettled;
    return false;
  }
  if (any_) {
    const double periods = static_cast<double>((measured - last_).ns()) * 1e-9 * set_.rate_hz();
    number_ += static_cast<std::uint64_t>(std::max(1LL, std::llround(periods)));
  } else if (counters_.readings > 0) {
    ++number_;  // after a new begin: how many are missing nobody knows
  }
  any_ = true;
  last_ = measured;
  const MappedStamp at = timing_.at(measured);
  r->sample.number = number_;
  r->measured = measured;
  r->arrival = arrival_;
  r->mapped = true;
  r->host = at.host;
  r->host_error = at.error;
  return true;
}

}  // namespace vergence::xsens
