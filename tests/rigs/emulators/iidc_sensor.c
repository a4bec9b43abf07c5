/* The sensor of the model: when a frame is exposed, and what is in it. */
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/rigs/emulators/iidc_model_internal.h"

static bool may_send(const struct iidc_camera* c) {
  return c->powered && c->transmitting && !(c->format == 7 && iidc_f7_errors(c));
}

static uint64_t exposure_time_ns(const struct iidc_camera* c) {
  return (uint64_t)((double)c->shutter_abs * 1e9);
}

bool iidc_next_frame(struct iidc_camera* c, struct iidc_sensor* s, uint64_t ns, uint64_t edge,
                     uint64_t* begin) {
  uint64_t shutter = exposure_time_ns(c);

  if (c->trigger & bit(6)) {
    bool software = (c->trigger >> 21 & 7) == 7;
    if (software && c->software_triggers)
      edge = ns;
    else if (software)
      edge = 0;
    c->software_triggers = 0;
    if (edge && !s->exposing) s->exposing = edge;
    if (s->exposing && ns >= s->exposing + shutter) {
      *begin = s->exposing;
      s->exposing = 0;
      return may_send(c);
    }
    return false;
  }
  double rate = iidc_rate(c);
  uint64_t tick = ns > shutter ? (uint64_t)((double)(ns - shutter) * 1e-9 * rate) : 0;
  if (tick < s->tick || tick > s->tick + 8) /* another rate, or this program was held up for long */
    s->tick = tick;
  while (s->tick < tick) {
    *begin = (uint64_t)((double)++s->tick / rate * 1e9);
    if (may_send(c)) return true;
  }
  return false;
}

static void put(uint8_t* to, uint64_t v, int bytes) {
  for (int i = 0; i < bytes; i++) to[i] = (uint8_t)(v >> (8 * i));
}

int iidc_load_film(struct iidc_camera* c, const char* dir, unsigned index, double hz) {
  char path[512];
  struct stat about;
  snprintf(path, sizeof path, "%s/camera%u.raw", dir, index);
  int fd = open(path, O_RDONLY | O_CLOEXEC);
  if (fd < 0 || fstat(fd, &about) || about.st_size == 0 || !(hz > 0)) {
    fprintf(stderr, "iidc: no film in %s\n", path);
    if (fd >= 0) close(fd);
    return -1;
  }
  void* at = mmap(NULL, (size_t)about.st_size, PROT_READ, MAP_PRIVATE, fd, 0);
  close(fd);
  if (at == MAP_FAILED) return perror(path), -1;
  c->film = at;
  c->film_bytes = (size_t)about.st_size;
  c->film_hz = hz;
  return 0;
}

/* The film's image for an exposure that began then; NULL: no film for this mode. */
static const uint8_t* film_image(const struct iidc_camera* c, uint64_t begin_ns) {
  static uint64_t first; /* of all cameras */
  static bool any;
  size_t bytes = iidc_frame_bytes(c);
  if (!c->film || iidc_bits(c) != 8 || c->film_bytes < bytes || c->film_bytes % bytes) return NULL;
  uint64_t n = (uint64_t)((double)begin_ns * 1e-9 * c->film_hz + 0.5),
           last = c->film_bytes / bytes - 1;
  if (!any) first = n;
  any = true;
  n = n > first ? n - first : 0;
  return c->film + bytes * (n < last ? n : last);
}

void iidc_draw(struct iidc_camera* c, uint8_t* image, uint64_t exposure_ns, uint32_t cycle_time) {
  unsigned stride = iidc_width(c) * iidc_bits(c) / 8, height = iidc_height(c), at = 0;
  uint32_t n = c->frames_made++;

  const uint8_t* seen = film_image(c, exposure_ns - exposure_time_ns(c) / 2);
  if (seen) memcpy(image, seen, iidc_frame_bytes(c));
  for (unsigned y = 0; y < height && !seen;
       y++) /* vertical bands in rows that move on by one grey level a frame */
    memset(image + (size_t)y * stride, (int)((y + n) & 0xff), stride);
  if (stride >= IIDC_STAMP_OFFSET + 24) {
    memcpy(image + IIDC_STAMP_OFFSET, "VRGF", 4);
    put(image + IIDC_STAMP_OFFSET + 4, n, 4);
    put(image + IIDC_STAMP_OFFSET + 8, exposure_ns, 8);
    put(image + IIDC_STAMP_OFFSET + 16, c->guid, 8);
  }
  /* embedded information: one big-endian quadlet for each bit set, from the least significant bit
   * on */
  for (unsigned b = 0; b < 10; b++) {
    if (!(c->frame_info >> b & 1) || at + 4 > iidc_frame_bytes(c)) continue;
    uint32_t v = b == 0 ? cycle_time : b == 6 ? n : 0;
    for (int i = 0; i < 4; i++) image[at + (unsigned)i] = (uint8_t)(v >> (24 - 8 * i));
    at += 4;
  }
}
