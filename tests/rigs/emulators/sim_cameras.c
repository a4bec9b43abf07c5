#include "tests/rigs/emulators/sim_cameras.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "tests/rigs/emulators/sim_clock.h"

int sim_parse(int argc, char** argv, unsigned most, struct sim_options* o) {
  *o = (struct sim_options){.cameras = 2, .film_hz = 10};
  for (int i = 1; i + 1 < argc; i += 2) {
    const char* value = argv[i + 1];
    if (!strcmp(argv[i], "--cameras"))
      o->cameras = (unsigned)atoi(value);
    else if (!strcmp(argv[i], "--trigger-hz"))
      o->trigger_hz = atof(value);
    else if (!strcmp(argv[i], "--film"))
      o->film = value;
    else if (!strcmp(argv[i], "--film-hz"))
      o->film_hz = atof(value);
    else if (!strcmp(argv[i], "--ready"))
      o->ready = value;
    else
      return fprintf(stderr, "%s: unknown option %s\n", argv[0], argv[i]), -1;
  }
  return o->cameras > most ? fprintf(stderr, "%s: %u cameras at most\n", argv[0], most), -1 : 0;
}

void sim_tell_ready(const struct sim_options* o) {
  if (o->ready) close(open(o->ready, O_CREAT | O_WRONLY, 0644));
}

static bool input_ended;
bool sim_listening(void) { return !input_ended; }

static bool obey(const char* line, struct sim_camera* const* cameras, unsigned count,
                 uint64_t* edge) {
  unsigned a = 0, b = 0;
  unsigned long long at = 0;
  if (!strncmp(line, "trigger", 7))
    *edge = sscanf(line, "trigger %llu", &at) == 1 ? at : now_ns();
  else if (sscanf(line, "drop %u %u", &a, &b) == 2 && a < count)
    cameras[a]->drop = b;
  else if (sscanf(line, "tear %u %u", &a, &b) == 2 && a < count)
    cameras[a]->tear = b;
  else
    return false;
  return true;
}

bool sim_obey(struct sim_camera* const* cameras, unsigned count, uint64_t* edge,
              bool (*own)(const char* line)) {
  static char line[128];
  static size_t filled;
  char* end;
  ssize_t got = read(0, line + filled, sizeof line - 1 - filled);
  input_ended = got <= 0;
  filled += got > 0 ? (size_t)got : 0;
  line[filled] = 0;
  while ((end = strchr(line, '\n'))) {
    *end = 0;
    if (!strncmp(line, "quit", 4)) return false;
    if (!own(line) && !obey(line, cameras, count, edge)) fprintf(stderr, "what is '%s'?\n", line);
    filled -= (size_t)(end + 1 - line);
    memmove(line, end + 1, filled + 1);
  }
  if (filled == sizeof line - 1) filled = 0;
  return true;
}

uint64_t sim_pulse(const struct sim_options* o, uint64_t ns) {
  static uint64_t last;
  uint64_t pulse = (uint64_t)((double)ns * 1e-9 * o->trigger_hz);
  if (pulse == last) return 0;
  last = pulse;
  return (uint64_t)((double)pulse / o->trigger_hz * 1e9);
}

bool sim_busy(const struct sim_camera* c) { return c->camera.transmitting || c->sent < c->bytes; }

void sim_report(const char* program, unsigned index, const struct sim_camera* c, const char* sent) {
  if (c->exposed)
    printf("%s: camera %u exposed %llu %s %llu incomplete %llu dropped %llu overtaken %llu\n",
           program, index, (unsigned long long)c->exposed, sent, (unsigned long long)c->transmitted,
           (unsigned long long)c->incomplete, (unsigned long long)c->dropped,
           (unsigned long long)c->overtaken);
}
