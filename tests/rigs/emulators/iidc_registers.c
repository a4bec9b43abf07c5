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

/* bit(), where a constant is asked for. */
#define BIT(n) (0x80000000u >> (n))
#define INQUIRY (BIT(0) | BIT(4) | BIT(7))

/* The features that the camera has; those with a range have an absolute value, too. */
static const struct feature {
  unsigned number;
  uint32_t inquiry;
  size_t value, absolute; /* members of the camera */
  float low, high;
} features[] = {
    {7, INQUIRY | BIT(1) | BIT(6) | 1u << 12 | 4095u, offsetof(struct iidc_camera, shutter),
     offsetof(struct iidc_camera, shutter_abs), 1e-5f, 0.1f},
    {8, INQUIRY | BIT(1) | BIT(6) | 680u, offsetof(struct iidc_camera, gain),
     offsetof(struct iidc_camera, gain_abs), 0.0f, 24.0f},
    /* trigger: two sources and the software trigger; modes 0, 14, 15 */
    {12, INQUIRY | BIT(5) | BIT(6) | BIT(8) | BIT(9) | BIT(15) | BIT(16) | BIT(30) | BIT(31),
     offsetof(struct iidc_camera, trigger), 0, 0, 0},
    {13, INQUIRY | BIT(5) | 4095u, offsetof(struct iidc_camera, trigger_delay), 0, 0, 0},
    {15, INQUIRY | BIT(1) | BIT(5) | 1u << 12 | 4095u, offsetof(struct iidc_camera, frame_rate),
     offsetof(struct iidc_camera, frame_rate_abs), 1.0f, 60.0f},
};

static const struct feature* feature(unsigned number) {
  for (size_t i = 0; i < sizeof features / sizeof *features; i++)
    if (features[i].number == number) return &features[i];
  return NULL;
}

static float* absolute(struct iidc_camera* c, const struct feature* f) {
  return f && f->high > 0 ? (float*)((char*)c + f->absolute) : NULL;
}

static uint32_t* feature_value(struct iidc_camera* c, unsigned number) {
  const struct feature* f = feature(number);
  return f ? (uint32_t*)((char*)c + f->value) : NULL;
}

static uint32_t command_value(struct iidc_camera* c, uint32_t at) {
  if (at >= 0x180 && at < 0x1a0) { /* modes of a format */
    unsigned format = (at - 0x180) / 4;
    return format == 7 ? bit(0) : iidc_modes_of(format);
  }
  if (at >= 0x200 && at < 0x2e0) {
    return iidc_rates_of(c->beta, (at - 0x200) / 32, (at - 0x200) % 32 / 4);
  }
  if (at >= 0x500 && at < 0x580) {
    const struct feature* f = feature((at - 0x500) / 4);
    return f ? f->inquiry : 0;
  }
  if (at >= 0x700 && at < 0x780) {
    unsigned f = (at - 0x700) / 4;
    return absolute(c, feature(f)) ? (ABS_BASE + 16 * f) / 4 : 0;
  }
  if (at >= 0x800 && at < 0x880) {
    uint32_t* value = feature_value(c, (at - 0x800) / 4);
    return value ? bit(0) | *value : 0;
  }
  switch (at) {
    case 0x100:
      return bit(0) | bit(1) | bit(2) | bit(7);
    case 0x2e0:
      return F7_BASE / 4;
    case 0x400:
      return bit(0) | bit(1) | bit(3) | bit(16) | (c->beta ? bit(8) : 0);
    case 0x404:
      return bit(7) | bit(8) | bit(12) | bit(13) | bit(15);
    case 0x40c:
      return bit(3); /* strobe outputs */
    case 0x480:
      return (COMMAND + 0x1000) / 4;
    case 0x48c:
      return STROBE_BASE / 4;
    case 0x600:
      return c->rate << 29;
    case 0x604:
      return c->mode << 29;
    case 0x608:
      return c->format << 29;
    case 0x60c:
      return c->iso_speed > 2 ? bit(16) | (c->channel & 63) << 8 | c->iso_speed
                              : (c->channel & 15) << 28 | (c->iso_speed & 3) << 24;
    case 0x610:
      return c->powered ? bit(0) : 0;
    case 0x614:
      return c->transmitting ? bit(0) : 0;
    case 0x62c:
      return c->software_triggers ? bit(0) : 0;
    case 0x12f8:
      return bit(0) | c->frame_info;
    default: /* reserved registers read as zero */
      return 0;
  }
}

