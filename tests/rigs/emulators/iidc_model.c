#include "tests/rigs/emulators/iidc_model.h"

#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#define CSR 0xfffff0000000ULL
#define ROM_OFFSET 0x400u
#define COMMAND 0xf00000u /* offset of the command registers from CSR */
#define F7_BASE 0xf08000u
#define ABS_BASE 0xf09000u
#define STROBE_BASE 0xf0a000u

enum { RCODE_OK = 0, RCODE_TYPE = 6, RCODE_ADDRESS = 7 };

/* IIDC numbers bits from the most significant one. */
static uint32_t bit(unsigned n) { return 0x80000000u >> n; }

static uint32_t float_bits(float f) {
  uint32_t u;
  memcpy(&u, &f, 4);
  return u;
}

static float bits_float(uint32_t u) {
  float f;
  memcpy(&f, &u, 4);
  return f;
}

/* ---- configuration ROM, IEEE 1212 ---- */

static uint32_t crc16(const uint32_t* quadlet, int count) {
  uint32_t crc = 0;
  for (int i = 0; i < count; i++) {
    for (int shift = 28; shift >= 0; shift -= 4) {
      uint32_t sum = ((crc >> 12) ^ (quadlet[i] >> shift)) & 0xf;
      crc = ((crc << 4) ^ (sum << 12) ^ (sum << 5) ^ sum) & 0xffff;
    }
  }
  return crc;
}

static void close_block(uint32_t* rom, int at, int count) {
  rom[at] = (uint32_t)count << 16 | crc16(rom + at + 1, count);
}

static int text_leaf(uint32_t* rom, int at, const char* text) {
  int quads = ((int)strlen(text) + 4) / 4;
  rom[at + 1] = 0;
  rom[at + 2] = 0;
  for (int i = 0; i < quads; i++) {
    char q[4] = {0};
    size_t left = strlen(text) > (size_t)i * 4 ? strlen(text) - (size_t)i * 4 : 0;
    memcpy(q, text + i * 4, left < 4 ? left : 4);
    rom[at + 3 + i] = (uint32_t)(uint8_t)q[0] << 24 | (uint32_t)(uint8_t)q[1] << 16 |
                      (uint32_t)(uint8_t)q[2] << 8 | (uint8_t)q[3];
  }
  close_block(rom, at, quads + 2);
  return at + quads + 3;
}

static void make_rom(struct iidc_camera* c) {
  uint32_t *rom = c->rom, vendor = (uint32_t)(c->guid >> 40);
  const int root = 5, unit = 10, dependent = 15, leaves = 20;
  int next;

  memset(rom, 0, sizeof c->rom);
  rom[1] = 0x31333934; /* "1394" */
  /* not isochronous-resource or bus manager; isochronous capable; max_rec 10 (2 KiB); link speed */
  rom[2] = 1u << 29 | 10u << 12 | (c->beta ? 3u : 2u);
  rom[3] = (uint32_t)(c->guid >> 32);
  rom[4] = (uint32_t)c->guid;
  rom[root + 1] = 0x03u << 24 | vendor;
  rom[root + 2] = 0x0cu << 24 | 0x0083c0;
  rom[root + 3] = 0xd1u << 24 | (uint32_t)(unit - (root + 3));
  close_block(rom, root, 3);
  rom[unit + 1] = 0x12u << 24 | 0x00a02d; /* 1394 TA */
  rom[unit + 2] = 0x13u << 24 | 0x000102; /* IIDC 1.30 and later */
  rom[unit + 3] = 0xd4u << 24 | (uint32_t)(dependent - (unit + 3));
  close_block(rom, unit, 3);
  rom[dependent + 1] = 0x40u << 24 | COMMAND / 4;
  rom[dependent + 4] = 0x38u << 24 | 0x30; /* IIDC 1.31 */
  next = text_leaf(rom, leaves, c->vendor);
  rom[dependent + 2] = 0x81u << 24 | (uint32_t)(leaves - (dependent + 2));
  rom[dependent + 3] = 0x82u << 24 | (uint32_t)(next - (dependent + 3));
  c->rom_length = text_leaf(rom, next, c->model);
  close_block(rom, dependent, 4);
  rom[0] = 4u << 24 | (uint32_t)(c->rom_length - 1) << 16;
  rom[0] |= crc16(rom + 1, c->rom_length - 1);
}

/* ---- modes ---- */

