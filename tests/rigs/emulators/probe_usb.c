/* probe_usb [FRAMES]: the emulated USB camera through libusb: descriptors, control transfers, bulk
 * transfers kept in flight, cancellation. Exits 0 if all frames came whole and in order. */
#include <libusb-1.0/libusb.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define FRAME (640u * 480u)
#define FLIGHT 4

static unsigned requested = 30, got, bad, cancelled;
static uint32_t last;

static uint32_t quadlet(const uint8_t* p) {
  return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

static uint32_t read_register(libusb_device_handle* h, uint32_t offset) {
  uint8_t b[4] = {0};
  uint32_t at = 0xf0f00000u + offset;
  int n = libusb_control_transfer(h, 0xc0, 0x7f, (uint16_t)at, (uint16_t)(at >> 16), b, 4, 1000);
  if (n != 4) {
    printf("register %x: %s\n", offset, libusb_error_name(n));
    bad++;
  }
  return quadlet(b);
}

static void write_register(libusb_device_handle* h, uint32_t offset, uint32_t v) {
  uint8_t b[4] = {(uint8_t)v, (uint8_t)(v >> 8), (uint8_t)(v >> 16), (uint8_t)(v >> 24)};
  uint32_t at = 0xf0f00000u + offset;
  if (libusb_control_transfer(h, 0x40, 0x7f, (uint16_t)at, (uint16_t)(at >> 16), b, 4, 1000) != 4)
    bad++;
}

static void done(struct libusb_transfer* t) {
  if (t->status == LIBUSB_TRANSFER_CANCELLED) {
    cancelled++;
    return;
  }
  if (t->status != LIBUSB_TRANSFER_COMPLETED || t->actual_length != (int)FRAME ||
      memcmp(t->buffer + 64, "VRGF", 4)) {
    printf("frame %u: status %d, %d bytes\n", got, t->status, t->actual_length);
    bad++;
  } else {
    uint32_t number = quadlet(t->buffer + 68);
    bad += got && number != last + 1;
    last = number;
  }
  if (++got < requested) libusb_submit_transfer(t);
}

int main(int argc, char** argv) {
  struct libusb_transfer* t[FLIGHT];
  libusb_device_handle* h;
  libusb_context* c;
  struct timespec a, b;
  unsigned char text[64] = "";

  requested = argc > 1 ? (unsigned)atoi(argv[1]) : requested;
  if (libusb_init(&c) || !(h = libusb_open_device_with_vid_pid(c, 0x1e10, 0x2005)))
    return printf("probe_usb: no camera\n"), 1;
  libusb_get_string_descriptor_ascii(h, 3, text, sizeof text);
  if (libusb_claim_interface(h, 0)) return printf("probe_usb: cannot claim\n"), 1;
  printf("camera serial %s, speed %d, formats %08x\n", text,
         libusb_get_device_speed(libusb_get_device(h)), read_register(h, 0x100));
  write_register(h, 0x608, 0);
  write_register(h, 0x604, 5u << 29);
  write_register(h, 0x600, 4u << 29);
  clock_gettime(CLOCK_MONOTONIC, &a);
  for (int i = 0; i < FLIGHT; i++) {
    t[i] = libusb_alloc_transfer(0);
    libusb_fill_bulk_transfer(t[i], h, 0x81, malloc(FRAME), FRAME, done, NULL, 0);
    libusb_submit_transfer(t[i]);
  }
  write_register(h, 0x614, 0x80000000u);
  while (got < requested) libusb_handle_events(c);
  clock_gettime(CLOCK_MONOTONIC, &b);
  write_register(h, 0x614, 0);
  for (int i = 0; i < FLIGHT; i++) libusb_submit_transfer(t[i]);
  for (int i = 0; i < FLIGHT; i++) libusb_cancel_transfer(t[i]);
  for (int i = 0; i < 100 && cancelled < FLIGHT; i++)
    libusb_handle_events_timeout(c, &(struct timeval){0, 100000});
  double s = (double)(b.tv_sec - a.tv_sec) + 1e-9 * (double)(b.tv_nsec - a.tv_nsec);
  printf("probe_usb: %u frames in %.2f s (%.1f Hz), bad %u, cancelled %u of %d\n", got, s, got / s,
         bad, cancelled, FLIGHT);
  libusb_close(h);
  libusb_exit(c);
  return bad || cancelled != FLIGHT;
}
