#include "drivers/xsens/arrival_timing.hpp"

#include <algorithm>
#include <cmath>

namespace vergence::xsens {
namespace {

ClockMapperOptions mapper_options() noexcept {
  ClockMapperOptions o;
  o.delay_spread =
      Duration::milliseconds(5);  // of a read behind its last byte: a USB frame and the scheduler
  o.resolution = Duration::microseconds(100);  // SampleTimeFine's tick
  o.jump = Duration::milliseconds(20);
  o.stall = Duration::seconds(1);
  return o;
}

}  // namespace

ArrivalTiming::ArrivalTiming(std::uint32_t baud, Duration processing) noexcept
    : mapper_(mapper_options()), processing_(processing), byte_ns_(1e10 / std::max(1U, baud)) {}

void ArrivalTiming::restart() noexcept {
  mapper_.restart();
  count_ = 0;
  known_ = false;
  line_known_ = false;
}

Duration ArrivalTiming::wire_time(std::uint64_t bytes) const noexcept {
  return Duration::nanoseconds(std::llround(static_cast<double>(bytes) * byte_ns_));
}

void ArrivalTiming::read(std::uint64_t end, HostStamp arrival) noexcept {
  if (count_ == marks_.size()) {
    std::move(marks_.begin() + 1, marks_.end(), marks_.begin());
    --count_;
  }
  marks_[count_++] = {end, arrival};
}

void ArrivalTiming::drop_marks(std::uint64_t end) noexcept {
  std::size_t n = 0;
  while (n < count_ && marks_[n].end <= end) ++n;
  std::move(marks_.begin() + static_cast<std::ptrdiff_t>(n),
            marks_.begin() + static_cast<std::ptrdiff_t>(count_), marks_.begin());
  count_ -= n;
}

void ArrivalTiming::other(std::uint64_t end) noexcept {
  if (end <= end_) return;
  line_free_ = line_free_ + wire_time(end - end_);
  end_ = end;
  drop_marks(end);
}

void ArrivalTiming::message(std::uint64_t begin, std::uint64_t end, DeviceStamp measured) noexcept {
  other(begin);
  DeviceStamp sent = measured + processing_;
  if (line_known_) sent = std::max(sent, line_free_);
  for (std::size_t i = 0; i < count_ && marks_[i].end <= end; ++i) {
    witness_ = sent + wire_time(marks_[i].end - begin);
    mapped_ = mapper_.map(witness_, marks_[i].arrival);
    known_ = true;
  }
  line_free_ = sent + wire_time(end - begin);
  line_known_ = true;
  end_ = end;
  drop_marks(end);
}

MappedStamp ArrivalTiming::at(DeviceStamp measured) const noexcept {
  const Duration since = measured - witness_;
  const double stretch = static_cast<double>(since.ns()) * mapper_.drift();
  return {mapped_.host + since + Duration::nanoseconds(std::llround(stretch)), mapped_.error};
}

}  // namespace vergence::xsens