/* Format 0 and 1: only the monochrome modes and YUV 4:2:2, which is what a rig uses. */
static const struct fixed_mode {
  unsigned format, mode, width, height, bits;
} modes[] = {
    {0, 1, 320, 240, 16}, {0, 3, 640, 480, 16}, {0, 5, 640, 480, 8},  {0, 6, 640, 480, 16},
    {1, 2, 800, 600, 8},  {1, 5, 1024, 768, 8}, {2, 2, 1280, 960, 8},
};

static const struct fixed_mode* fixed(unsigned format, unsigned mode) {
  for (size_t i = 0; i < sizeof modes / sizeof *modes; i++)
    if (modes[i].format == format && modes[i].mode == mode) return &modes[i];
  return NULL;
}

static const struct fixed_mode* current(const struct iidc_camera* c) {
  const struct fixed_mode* m = fixed(c->format, c->mode);
  return m ? m : &modes[2];
}

unsigned iidc_width(const struct iidc_camera* c) {
  unsigned w = c->f7_size >> 16;
  return c->format != 7 ? current(c)->width : w < IIDC_MAX_WIDTH ? w : IIDC_MAX_WIDTH;
}

unsigned iidc_height(const struct iidc_camera* c) {
  unsigned h = c->f7_size & 0xffff;
  return c->format != 7 ? current(c)->height : h < IIDC_MAX_HEIGHT ? h : IIDC_MAX_HEIGHT;
}

unsigned iidc_bits(const struct iidc_camera* c) {
  return c->format == 7 ? (c->f7_coding == 5 || c->f7_coding == 10 ? 16 : 8) : current(c)->bits;
}

size_t iidc_frame_bytes(const struct iidc_camera* c) {
  return (size_t)iidc_width(c) * iidc_height(c) * iidc_bits(c) / 8;
}

static double nominal_rate(unsigned code) { return 1.875 * (double)(1u << code); }

/* One packet every 125 us: the packet size of the fixed modes follows from the rate. */
unsigned iidc_packet_bytes(const struct iidc_camera* c) {
  if (c->format == 7) return c->f7_packet;
  /* 240 packets at 30 Hz, 256 for 768 lines: whole parts of lines travel together */
  return (unsigned)((double)iidc_frame_bytes(c) * nominal_rate(c->rate) /
                    (iidc_height(c) == 768 ? 7680.0 : 7200.0));
}

double iidc_rate(const struct iidc_camera* c) {
  if (c->format != 7) return nominal_rate(c->rate);
  size_t bytes = iidc_frame_bytes(c), packet = c->f7_packet ? c->f7_packet : 4;
  double bus = 8000.0 / (double)((bytes + packet - 1) / packet + 1),
         requested = (double)c->frame_rate_abs;
  return requested < bus ? requested : bus;
}

static uint32_t rates_of(bool beta, unsigned format, unsigned mode) {
  uint32_t inq = 0;
  const struct fixed_mode* m = fixed(format, mode);
  if (!m) return 0;
  for (unsigned r = 2; r <= 5; r++)
    if ((double)m->width * m->height * m->bits / 8 * nominal_rate(r) / 7200 <= (beta ? 8192 : 4096))
      inq |= bit(r);
  return inq;
}

void iidc_init(struct iidc_camera* c, unsigned index) {
  memset(c, 0, sizeof *c);
  c->guid = 0x0205a9000000c000ULL + index; /* a locally administered vendor number */
  snprintf(c->vendor, sizeof c->vendor, "Vergence Rigs");
  snprintf(c->model, sizeof c->model, "Emulated IIDC %u", index);
  c->mode = 5;
  c->rate = 4;
  c->iso_speed = 2;
  c->powered = true;
  c->trigger = 0;
  c->shutter = 100;
  c->gain = 50;
  c->brightness = 10;
  c->frame_rate = 480;
  c->shutter_abs = 0.005f;
  c->gain_abs = 0.0f;
  c->frame_rate_abs = 30.0f;
  c->f7_size = 640u << 16 | 480u;
  c->f7_packet = 1280;
  make_rom(c);
}

void iidc_init_beta(struct iidc_camera* c) {
  c->beta = true;
  make_rom(c);
}

/* ---- registers ---- */

#define FEATURE_BRIGHTNESS 0
#define FEATURE_SHUTTER 7
#define FEATURE_GAIN 8
#define FEATURE_TRIGGER 12
#define FEATURE_TRIGGER_DELAY 13
#define FEATURE_FRAME_RATE 15

static const uint32_t feature_mask = 0x80000000u | 0x80000000u >> 7 | 0x80000000u >> 8 |
                                     0x80000000u >> 12 | 0x80000000u >> 13 | 0x80000000u >> 15;

