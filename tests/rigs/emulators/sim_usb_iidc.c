/* sim_usb_iidc: cameras with the IIDC register map behind USB vendor requests and one bulk
 * endpoint, as Point Grey built them and libdc1394 expects them (1e10:2005).
 *
 *   sim_usb_iidc [--cameras N] [--trigger-hz F] [--seconds S] [--ready FILE] [--film DIR]
 * [--film-hz F]
 *
 * Registers: control transfers 0xc0/0x40, request 0x7f for the 0xffff page, value and index = low
 * and high half of the lower 32 bits of the address, quadlets little endian. Image: bulk IN 0x81, a
 * short packet at the end of a frame only where its size asks for one. Commands on standard input
 * as in sim_1394 ("tear": the frame ends in its middle), and "unplug C", "replug C".
 */
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "tests/rigs/emulators/iidc_model.h"
#include "tests/rigs/emulators/sim_clock.h"
#include "tests/rigs/emulators/usbip_device.h"

#define MOST 4

struct unit {
  struct usb_device usb;
  struct iidc_camera camera;
  char serial[16];
  uint8_t* image;
  size_t bytes, sent;
  struct iidc_sensor sensor;
  unsigned drop, tear, miss;
  bool muted, gone, was_transmitting, tearing;
  uint64_t exposed, delivered, overtaken, dropped, torn;
};

static struct unit units[MOST];
static unsigned count = 2;
static volatile sig_atomic_t stop;

static const uint8_t device_descriptor[18] = {18,   1,    0x00, 0x02, 0, 0, 0, 64, 0x10,
                                              0x1e, 0x05, 0x20, 0,    0, 1, 2, 3,  1};
static const uint8_t high_speed[25] = {9, 2,    25,   0,    1, 1, 0, 0x80, 250, 9,    4,    0, 0,
                                       1, 0xff, 0xff, 0xff, 0, 7, 5, 0x81, 2,   0x00, 0x02, 0};

static void on_signal(int n) {
  (void)n;
  stop = 1;
}

static int control(void* self, const struct usb_setup* s, uint8_t* data) {
  struct unit* u = self;
  uint64_t offset = 0xffff00000000ULL | (uint64_t)s->index << 16 | s->value;
  uint32_t v;

  if ((s->type & 0x60) != 0x40 || s->request != 0x7f || s->length % 4 || !s->length) return -1;
  for (unsigned i = 0; i < s->length; i += 4) {
    if (s->type & 0x80) {
      if (iidc_read(&u->camera, offset + i, &v)) return -1;
      for (unsigned b = 0; b < 4; b++) data[i + b] = (uint8_t)(v >> (8 * b));
    } else {
      v = (uint32_t)data[i] | (uint32_t)data[i + 1] << 8 | (uint32_t)data[i + 2] << 16 |
          (uint32_t)data[i + 3] << 24;
      if (iidc_write(&u->camera, offset + i, v)) return -1;
    }
  }
  return s->length;
}

static void deliver(struct unit* u);

static void expose(struct unit* u, uint64_t ns, uint64_t edge) {
  struct iidc_camera* c = &u->camera;
  uint64_t begin, shutter = (uint64_t)((double)c->shutter_abs * 1e9);

  while (iidc_next_frame(c, &u->sensor, ns, edge, &begin)) {
    edge = 0;
    u->exposed++;
    deliver(u);
    if (u->sent > 0 &&
        u->sent < u->bytes) { /* still on its way: the sensor's frame has nowhere to go */
      u->overtaken++;
      c->frames_made++;
      continue;
    }
    if (u->bytes && u->sent == 0) u->overtaken++; /* nobody fetched the last one */
    size_t packet = iidc_packet_bytes(c), image = iidc_frame_bytes(c);
    u->bytes =
        packet ? (image + packet - 1) / packet * packet : image; /* whole packets, as over a bus */
    u->image = realloc(u->image, u->bytes);
    memset(u->image + image, 0, u->bytes - image);
    iidc_draw(c, u->image, begin + shutter / 2,
              cycle_time(begin + shutter)); /* cameras stamp its end */
    u->sent = 0;
    u->tearing = false;
    if (u->drop || u->muted) {
      u->drop -= u->drop > 0;
      u->dropped++;
      u->bytes = 0;
    } else if (u->tear) {
      u->tear--;
      u->tearing = true;
      u->bytes = u->bytes / 2 / 512 * 512 + 100; /* a short packet */
    }
    deliver(u);
  }
}

static void deliver(struct unit* u) {
  if (u->was_transmitting && !u->camera.transmitting) /* what was not fetched yet is lost */
    u->bytes = u->sent = 0;
  u->was_transmitting = u->camera.transmitting;
  while (u->sent < u->bytes && usb_in_room(&u->usb, 1) >= 0) {
    u->sent += usb_in(&u->usb, 1, u->image + u->sent, u->bytes - u->sent);
    if (u->sent == u->bytes) {
      u->delivered += !u->tearing;
      u->torn += u->tearing;
      u->bytes = u->sent = 0;
      break;
    }
  }
}

