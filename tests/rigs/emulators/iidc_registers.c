/* The registers of the model. */
#include <math.h>
#include <string.h>

#include "tests/rigs/emulators/iidc_model_internal.h"

#define CSR 0xfffff0000000ULL
#define ROM_OFFSET 0x400u
#define F7_BASE 0xf08000u
#define ABS_BASE 0xf09000u
#define STROBE_BASE 0xf0a000u

enum { RCODE_OK = 0, RCODE_TYPE = 6, RCODE_ADDRESS = 7 };

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
    *v = format == 7 ? bit(0) : iidc_modes_of(format);
    return RCODE_OK;
  }
  if (at >= 0x200 && at < 0x2e0) {
    *v = iidc_rates_of(c->beta, (at - 0x200) / 32, (at - 0x200) % 32 / 4);
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
uint32_t iidc_f7_errors(const struct iidc_camera* c) {
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
      *v = bit(0) | iidc_f7_errors(c);
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
