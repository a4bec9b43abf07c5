#ifndef VERGENCE_FIRMWARE_IFACE_TRIGGER_BOARD_SCHEDULE_H
#define VERGENCE_FIRMWARE_IFACE_TRIGGER_BOARD_SCHEDULE_H
/*
 * When which pulse is due: a grid of slots, one number each. The remainder of every division is
 * carried, so that n even intervals are n * 1000 / rate_millihertz seconds by the timer, to a
 * count, for ever.
 *
 * Memory     The caller's struct, nothing else. Threads: one at a time. Bounded.
 */
#include <stdbool.h>
#include <stdint.h>

#include "firmware_iface/trigger/trigger.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
  uint64_t interval;  /* counts, rounded down */
  uint64_t remainder; /* of it, over rate_millihertz */
  uint64_t rate_millihertz;
  uint64_t vary; /* counts */
  uint64_t carried;
  uint64_t due;  /* count of the next slot */
  uint32_t next; /* its number */
} PulseSchedule;

/* Precondition: rate_millihertz > 0. Keeps the number. */
void schedule_set(PulseSchedule* schedule, uint32_t counts_hz, uint32_t rate_millihertz,
                  uint32_t dither_us);
/* The next slot is at `count`, and the grid begins anew there. */
void schedule_begin(PulseSchedule* schedule, uint64_t count);
/* On to the slot after the next. */
void schedule_advance(PulseSchedule* schedule);
/* Counts of the shortest interval; 0: dither_us is not below the interval. */
uint64_t schedule_shortest(const PulseSchedule* schedule);

#ifdef __cplusplus
}
#endif
#endif