static void command(const char* line, uint64_t* edge) {
  unsigned a = 0, b = 0;
  unsigned long long at = 0;
  if (sscanf(line, "trigger %llu", &at) == 1) {
    *edge = at;
  } else if (!strncmp(line, "trigger", 7)) {
    *edge = now_ns();
  } else if (sscanf(line, "drop %u %u", &a, &b) == 2 && a < count) {
    units[a].drop = b;
  } else if (sscanf(line, "miss %u %u", &a, &b) == 2 && a < count) {
    units[a].miss = b;
  } else if (sscanf(line, "tear %u %u", &a, &b) == 2 && a < count) {
    units[a].tear = b;
  } else if (sscanf(line, "mute %u %u", &a, &b) == 2 && a < count) {
    units[a].muted = b;
  } else if (sscanf(line, "unplug %u", &a) == 1 && a < count) {
    usb_unplug(&units[a].usb);
    units[a].gone = true;
  } else if (sscanf(line, "replug %u", &a) == 1 && a < count && units[a].usb.fd < 0) {
    units[a].gone = false;
    units[a].bytes = units[a].sent = 0;
    struct iidc_camera fresh;
    iidc_init(&fresh, a);
    fresh.film = units[a].camera.film;
    fresh.film_bytes = units[a].camera.film_bytes;
    fresh.film_hz = units[a].camera.film_hz;
    units[a].camera = fresh;
    usb_plug(&units[a].usb);
  } else if (!strncmp(line, "quit", 4)) {
    stop = 1;
  } else {
    fprintf(stderr, "sim_usb_iidc: what is '%s'?\n", line);
  }
}

int main(int argc, char** argv) {
  double trigger_hz = 0, seconds = 0, film_hz = 10;
  const char *ready = NULL, *film = NULL;
  uint64_t start = now_ns(), last_pulse = 0;
  char line[128];
  size_t filled = 0;
  bool input = true;

  for (int i = 1; i < argc; i++) {
    const char* value = i + 1 < argc ? argv[i + 1] : "0";
    if (!strcmp(argv[i], "--cameras"))
      count = (unsigned)atoi(value), i++;
    else if (!strcmp(argv[i], "--trigger-hz"))
      trigger_hz = atof(value), i++;
    else if (!strcmp(argv[i], "--seconds"))
      seconds = atof(value), i++;
    else if (!strcmp(argv[i], "--film"))
      film = value, i++;
    else if (!strcmp(argv[i], "--film-hz"))
      film_hz = atof(value), i++;
    else if (!strcmp(argv[i], "--ready"))
      ready = value, i++;
    else
      return fprintf(stderr, "sim_usb_iidc: unknown option %s\n", argv[i]), 2;
  }
  if (count > MOST) return 2;
  signal(SIGTERM, on_signal);
  signal(SIGINT, on_signal);
  for (unsigned i = 0; i < count; i++) {
    struct unit* u = &units[i];
    iidc_init(&u->camera, i);
    if (film && iidc_load_film(&u->camera, film, i, film_hz)) return 1;
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
  if (ready) close(open(ready, O_CREAT | O_WRONLY, 0644));

  while (!stop) {
    struct pollfd fds[MOST + 1];
    uint64_t edge = 0;
    int timeout = 20;

    for (unsigned i = 0; i < count; i++) {
      fds[i] = (struct pollfd){units[i].usb.fd, POLLIN, 0};
      if (units[i].camera.transmitting || units[i].camera.one_shot || units[i].camera.multi_shot)
        timeout = 1;
    }
    fds[count] = (struct pollfd){input ? 0 : -1, POLLIN, 0};
    poll(fds, count + 1, timeout);
    if (fds[count].revents) {
      ssize_t got = read(0, line + filled, sizeof line - 1 - filled);
      if (got <= 0) {
        input = false;
      } else {
        char* end;
        filled += (size_t)got;
        line[filled] = 0;
        while ((end = strchr(line, '\n'))) {
          *end = 0;
          command(line, &edge);
          filled -= (size_t)(end + 1 - line);
          memmove(line, end + 1, filled + 1);
        }
        if (filled == sizeof line - 1) filled = 0;
      }
    }
    uint64_t ns = now_ns();
    if (trigger_hz > 0) {
      uint64_t pulse = (uint64_t)((double)ns * 1e-9 * trigger_hz);
      if (pulse != last_pulse) edge = (uint64_t)((double)pulse / trigger_hz * 1e9);
      last_pulse = pulse;
    }
    for (unsigned i = 0; i < count; i++) {
      if (units[i].gone) continue;
      usb_service(&units[i].usb);
      bool missed = edge && units[i].miss;
      units[i].miss -= missed;
      expose(&units[i], ns, missed ? 0 : edge);
      deliver(&units[i]);
    }
    if (seconds > 0 && (double)(ns - start) > seconds * 1e9) break;
  }
  for (unsigned i = 0; i < count; i++) {
    usb_unplug(&units[i].usb);
    if (units[i].exposed)
      printf(
          "sim_usb_iidc: camera %u exposed %llu delivered %llu torn %llu dropped %llu overtaken "
          "%llu\n",
          i, (unsigned long long)units[i].exposed, (unsigned long long)units[i].delivered,
          (unsigned long long)units[i].torn, (unsigned long long)units[i].dropped,
          (unsigned long long)units[i].overtaken);
  }
  return 0;
}
