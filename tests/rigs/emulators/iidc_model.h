/* A camera after the IIDC 1.31 register map (1394 TA), seen from its registers: no bus in here.
 * The 1394 and the USB emulator both play this camera. */
#ifndef IIDC_MODEL_H
#define IIDC_MODEL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define IIDC_ROM_QUADLETS 64
#define IIDC_MAX_WIDTH 1280u
#define IIDC_MAX_HEIGHT 960u

struct iidc_camera {
  uint64_t guid;
  char vendor[32];
  char model[32];
  uint32_t rom[IIDC_ROM_QUADLETS];
  int rom_length; /* quadlets */
  bool beta;      /* 1394b: S800 offered */

  /* registers */
  uint32_t format, mode, rate;
  uint32_t channel, iso_speed;
  bool powered, transmitting;
  uint32_t trigger; /* TRIGGER_MODE register */
  uint32_t trigger_delay;
  uint32_t shutter, gain, frame_rate;
  float shutter_abs, gain_abs, frame_rate_abs;
  uint32_t strobe[4];
  uint32_t f7_position, f7_size, f7_coding, f7_packet;
  uint32_t frame_info; /* which stamps are embedded into the image */
  unsigned software_triggers;

  /* what the simulated sensor did */
  uint32_t frames_made;

  /* what it looks at: images of one size, 8 bits, one after the other; NULL: a moving pattern */
  const uint8_t* film;
  size_t film_bytes;
  double film_hz;
};

void iidc_init(struct iidc_camera* c, unsigned index);
/* The same camera with a 1394b link (S800). */
void iidc_init_beta(struct iidc_camera* c);

/* Registers and ROM, offsets in the 48-bit address space of a node. Return 0, or an IEEE 1394
 * response code. */
int iidc_read(struct iidc_camera* c, uint64_t offset, uint32_t* value);
int iidc_write(struct iidc_camera* c, uint64_t offset, uint32_t value);

/* The mode the registers ask for. */
unsigned iidc_width(const struct iidc_camera* c);
unsigned iidc_height(const struct iidc_camera* c);
unsigned iidc_bits(const struct iidc_camera* c); /* per pixel */
unsigned iidc_packet_bytes(const struct iidc_camera* c);
size_t iidc_frame_bytes(const struct iidc_camera* c);
double iidc_rate(const struct iidc_camera* c);

/* The sensor's own time. Free running, frame k begins to expose at k / rate on CLOCK_MONOTONIC, so
 * that cameras of one rate are in step as on a real 1394 bus. Triggered, it begins at the edge, and
 * edges during an exposure are lost. */
struct iidc_sensor {
  uint64_t tick;     /* last frame begun */
  uint64_t exposing; /* begin of the triggered exposure now going on, or 0 */
};

/* Call until it says false: is a frame ready (exposed to the end) at `ns`? Gives the begin of its
 * exposure. `edge`: time of an external trigger pulse, or 0. Consumes software triggers. */
bool iidc_next_frame(struct iidc_camera* c, struct iidc_sensor* s, uint64_t ns, uint64_t edge,
                     uint64_t* begin);

/* The camera looks at DIR/camera<INDEX>.raw, image n of all cameras standing from (n - 1/2) / hz to
 * (n + 1/2) / hz after the exposure of the first frame anybody takes; the last one stays. Modes of
 * another size or depth show the pattern. 0, or -1 with a message. */
int iidc_load_film(struct iidc_camera* c, const char* dir, unsigned index, double hz);

/* Draws frame number c->frames_made (the film's image, or a moving pattern), stamps it and counts
 * on. Row 0, from byte 64: "VRGF", frame number (u32), middle of the exposure on CLOCK_MONOTONIC in
 * ns (u64), GUID (u64); all little endian. */
#define IIDC_STAMP_OFFSET 64
void iidc_draw(struct iidc_camera* c, uint8_t* image, uint64_t exposure_ns, uint32_t cycle_time);

#endif
