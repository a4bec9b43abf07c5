#include "tests/rigs/emulators/iidc_model.h"

#include <stdio.h>
#include <string.h>

#include "tests/rigs/emulators/iidc_model_internal.h"

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

uint32_t iidc_modes_of(unsigned format) {
  uint32_t inq = 0;
  for (size_t i = 0; i < sizeof modes / sizeof *modes; i++)
    if (modes[i].format == format) inq |= bit(modes[i].mode);
  return inq;
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

uint32_t iidc_rates_of(bool beta, unsigned format, unsigned mode) {
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
  c->frame_rate = 480;
  c->shutter_abs = 0.005f;
  c->frame_rate_abs = 30.0f;
  c->f7_size = 640u << 16 | 480u;
  c->f7_packet = 1280;
  make_rom(c);
}

void iidc_init_beta(struct iidc_camera* c) {
  c->beta = true;
  make_rom(c);
}