static uint32_t feature_inquiry(unsigned f) {
  switch (f) {
    case FEATURE_BRIGHTNESS:
      return bit(0) | bit(4) | bit(7) | 0u << 12 | 255u;
    case FEATURE_SHUTTER:
      return bit(0) | bit(1) | bit(4) | bit(6) | bit(7) | 1u << 12 | 4095u;
    case FEATURE_GAIN:
      return bit(0) | bit(1) | bit(4) | bit(6) | bit(7) | 0u << 12 | 680u;
    case FEATURE_TRIGGER: /* two sources and the software trigger; modes 0, 14, 15 */
      return bit(0) | bit(4) | bit(5) | bit(6) | bit(7) | bit(8) | bit(9) | bit(15) | bit(16) |
             bit(30) | bit(31);
    case FEATURE_TRIGGER_DELAY:
      return bit(0) | bit(4) | bit(5) | bit(7) | 0u << 12 | 4095u;
    case FEATURE_FRAME_RATE:
      return bit(0) | bit(1) | bit(4) | bit(5) | bit(7) | 1u << 12 | 4095u;
    default:
      return 0;
  }
}

static float* absolute(struct iidc_camera* c, unsigned f, float* low, float* high) {
  switch (f) {
    case FEATURE_SHUTTER:
      *low = 1e-5f;
      *high = 0.1f;
      return &c->shutter_abs;
    case FEATURE_GAIN:
      *low = 0.0f;
      *high = 24.0f;
      return &c->gain_abs;
    case FEATURE_FRAME_RATE:
      *low = 1.0f;
      *high = 60.0f;
      return &c->frame_rate_abs;
    default:
      return NULL;
  }
}

static uint32_t* feature_value(struct iidc_camera* c, unsigned f) {
  switch (f) {
    case FEATURE_BRIGHTNESS:
      return &c->brightness;
    case FEATURE_SHUTTER:
      return &c->shutter;
    case FEATURE_GAIN:
      return &c->gain;
    case FEATURE_TRIGGER:
      return &c->trigger;
    case FEATURE_TRIGGER_DELAY:
      return &c->trigger_delay;
    case FEATURE_FRAME_RATE:
      return &c->frame_rate;
    default:
      return NULL;
  }
}

static int read_command(struct iidc_camera* c, uint32_t at, uint32_t* v) {
  *v = 0;
  if (at >= 0x180 && at < 0x1a0) { /* modes of a format */
    unsigned format = (at - 0x180) / 4;
    for (size_t i = 0; i < sizeof modes / sizeof *modes; i++)
      if (modes[i].format == format) *v |= bit(modes[i].mode);
    if (format == 7) *v = bit(0);
    return RCODE_OK;
  }
  if (at >= 0x200 && at < 0x2e0) {
    *v = rates_of(c->beta, (at - 0x200) / 32, (at - 0x200) % 32 / 4);
    return RCODE_OK;
  }
  if (at >= 0x500 && at < 0x580) {
    *v = feature_inquiry((at - 0x500) / 4);
    return RCODE_OK;
  }
  if (at >= 0x700 && at < 0x780) {
    float low, high;
    unsigned f = (at - 0x700) / 4;
    *v = absolute(c, f, &low, &high) ? (ABS_BASE + 16 * f) / 4 : 0;
    return RCODE_OK;
  }
  if (at >= 0x800 && at < 0x880) {
    uint32_t* value = feature_value(c, (at - 0x800) / 4);
    *v = value ? bit(0) | *value : 0;
    return RCODE_OK;
  }
  switch (at) {
    case 0x100:
      *v = bit(0) | bit(1) | bit(2) | bit(7);
      break;
    case 0x2e0:
      *v = F7_BASE / 4;
      break;
    case 0x400:
      *v = bit(0) | bit(1) | bit(3) | bit(16) | bit(19) | bit(20) | (c->beta ? bit(8) : 0);
      break;
    case 0x404:
      *v = feature_mask;
      break;
    case 0x40c:
      *v = bit(3); /* strobe outputs */
      break;
    case 0x480:
      *v = (COMMAND + 0x1000) / 4;
      break;
    case 0x48c:
      *v = STROBE_BASE / 4;
      break;
    case 0x600:
      *v = c->rate << 29;
      break;
    case 0x604:
      *v = c->mode << 29;
      break;
    case 0x608:
      *v = c->format << 29;
      break;
    case 0x60c:
      *v = c->iso_speed > 2 ? bit(16) | (c->channel & 63) << 8 | c->iso_speed
                            : (c->channel & 15) << 28 | (c->iso_speed & 3) << 24;
      break;
    case 0x610:
      *v = c->powered ? bit(0) : 0;
      break;
    case 0x614:
      *v = c->transmitting ? bit(0) : 0;
      break;
    case 0x61c:
      *v = (c->one_shot ? bit(0) : 0) | (c->multi_shot ? bit(1) | c->multi_shot : 0);
      break;
    case 0x62c:
      *v = c->software_triggers ? bit(0) : 0;
      break;
    case 0x12f8:
      *v = bit(0) | c->frame_info;
      break;
    default: /* reserved registers read as zero */
      break;
  }
  return at < 0x2000 ? RCODE_OK : RCODE_ADDRESS;
}

