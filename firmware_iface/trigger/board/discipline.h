#ifndef VERGENCE_FIRMWARE_IFACE_TRIGGER_BOARD_DISCIPLINE_H
#define VERGENCE_FIRMWARE_IFACE_TRIGGER_BOARD_DISCIPLINE_H
/*
 * The board's ticks: microseconds since its start out of the counts of its timer, at the rate of
 * PPS where there is one.
 *
 * Without PPS a tick is 10^-6 s by the crystal. The rate of PPS is the slope over the last 16 s of
 * its edges; an edge counts when it lies within 100 us of where the others say (more for a bad
 * oscillator), and the first four must agree. Ticks never step, backwards or forwards: they are a
 * continuous, rising, piecewise linear function of counts. Until tick_hold_rate() their rate takes
 * PPS' at once; then it moves by at most 1 ppm a second (or a sixteenth of what is missing, if that
 * is more), so that a host that maps ticks to its own clock can follow. Once the rate is there the
 * ticks of PPS edges are held whole seconds apart. PPS lost: the last rate stays.
 *
 * Memory     The caller's struct, nothing else. Threads: one at a time.
 * Time       Counts are 64-bit and never wrap; counts_hz 1 MHz .. 1 GHz. Every call is bounded by
 * the ring of edges.
 */
#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { tick_pps_edges = 17 }; /* 16 s of them */

/* From `count` on: us + fraction 2^-40 us, and `rate` 2^-40 us more with every count. */
typedef struct {
  uint64_t count;
  uint64_t us;
  uint64_t fraction;
  uint64_t rate;
} TickSegment;

typedef struct {
  TickSegment segment, before; /* counts older than segment.count go by the one before */
  uint64_t counts_hz;
  uint64_t tolerance; /* counts in a second that the timer may be off */
  uint64_t agree;     /* counts by which an edge may lie beside where the others say */
  uint64_t estimate;  /* rate by PPS; meaningful while acquired */
  uint64_t edges[tick_pps_edges];
  uint8_t first, used; /* in the ring `edges` */
  uint8_t refused;     /* edges in a row that did not fit */
  bool acquired;       /* edges agree */
  bool held;           /* the rate moves slowly */
  bool aligned;        /* phase is set */
  bool locked;
  uint64_t phase;     /* tick of an edge to which the others shall be whole seconds, 2^-8 us */
  uint64_t last_edge; /* that was accepted */
} TickDiscipline;

/* tolerance_ppm: how far the timer's crystal may be off; PPS farther off than that is not believed.
 */
void tick_init(TickDiscipline* discipline, uint32_t counts_hz, uint32_t tolerance_ppm,
               uint64_t count);
/* Tick of a count, rounded. */
uint64_t tick_of(const TickDiscipline* discipline, uint64_t count);
/* Length of a difference of counts, whole microseconds, rounded. */
uint64_t tick_length(const TickDiscipline* discipline, uint64_t counts);
/* A PPS edge at `edge`, told at `now`; the rate changes from `now` on. False: the edge did not fit
 * and was not used. */
bool tick_pps(TickDiscipline* discipline, uint64_t edge, uint64_t now);
/* To be called at least every second: detects that PPS is lost. */
void tick_advance(TickDiscipline* discipline, uint64_t now);
/* From now on the host relies on the rate: it moves slowly. */
void tick_hold_rate(TickDiscipline* discipline);

#ifdef __cplusplus
}
#endif
#endif
