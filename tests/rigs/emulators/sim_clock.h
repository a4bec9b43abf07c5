/* Clocks shared by the emulators. */
#ifndef SIM_CLOCK_H
#define SIM_CLOCK_H

#include <stdint.h>
#include <time.h>

static inline uint64_t now_ns(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

/* The cycle time register of the virtual 1394 bus at this moment of CLOCK_MONOTONIC. */
static inline uint32_t cycle_time(uint64_t ns) {
  uint32_t rest = (uint32_t)(ns % 1000000000u);
  return (uint32_t)(ns / 1000000000u % 128) << 25 | rest / 125000 << 12 |
         rest % 125000 * 3072 / 125000;
}

#endif
