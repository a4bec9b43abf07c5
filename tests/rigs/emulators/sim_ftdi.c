/* sim_ftdi: an FT232R on the virtual USB host, so that the kernel's ftdi_sio makes /dev/ttyUSB* of
 * it.
 *
 *   sim_ftdi --wire PATH [--serial TEXT] [--ready FILE]
 *
 * PATH becomes a link to a pseudo-terminal: the far end of the serial line, for a simulated
 * instrument to open. Bytes from there reach the host at the line rate the host has set (and those
 * of the host the far end), packed as the chip does it: at most 62 to a USB packet, a short packet
 * when the latency timer has run out. Commands on standard input: "unplug", "replug", "quit".
 */
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

#include "tests/rigs/emulators/sim_clock.h"
#include "tests/rigs/emulators/usbip_device.h"

#define FIFO 256u   /* the chip's receive buffer, towards the host */
#define PACKET 64u  /* two status bytes and 62 of data */
#define MODEM 0x31u /* CTS and DSR on, in the layout of the chip's first status byte */
#define LINE 0x60u  /* transmitter empty */
/* The chip reports its status each time that the latency timer runs out, a thousand times a second
 * at 1 ms. Where there is nothing but the status, here less often: a rig's kernel has better to do.
 */
#define IDLE_NS 20000000u

/* One direction of the line: a byte that waits is through when its ten bits have passed, never
 * sooner. */
struct way {
  uint8_t waiting[65536];
  size_t used;
  uint64_t free; /* when the bits of the last one are through */
};

static struct ftdi {
  struct usb_device usb;
  int wire;
  uint8_t fifo[FIFO];
  size_t used;
  struct way from_wire, to_wire;
  uint64_t oldest;   /* when the oldest byte of the buffer came */
  uint64_t reported; /* when the last packet went up */
  unsigned latency_ms;
  double baud;
  unsigned long up, down, overrun;
} ftdi;

static const uint8_t device_descriptor[18] = {18,   1,    0x00, 0x02, 0,    0, 0, 8, 0x03,
                                              0x04, 0x01, 0x60, 0x00, 0x06, 1, 2, 3, 1};
static const uint8_t config_descriptor[32] = {9,  2, 32, 0,    1,    1,    0, 0xa0, 45, 9,    4,
                                              0,  0, 2,  0xff, 0xff, 0xff, 2, 7,    5,  0x81, 2,
                                              64, 0, 0,  7,    5,    0x02, 2, 64,   0,  0};

/* Divisor of 3 MHz with eighths coded in three bits; 0 and 1 mean 3 and 2 Mbaud. */
static double baud_of(unsigned value, unsigned index) {
  static const double eighths[8] = {0, 0.5, 0.25, 0.125, 0.375, 0.625, 0.75, 0.875};
  unsigned whole = value & 0x3fff, code = value >> 14 | (index & 1) << 2;
  if (whole == 0 && code == 0) return 3e6;
  if (whole == 1 && code == 0) return 2e6;
  return 3e6 / (whole + eighths[code]);
}

static int control(void* self, const struct usb_setup* s, uint8_t* data) {
  (void)self;
  if ((s->type & 0x60) != 0x40) return -1;
  switch (s->request) {
    case 0: /* reset, or drop what is buffered */
      if (s->value <= 1) ftdi.used = 0;
      return 0;
    case 1: /* modem lines */
    case 2: /* flow control */
    case 4: /* data bits, parity, stop bits */
    case 6: /* event character */
    case 7: /* error character */
      return 0;
    case 3:
      ftdi.baud = baud_of(s->value, s->index);
      return 0;
    case 5:
      data[0] = MODEM;
      data[1] = LINE;
      return 2;
    case 9:
      ftdi.latency_ms = s->value & 0xff;
      return 0;
    case 10:
      data[0] = (uint8_t)ftdi.latency_ms;
      return 1;
    case 0x90: /* EEPROM: an erased one */
      data[0] = data[1] = 0xff;
      return 2;
    default:
      return -1;
  }
}

