/* What the emulators of cameras share, whatever their bus: options, commands on standard input, the
 * external trigger, and the account of what each camera did. */
#ifndef SIM_CAMERAS_H
#define SIM_CAMERAS_H

#include "tests/rigs/emulators/iidc_model.h"

struct sim_camera {
  struct iidc_camera camera;
  struct iidc_sensor sensor;
  uint8_t* image; /* the frame on its way */
  size_t bytes, sent;
  unsigned drop, tear;
  bool tearing;
  uint64_t exposed, transmitted, overtaken, dropped, incomplete;
};

/* --cameras N, --trigger-hz F, --film DIR, --film-hz F, --ready FILE */
struct sim_options {
  unsigned cameras;
  double trigger_hz, film_hz;
  const char *film, *ready;
};

/* 0, or -1 with a message: an option that is unknown, or more than `most` cameras. */
int sim_parse(int argc, char** argv, unsigned most, struct sim_options* options);
/* The file whose presence says that the devices are there. */
void sim_tell_ready(const struct sim_options* options);

/* Reads what there is on standard input:
 *   trigger [NS]  one external trigger pulse to all cameras, now or at that time of CLOCK_MONOTONIC
 *   drop C N      the next N frames of camera C are exposed but lost on the wire
 *   tear C N      the next N frames of camera C lose a part each
 *   quit
 * Other lines go to `own`, which says whether it knows them. False: quit. */
bool sim_obey(struct sim_camera* const* cameras, unsigned count, uint64_t* edge,
              bool (*own)(const char* line));
/* False from the end of standard input on: nothing to poll for. */
bool sim_listening(void);

/* The external trigger's newest pulse by its own rate; 0: none since the last call. */
uint64_t sim_pulse(const struct sim_options* options, uint64_t ns);

/* Whether the loop has to look every millisecond. */
bool sim_busy(const struct sim_camera* c);
/* `sent`: the word for frames that left whole. */
void sim_report(const char* program, unsigned index, const struct sim_camera* c, const char* sent);

#endif