static void write_command(struct iidc_camera* c, uint32_t at, uint32_t v) {
  if (at >= 0x800 && at < 0x880) {
    uint32_t* value = feature_value(c, (at - 0x800) / 4);
    if (value) *value = v & ~bit(0);
    return;
  }
  switch (at) {
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
    case 0x62c:
      if (v & bit(0)) c->software_triggers = 1;
      break;
    case 0x12f8:
      c->frame_info = v & 0x3ff;
      break;
    default:
      break;
  }
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

static uint32_t f7_value(const struct iidc_camera* c, uint32_t at) {
  switch (at) {
    case 0x00:
      return IIDC_MAX_WIDTH << 16 | IIDC_MAX_HEIGHT;
    case 0x04:
      return 8u << 16 | 2u;
    case 0x08:
      return c->f7_position;
    case 0x0c:
      return c->f7_size;
    case 0x10:
      return c->f7_coding << 24;
    case 0x14:
      return bit(0) | bit(5) | bit(9); /* Mono8, Mono16, Raw8 */
    case 0x34:
      return iidc_width(c) * iidc_height(c);
    case 0x3c:
      return f7_packets(c) * c->f7_packet;
    case 0x40:
      return 4u << 16 | (c->beta ? 8192u : 4096u);
    case 0x44: {
      unsigned advice = (unsigned)((double)iidc_frame_bytes(c) * 30 / 8000 + 3) & ~3u,
               most = c->beta ? 8192u : 4096u;
      return c->f7_packet << 16 | (advice > most ? most : advice);
    }
    case 0x48:
      return f7_packets(c);
    case 0x4c:
      return 2u << 16 | 2u;
    case 0x50:
      return float_bits((float)(1.0 / iidc_rate(c)));
    case 0x54:
      return (c->f7_coding == 5 ? 16u : 8u) << 24;
    case 0x7c: /* the values are taken over at once */
      return bit(0) | iidc_f7_errors(c);
    default:
      return 0;
  }
}

static void write_f7(struct iidc_camera* c, uint32_t at, uint32_t v) {
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
}

int iidc_read(struct iidc_camera* c, uint64_t offset, uint32_t* value) {
  uint64_t at = offset - CSR;
  if (offset < CSR || offset & 3) return RCODE_ADDRESS;
  if (at >= ROM_OFFSET && at < ROM_OFFSET + 4u * (unsigned)c->rom_length) {
    *value = c->rom[(at - ROM_OFFSET) / 4];
    return RCODE_OK;
  }
  if (at >= COMMAND && at < COMMAND + 0x2000)
    return *value = command_value(c, (uint32_t)at - COMMAND), RCODE_OK;
  if (at >= F7_BASE && at < F7_BASE + 0x100)
    return *value = f7_value(c, (uint32_t)at - F7_BASE), RCODE_OK;
  if (at >= ABS_BASE && at < ABS_BASE + 0x200) {
    const struct feature* f = feature(((unsigned)at - ABS_BASE) / 16);
    const float* now = absolute(c, f);
    unsigned field = (unsigned)at / 4 % 4;
    *value = !now || field == 3 ? 0 : float_bits(field == 0 ? f->low : field == 1 ? f->high : *now);
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
    return write_command(c, (uint32_t)at - COMMAND, value), RCODE_OK;
  if (at >= F7_BASE && at < F7_BASE + 0x100)
    return write_f7(c, (uint32_t)at - F7_BASE, value), RCODE_OK;
  if (at >= ABS_BASE && at < ABS_BASE + 0x200) {
    const struct feature* f = feature(((unsigned)at - ABS_BASE) / 16);
    float requested = bits_float(value), *now = absolute(c, f);
    if (now && at / 4 % 4 == 2 && isfinite(requested))
      *now = requested < f->low ? f->low : requested > f->high ? f->high : requested;
    return RCODE_OK;
  }
  if (at >= STROBE_BASE + 0x200 && at < STROBE_BASE + 0x210) {
    c->strobe[((unsigned)at - STROBE_BASE - 0x200) / 4] = value & ~bit(0);
    return RCODE_OK;
  }
  return at >= STROBE_BASE && at < STROBE_BASE + 0x300 ? RCODE_OK : RCODE_ADDRESS;
}