/* How many of what waits are through, at most `most`; they are taken off by pass(). */
static size_t through(const struct way* w, uint64_t ns, size_t most) {
  double byte_ns = 1e10 / ftdi.baud; /* start, eight, stop */
  size_t bytes = ns > w->free ? (size_t)((double)(ns - w->free) / byte_ns) : 0;
  if (bytes > w->used) bytes = w->used;
  return bytes > most ? most : bytes;
}

static void pass(struct way* w, size_t bytes) {
  w->used -= bytes;
  memmove(w->waiting, w->waiting + bytes, w->used);
  w->free += (uint64_t)((double)bytes * 1e10 / ftdi.baud);
}

/* A line that was idle begins with the first byte. */
static void begin(struct way* w, uint64_t ns) {
  if (!w->used && w->free < ns) w->free = ns;
}

static void give_to_wire(uint64_t ns) {
  struct way* w = &ftdi.to_wire;
  size_t bytes = through(w, ns, sizeof w->waiting);
  if (!bytes) return;
  ssize_t taken = write(ftdi.wire, w->waiting, bytes);
  if (taken < 0) { /* nobody reads at the far end: a serial line does not wait */
    ftdi.overrun += bytes;
    taken = (ssize_t)bytes;
  }
  pass(w, (size_t)taken);
}

static void from_host(void* self, unsigned endpoint, const uint8_t* data, size_t bytes) {
  struct way* w = &ftdi.to_wire;
  (void)self;
  (void)endpoint;
  ftdi.down += bytes;
  uint64_t ns = now_ns();
  give_to_wire(ns); /* what was there before has had its time, these bytes have not */
  begin(w, ns);
  if (bytes > sizeof w->waiting -
                  w->used) { /* the chip would make the host wait; nothing here sends that much */
    ftdi.overrun += bytes - (sizeof w->waiting - w->used);
    bytes = sizeof w->waiting - w->used;
  }
  memcpy(w->waiting + w->used, data, bytes);
  w->used += bytes;
}

static void take_from_wire(uint64_t ns) {
  struct way* w = &ftdi.from_wire;
  size_t bytes = through(w, ns, FIFO - ftdi.used);
  if (bytes) {
    if (!ftdi.used) ftdi.oldest = ns;
    memcpy(ftdi.fifo + ftdi.used, w->waiting, bytes);
    ftdi.used += bytes;
    pass(w, bytes);
  }
  /* after that, and from the time after the read: what is found now was not on the line while this
   * program was held up */
  if (w->used == sizeof w->waiting) return;
  ssize_t n = read(ftdi.wire, w->waiting + w->used, sizeof w->waiting - w->used);
  if (n <= 0) return;
  begin(w, now_ns());
  w->used += (size_t)n;
}

/* Whole packets go at once; a part of one, or the bare status, when the latency timer has run out.
 */
static void send_up(uint64_t ns) {
  uint64_t latency = (uint64_t)ftdi.latency_ms * 1000000;
  long room = usb_in_room(&ftdi.usb, 1);
  uint8_t transfer[4096];
  size_t at = 0;

  if (room < (long)PACKET) return;
  while (ftdi.used >= PACKET - 2 && at + PACKET <= (size_t)room && at + PACKET <= sizeof transfer) {
    transfer[at] = MODEM;
    transfer[at + 1] = LINE;
    memcpy(transfer + at + 2, ftdi.fifo, PACKET - 2);
    ftdi.used -= PACKET - 2;
    memmove(ftdi.fifo, ftdi.fifo + PACKET - 2, ftdi.used);
    ftdi.oldest = ns;
    at += PACKET;
    ftdi.up += PACKET - 2;
  }
  uint64_t silent = ns - ftdi.reported;
  bool expired = ftdi.used ? silent >= latency && ns - ftdi.oldest >= latency
                           : silent >= latency && silent >= IDLE_NS;
  if (expired && at + PACKET <= (size_t)room && at + PACKET <= sizeof transfer) {
    transfer[at] = MODEM;
    transfer[at + 1] = LINE;
    memcpy(transfer + at + 2, ftdi.fifo, ftdi.used);
    at += 2 + ftdi.used;
    ftdi.up += ftdi.used;
    ftdi.used = 0;
  } else if (at && at < (size_t)room && !expired) {
    /* only a short packet ends a transfer: a transfer of whole packets waits for one */
    transfer[at] = MODEM;
    transfer[at + 1] = LINE;
    at += 2;
  }
  if (at) {
    usb_in(&ftdi.usb, 1, transfer, at);
    ftdi.reported = ns;
  }
}

