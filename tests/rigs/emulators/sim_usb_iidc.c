/* sim_usb_iidc: cameras with the IIDC register map behind USB vendor requests and one bulk
 * endpoint, as Point Grey built them and libdc1394 expects them (1e10:2005), at most four.
 *
 * Registers: control transfers 0xc0/0x40, request 0x7f for the 0xffff page, value and index = low
 * and high half of the lower 32 bits of the address, quadlets little endian. Image: bulk IN 0x81, a
 * short packet at the end of a frame only where its size asks for one. Options and commands are
 * those of sim_cameras.h, and "unplug C", "replug C". An incomplete frame ends in its middle.
 */
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/rigs/emulators/sim_cameras.h"
#include "tests/rigs/emulators/sim_clock.h"
#include "tests/rigs/emulators/usbip_device.h"

#define MOST 4

struct unit {
  struct usb_device usb;
  struct sim_camera c;
  char serial[16];
  bool unplugged, was_transmitting;
};

static struct unit units[MOST];
static unsigned count;

static const uint8_t device_descriptor[18] = {18,   1,    0x00, 0x02, 0, 0, 0, 64, 0x10,
                                              0x1e, 0x05, 0x20, 0,    0, 1, 2, 3,  1};
static const uint8_t high_speed[25] = {9, 2,    25,   0,    1, 1, 0, 0x80, 250, 9,    4,    0, 0,
                                       1, 0xff, 0xff, 0xff, 0, 7, 5, 0x81, 2,   0x00, 0x02, 0};

static int control(void* self, const struct usb_setup* s, uint8_t* data) {
  struct unit* u = self;
  uint64_t offset = 0xffff00000000ULL | (uint64_t)s->index << 16 | s->value;
  uint32_t v;

  if ((s->type & 0x60) != 0x40 || s->request != 0x7f || s->length % 4 || !s->length) return -1;
  for (unsigned i = 0; i < s->length; i += 4) {
    if (s->type & 0x80) {
      if (iidc_read(&u->c.camera, offset + i, &v)) return -1;
      for (unsigned b = 0; b < 4; b++) data[i + b] = (uint8_t)(v >> (8 * b));
    } else {
      v = (uint32_t)data[i] | (uint32_t)data[i + 1] << 8 | (uint32_t)data[i + 2] << 16 |
          (uint32_t)data[i + 3] << 24;
      if (iidc_write(&u->c.camera, offset + i, v)) return -1;
    }
  }
  return s->length;
}

static void deliver(struct unit* u);

static void expose(struct unit* u, uint64_t ns, uint64_t edge) {
  struct iidc_camera* c = &u->c.camera;
  uint64_t begin, shutter = (uint64_t)((double)c->shutter_abs * 1e9);

  while (iidc_next_frame(c, &u->c.sensor, ns, edge, &begin)) {
    edge = 0;
    u->c.exposed++;
    deliver(u);
    if (u->c.sent > 0 &&
        u->c.sent < u->c.bytes) { /* still on its way: the sensor's frame has nowhere to go */
      u->c.overtaken++;
      c->frames_made++;
      continue;
    }
    if (u->c.bytes && u->c.sent == 0) u->c.overtaken++; /* nobody fetched the last one */
    size_t packet = iidc_packet_bytes(c), image = iidc_frame_bytes(c);
    u->c.bytes =
        packet ? (image + packet - 1) / packet * packet : image; /* whole packets, as over a bus */
    u->c.image = realloc(u->c.image, u->c.bytes);
    memset(u->c.image + image, 0, u->c.bytes - image);
    iidc_draw(c, u->c.image, begin + shutter / 2,
              cycle_time(begin + shutter)); /* cameras stamp its end */
    u->c.sent = 0;
    u->c.tearing = false;
    if (u->c.drop) {
      u->c.drop--;
      u->c.dropped++;
      u->c.bytes = 0;
    } else if (u->c.tear) {
      u->c.tear--;
      u->c.tearing = true;
      u->c.bytes = u->c.bytes / 2 / 512 * 512 + 100; /* a short packet */
    }
    deliver(u);
  }
}

static void deliver(struct unit* u) {
  if (u->was_transmitting && !u->c.camera.transmitting) /* what was not fetched yet is lost */
    u->c.bytes = u->c.sent = 0;
  u->was_transmitting = u->c.camera.transmitting;
  while (u->c.sent < u->c.bytes && usb_in_room(&u->usb, 1) >= 0) {
    u->c.sent += usb_in(&u->usb, 1, u->c.image + u->c.sent, u->c.bytes - u->c.sent);
    if (u->c.sent == u->c.bytes) {
      u->c.transmitted += !u->c.tearing;
      u->c.incomplete += u->c.tearing;
      u->c.bytes = u->c.sent = 0;
      break;
    }
  }
}

static bool cable(const char* line) {
  unsigned a = 0;
  if (sscanf(line, "unplug %u", &a) == 1 && a < count) {
    usb_unplug(&units[a].usb);
    units[a].unplugged = true;
  } else if (sscanf(line, "replug %u", &a) == 1 && a < count && units[a].usb.fd < 0) {
    units[a].unplugged = false;
    units[a].c.bytes = units[a].c.sent = 0;
    iidc_init(&units[a].c.camera, a);
    usb_plug(&units[a].usb);
  } else {
    return false;
  }
  return true;
}

int main(int argc, char** argv) {
  struct sim_options o;
  struct sim_camera* cameras[MOST];

  if (sim_parse(argc, argv, MOST, &o)) return 2;
  count = o.cameras;
  for (unsigned i = 0; i < count; i++) {
    struct unit* u = &units[i];
    cameras[i] = &u->c;
    iidc_init(&u->c.camera, i);
    if (o.film && iidc_load_film(&u->c.camera, o.film, i, o.film_hz)) return 1;
    snprintf(u->serial, sizeof u->serial, "%u", 10240000 + i);
    u->usb =
        (struct usb_device){.device_descriptor = device_descriptor,
                            .config_descriptor = high_speed,
                            .strings = {NULL, "Vergence Rigs", "Emulated IIDC camera", u->serial},
                            .speed = USB_HIGH,
                            .self = u,
                            .control = control,
                            .fd = -1};
    if (usb_plug(&u->usb)) return 1;
  }
  sim_tell_ready(&o);

  for (;;) {
    struct pollfd fds[MOST + 1];
    uint64_t edge = 0;
    bool busy = false;

    for (unsigned i = 0; i < count; i++) {
      fds[i] = (struct pollfd){units[i].usb.fd, POLLIN, 0};
      busy |= cameras[i]->camera.transmitting;
    }
    fds[count] = (struct pollfd){sim_listening() ? 0 : -1, POLLIN, 0};
    poll(fds, count + 1, busy ? 1 : 20);
    if (fds[count].revents && !sim_obey(cameras, count, &edge, cable)) break;
    uint64_t ns = now_ns(), pulse = o.trigger_hz > 0 ? sim_pulse(&o, ns) : 0;
    if (pulse) edge = pulse;
    for (unsigned i = 0; i < count; i++) {
      if (units[i].unplugged) continue;
      usb_service(&units[i].usb);
      expose(&units[i], ns, edge);
      deliver(&units[i]);
    }
  }
  for (unsigned i = 0; i < count; i++) {
    usb_unplug(&units[i].usb);
    sim_report("sim_usb_iidc", i, cameras[i], "delivered");
  }
  return 0;
}
