// A separate file, because <asm/termbits.h>, which has the speeds outside the table, and
// <termios.h> exclude each other.
#include <asm/termbits.h>
#include <sys/ioctl.h>

#include "drivers/serial/detail/fd_line.hpp"

namespace vergence {

DeviceStatus set_raw_tty(int fd, const LineSettings& settings) noexcept {
  termios2 t{};
  if (::ioctl(fd, TCGETS2, &t) != 0) return DeviceStatus::disconnected;
  t.c_iflag = 0;
  t.c_oflag = 0;
  t.c_lflag = 0;
  t.c_cflag = CS8 | CREAD | CLOCAL | HUPCL | BOTHER | (settings.stop_bits == 2 ? CSTOPB : 0U);
  t.c_ispeed = t.c_ospeed = settings.baud;
  t.c_cc[VMIN] = 0;
  t.c_cc[VTIME] = 0;
  if (::ioctl(fd, TCSETS2, &t) != 0) return DeviceStatus::unsupported;
  termios2 set{};
  if (::ioctl(fd, TCGETS2, &set) != 0) return DeviceStatus::disconnected;
  // A converter rounds to its divisor; a byte of ten bits tolerates 3 %.
  const double error = static_cast<double>(set.c_ospeed) / static_cast<double>(settings.baud) - 1;
  return error < 0.03 && error > -0.03 ? DeviceStatus::ok : DeviceStatus::unsupported;
}

}  // namespace vergence