int main(int argc, char** argv) {
  const char *wire = NULL, *serial = "VG000001", *ready = NULL;
  char line[64];

  for (int i = 1; i + 1 < argc; i += 2) {
    if (!strcmp(argv[i], "--wire"))
      wire = argv[i + 1];
    else if (!strcmp(argv[i], "--serial"))
      serial = argv[i + 1];
    else if (!strcmp(argv[i], "--ready"))
      ready = argv[i + 1];
    else
      return fprintf(stderr, "sim_ftdi: unknown option %s\n", argv[i]), 2;
  }
  if (!wire) return fprintf(stderr, "sim_ftdi: --wire PATH is needed\n"), 2;
  ftdi.wire = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
  if (ftdi.wire < 0 || grantpt(ftdi.wire) || unlockpt(ftdi.wire)) return perror("sim_ftdi: pty"), 1;
  int keep = open(ptsname(ftdi.wire), O_RDWR | O_NOCTTY); /* so that it survives its users */
  struct termios raw;
  tcgetattr(keep, &raw);
  cfmakeraw(&raw);
  tcsetattr(keep, TCSANOW, &raw);
  unlink(wire);
  if (symlink(ptsname(ftdi.wire), wire)) return perror(wire), 1;
  ftdi.latency_ms = 16;
  ftdi.baud = 9600;
  ftdi.usb = (struct usb_device){.device_descriptor = device_descriptor,
                                 .config_descriptor = config_descriptor,
                                 .strings = {NULL, "FTDI", "FT232R USB UART", serial},
                                 .speed = USB_FULL,
                                 .control = control,
                                 .out = from_host,
                                 .fd = -1};
  if (usb_plug(&ftdi.usb)) return 1;
  if (ready) close(open(ready, O_CREAT | O_WRONLY, 0644));

  bool input = true;
  for (;;) {
    bool under_way = ftdi.used || ftdi.to_wire.used || ftdi.from_wire.used;
    bool full = ftdi.from_wire.used == sizeof ftdi.from_wire.waiting;
    struct pollfd fds[3] = {{ftdi.usb.fd, POLLIN, 0},
                            {input ? 0 : -1, POLLIN, 0},
                            {full || !ftdi.usb.configuration ? -1 : ftdi.wire, POLLIN, 0}};
    poll(fds, 3, under_way ? 1 : IDLE_NS / 1000000);
    if (fds[1].revents) {
      ssize_t got = read(0, line, sizeof line - 1);
      if (got <= 0) {
        input = false;
      } else {
        line[got] = 0;
        if (strstr(line, "unplug"))
          usb_unplug(&ftdi.usb);
        else if (strstr(line, "replug") && ftdi.usb.fd < 0)
          usb_plug(&ftdi.usb);
        else if (strstr(line, "quit"))
          break;
      }
    }
    uint64_t ns = now_ns();
    usb_service(&ftdi.usb);
    if (ftdi.usb.configuration && ftdi.usb.fd >= 0) {
      give_to_wire(ns);
      take_from_wire(ns);
      send_up(ns);
    }
  }
  usb_unplug(&ftdi.usb);
  unlink(wire);
  printf("sim_ftdi: %lu bytes to the host, %lu from it, %lu found no room\n", ftdi.up, ftdi.down,
         ftdi.overrun);
  return 0;
}