static int write_command(struct iidc_camera* c, uint32_t at, uint32_t v) {
  if (at >= 0x800 && at < 0x880) {
    uint32_t* value = feature_value(c, (at - 0x800) / 4);
    if (value) *value = v & ~bit(0);
    return RCODE_OK;
  }
  switch (at) {
    case 0x000:
      if (v & bit(0)) {
        struct iidc_camera fresh;
        iidc_init(&fresh, (unsigned)(c->guid & 0xff));
        fresh.beta = c->beta;
        fresh.guid = c->guid;
        memcpy(fresh.rom, c->rom, sizeof c->rom);
        fresh.film = c->film;
        fresh.film_bytes = c->film_bytes;
        fresh.film_hz = c->film_hz;
        *c = fresh;
      }
      break;
    case 0x600:
      c->rate = v >> 29;
      break;
    case 0x604:
      c->mode = v >> 29;
      break;
    case 0x608:
      c->format = v >> 29;
      break;
    case 0x60c:
      c->channel = v & bit(16) ? v >> 8 & 63 : v >> 28;
      c->iso_speed = v & bit(16) ? v & 7 : v >> 24 & 3;
      break;
    case 0x610:
      c->powered = v & bit(0);
      break;
    case 0x614:
      c->transmitting = v & bit(0);
      break;
    case 0x61c:
      c->one_shot = v & bit(0);
      c->multi_shot = v & bit(1) ? v & 0xffff : 0;
      break;
    case 0x62c:
      if (v & bit(0)) c->software_triggers = 1;
      break;
    case 0x12f8:
      c->frame_info = v & 0x3ff;
      break;
    default:
      break;
  }
  return at < 0x2000 ? RCODE_OK : RCODE_ADDRESS;
}

static unsigned f7_packets(const struct iidc_camera* c) {
  return c->f7_packet ? (unsigned)((iidc_frame_bytes(c) + c->f7_packet - 1) / c->f7_packet) : 0;
}

/* ErrorFlag_1: the region leaves the sensor; ErrorFlag_2: no such packet size. */
static uint32_t f7_errors(const struct iidc_camera* c) {
  unsigned width = c->f7_size >> 16, height = c->f7_size & 0xffff, most = c->beta ? 8192u : 4096u;
  uint32_t errors = 0;
  if ((c->f7_position >> 16) + width > IIDC_MAX_WIDTH ||
      (c->f7_position & 0xffff) + height > IIDC_MAX_HEIGHT || !width || !height)
    errors |= bit(8);
  if (c->f7_packet == 0 || c->f7_packet > most || c->f7_packet % 4) errors |= bit(9);
  return errors;
}

static int read_f7(struct iidc_camera* c, uint32_t at, uint32_t* v) {
  *v = 0;
  switch (at) {
    case 0x00:
      *v = IIDC_MAX_WIDTH << 16 | IIDC_MAX_HEIGHT;
      break;
    case 0x04:
      *v = 8u << 16 | 2u;
      break;
    case 0x08:
      *v = c->f7_position;
      break;
    case 0x0c:
      *v = c->f7_size;
      break;
    case 0x10:
      *v = c->f7_coding << 24;
      break;
    case 0x14:
      *v = bit(0) | bit(5) | bit(9); /* Mono8, Mono16, Raw8 */
      break;
    case 0x34:
      *v = iidc_width(c) * iidc_height(c);
      break;
    case 0x3c:
      *v = f7_packets(c) * c->f7_packet;
      break;
    case 0x40:
      *v = 4u << 16 | (c->beta ? 8192u : 4096u);
      break;
    case 0x44: {
      unsigned advice = (unsigned)((double)iidc_frame_bytes(c) * 30 / 8000 + 3) & ~3u,
               most = c->beta ? 8192u : 4096u;
      *v = c->f7_packet << 16 | (advice > most ? most : advice);
      break;
    }
    case 0x48:
      *v = f7_packets(c);
      break;
    case 0x4c:
      *v = 2u << 16 | 2u;
      break;
    case 0x50:
      *v = float_bits((float)(1.0 / iidc_rate(c)));
      break;
    case 0x54:
      *v = (c->f7_coding == 5 ? 16u : 8u) << 24;
      break;
    case 0x7c: /* the values are taken over at once */
      *v = bit(0) | f7_errors(c);
      break;
    default:
      break;
  }
  return RCODE_OK;
}

