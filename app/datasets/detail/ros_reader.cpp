#include "app/datasets/detail/ros_reader.hpp"

namespace vergence::app::detail {

RosReader::RosReader(std::span<const std::uint8_t> bytes, MessageEncoding encoding) noexcept
    : bytes_(bytes), cdr_(encoding == MessageEncoding::cdr) {
  ok_ = encoding != MessageEncoding::other;
  if (!cdr_) return;
  begin_ = at_ = 4;
  ok_ = bytes.size() >= 4 && bytes[0] == 0 && bytes[1] <= 1;
  little_ = ok_ && bytes[1] == 1;
}

std::string RosReader::text() {
  // In CDR the length includes the final 0.
  const auto length = get<std::uint32_t>();
  if (!ok_ || length > bytes_.size() - at_) {
    ok_ = false;
    return "";
  }
  const auto* begin = reinterpret_cast<const char*>(bytes_.data() + at_);
  at_ += length;
  return length == 0 ? "" : std::string(begin, cdr_ ? length - 1 : length);
}

Stamp RosReader::header() {
  // ROS 1 headers begin with the publisher's sequence number.
  if (!cdr_) (void)get<std::uint32_t>();
  // Seconds are signed in ROS 2 and unsigned in ROS 1.
  const auto seconds = get<std::uint32_t>();
  const auto ns = get<std::uint32_t>();
  (void)text();
  return Stamp((cdr_ ? std::int64_t{static_cast<std::int32_t>(seconds)} : std::int64_t{seconds}) *
                   1'000'000'000 +
               ns);
}

}  // namespace vergence::app::detail