static int write_f7(struct iidc_camera* c, uint32_t at, uint32_t v) {
  switch (at) {
    case 0x08:
      c->f7_position = v;
      break;
    case 0x0c:
      c->f7_size = v;
      break;
    case 0x10:
      c->f7_coding = v >> 24;
      break;
    case 0x44:
      c->f7_packet = v >> 16;
      break;
    default:
      break;
  }
  return RCODE_OK;
}

int iidc_read(struct iidc_camera* c, uint64_t offset, uint32_t* value) {
  uint64_t at = offset - CSR;
  if (offset < CSR || offset & 3) return RCODE_ADDRESS;
  if (at >= ROM_OFFSET && at < ROM_OFFSET + 4u * (unsigned)c->rom_length) {
    *value = c->rom[(at - ROM_OFFSET) / 4];
    return RCODE_OK;
  }
  if (at >= COMMAND && at < COMMAND + 0x2000) return read_command(c, (uint32_t)at - COMMAND, value);
  if (at >= F7_BASE && at < F7_BASE + 0x100) return read_f7(c, (uint32_t)at - F7_BASE, value);
  if (at >= ABS_BASE && at < ABS_BASE + 0x200) {
    float low, high, *f = absolute(c, ((unsigned)at - ABS_BASE) / 16, &low, &high);
    unsigned field = (unsigned)at / 4 % 4;
    *value = !f           ? 0
             : field == 0 ? float_bits(low)
             : field == 1 ? float_bits(high)
             : field == 2 ? float_bits(*f)
                          : 0;
    return RCODE_OK;
  }
  if (at >= STROBE_BASE && at < STROBE_BASE + 0x300) {
    unsigned r = (unsigned)at - STROBE_BASE;
    *value = r == 0                    ? 0xf0000000u
             : r >= 0x100 && r < 0x110 ? bit(0) | bit(4) | bit(5) | bit(6) | 4095u
             : r >= 0x200 && r < 0x210 ? bit(0) | c->strobe[(r - 0x200) / 4]
                                       : 0;
    return RCODE_OK;
  }
  return RCODE_ADDRESS;
}

int iidc_write(struct iidc_camera* c, uint64_t offset, uint32_t value) {
  uint64_t at = offset - CSR;
  if (offset < CSR || offset & 3) return RCODE_ADDRESS;
  if (at >= ROM_OFFSET && at < ROM_OFFSET + 4u * (unsigned)c->rom_length) return RCODE_TYPE;
  if (at >= COMMAND && at < COMMAND + 0x2000)
    return write_command(c, (uint32_t)at - COMMAND, value);
  if (at >= F7_BASE && at < F7_BASE + 0x100) return write_f7(c, (uint32_t)at - F7_BASE, value);
  if (at >= ABS_BASE && at < ABS_BASE + 0x200) {
    float low, high, requested = bits_float(value),
                     *f = absolute(c, ((unsigned)at - ABS_BASE) / 16, &low, &high);
    if (f && at / 4 % 4 == 2 && isfinite(requested))
      *f = requested < low ? low : requested > high ? high : requested;
    return RCODE_OK;
  }
  if (at >= STROBE_BASE + 0x200 && at < STROBE_BASE + 0x210) {
    c->strobe[((unsigned)at - STROBE_BASE - 0x200) / 4] = value & ~bit(0);
    return RCODE_OK;
  }
  return at >= STROBE_BASE && at < STROBE_BASE + 0x300 ? RCODE_OK : RCODE_ADDRESS;
}

/* ---- the sensor ---- */

static bool may_send(struct iidc_camera* c) {
  if (!c->powered || (c->format == 7 && f7_errors(c))) return false;
  if (c->transmitting) return true;
  if (c->one_shot) {
    c->one_shot = false;
    return true;
  }
  if (c->multi_shot) {
    c->multi_shot--;
    return true;
  }
  return false;
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
    if (edge && s->exposing && edge != s->exposing && ns < s->exposing + shutter)
      s->missed_edges++;
    else if (edge && !s->exposing)
      s->exposing = edge;
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
