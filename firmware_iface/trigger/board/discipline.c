#include "firmware_iface/trigger/board/discipline.h"

#include <string.h>

enum {
  rate_bits = 40,
  second_us = 1000000,
  pps_seconds = tick_pps_edges - 1, /* 16 s of microseconds, 2^-40: just below 2^64 */
  pps_agree_us =
      100, /* receivers are right to 0.1 us, interrupts of a port without capture to some 10 us */
  pps_wander = 20, /* an oscillator moves by less than a twentieth of its tolerance from one second
                      to the next */
  pps_to_acquire = 4,
  pps_refused_limit = 3,
  pps_lost_s = 4
};

/* 1 ms, 2^-8 us. Farther off after PPS was lost: a new phase instead of minutes of steering. */
static const int64_t kPhaseLimit = 256000;
static const uint64_t kFractionMask = (UINT64_C(1) << rate_bits) - 1U;

/* counts * rate, split at the point. */
static uint64_t scaled(uint64_t counts, uint64_t rate, uint64_t* fraction) {
  const uint64_t mask = UINT32_MAX;
  const uint64_t low = (counts & mask) * (rate & mask);
  const uint64_t middle_a = (counts >> 32U) * (rate & mask);
  const uint64_t middle_b = (counts & mask) * (rate >> 32U);
  const uint64_t middle = (low >> 32U) + (middle_a & mask) + (middle_b & mask);
  const uint64_t high =
      (counts >> 32U) * (rate >> 32U) + (middle_a >> 32U) + (middle_b >> 32U) + (middle >> 32U);
  const uint64_t low_word = (middle << 32U) | (low & mask);
  *fraction = low_word & kFractionMask;
  return (high << (64U - rate_bits)) | (low_word >> rate_bits);
}

/* Rate at which `counts` are so many seconds (at most 16). */
static uint64_t rate_of(uint64_t seconds, uint64_t counts) {
  return (((seconds * second_us) << rate_bits) + counts / 2U) / counts;
}

static TickSegment segment_at(const TickDiscipline* d, uint64_t count) {
  TickSegment at = count >= d->segment.count ? d->segment : d->before;
  uint64_t fraction = 0;
  if (count >= at.count) {
    at.us += scaled(count - at.count, at.rate, &fraction);
    at.fraction += fraction;
    at.us += at.fraction >> rate_bits;
    at.fraction &= kFractionMask;
  } else { /* older than both: backwards along the older one */
    uint64_t back = scaled(at.count - count, at.rate, &fraction);
    if (fraction > at.fraction) {
      at.fraction += UINT64_C(1) << rate_bits;
      ++back;
    }
    at.fraction -= fraction;
    at.us = at.us > back ? at.us - back : 0;
  }
  at.count = count;
  return at;
}

/* A new segment from `now` on; never from before one that is already in use. */
static void set_rate(TickDiscipline* d, uint64_t rate, uint64_t now) {
  if (now < d->segment.count) now = d->segment.count;
  const TickSegment next = segment_at(d, now);
  d->before = d->segment;
  d->segment = next;
  d->segment.rate = rate;
}

void tick_init(TickDiscipline* d, uint32_t counts_hz, uint32_t tolerance_ppm, uint64_t count) {
  memset(d, 0, sizeof *d);
  d->counts_hz = counts_hz;
  d->tolerance = (uint64_t)counts_hz * tolerance_ppm / second_us;
  const uint64_t agree = d->counts_hz * pps_agree_us / second_us;
  d->agree = d->tolerance / pps_wander > agree ? d->tolerance / pps_wander : agree;
  d->segment.count = count;
  d->segment.rate = rate_of(1, counts_hz);
  d->before = d->segment;
}

uint64_t tick_of(const TickDiscipline* d, uint64_t count) {
  const TickSegment at = segment_at(d, count);
  return at.us + (at.fraction >> (rate_bits - 1U));
}

uint64_t tick_length(const TickDiscipline* d, uint64_t counts) {
  uint64_t fraction = 0;
  const uint64_t us = scaled(counts, d->segment.rate, &fraction);
  return us + (fraction >> (rate_bits - 1U));
}

void tick_hold_rate(TickDiscipline* d) { d->held = true; }

static uint64_t oldest(const TickDiscipline* d) { return d->edges[d->first]; }

static uint64_t difference(uint64_t a, uint64_t b) { return a > b ? a - b : b - a; }

static void clear_edges(TickDiscipline* d) {
  d->used = 0;
  d->first = 0;
  d->refused = 0;
  d->acquired = false;
}

static void keep_edge(TickDiscipline* d, uint64_t edge) {
  if (d->used == tick_pps_edges) {
    d->first = (uint8_t)((d->first + 1U) % tick_pps_edges);
    --d->used;
  }
  d->edges[(d->first + d->used) % tick_pps_edges] = edge;
  ++d->used;
  d->last_edge = edge;
  d->refused = 0;
}

/* Whole seconds that a difference of counts is, by the best rate there is; 0: it is none. */
static uint64_t whole_seconds(const TickDiscipline* d, uint64_t counts) {
  const uint64_t second =
      d->acquired ? ((uint64_t)second_us << rate_bits) / d->estimate : d->counts_hz;
  const uint64_t seconds = (counts + second / 2U) / second;
  const uint64_t off = difference(counts, seconds * second);
  if (seconds == 0 || seconds > pps_seconds) return 0;
  if (!d->acquired) return seconds == 1 && off <= d->tolerance ? 1 : 0;
  return off <= d->agree ? seconds : 0;
}

/* Moves the rate towards PPS', and once it is there keeps the edges' ticks whole seconds apart. */
static void steer(TickDiscipline* d, uint64_t edge, uint64_t now) {
  const int64_t ppm = (int64_t)(d->estimate / second_us) + 1;
  const TickSegment at = segment_at(d, edge);
  const uint64_t tick = (at.us << 8U) | (at.fraction >> (rate_bits - 8U));
  if (!d->held) {
    d->phase = tick;
    d->aligned = true;
    d->locked = true;
    set_rate(d, d->estimate, now);
    return;
  }
  int64_t wanted = (int64_t)d->estimate;
  const int64_t second = (int64_t)second_us << 8U;
  int64_t phase = d->aligned ? (int64_t)(tick - d->phase) % second : 0;
  if (phase > second / 2) phase -= second;
  const bool arrived = difference(d->estimate, d->segment.rate) <= (uint64_t)(2 * ppm);
  if (arrived && (!d->aligned || phase > kPhaseLimit || phase < -kPhaseLimit)) {
    d->phase = tick;
    d->aligned = true;
    phase = 0;
  }
  d->locked = d->locked || arrived;
  if (arrived) {
    int64_t correction = phase / 16; /* 2^-8 ppm: a sixteenth of it within the next second */
    if (correction > 256) correction = 256;
    if (correction < -256) correction = -256;
    wanted -= ppm * correction / 256;
  }
  int64_t step = wanted - (int64_t)d->segment.rate;
  const int64_t missing = step < 0 ? -step : step;
  const int64_t limit = missing / 16 > ppm ? missing / 16 : ppm;
  if (step > limit) step = limit;
  if (step < -limit) step = -limit;
  set_rate(d, (uint64_t)((int64_t)d->segment.rate + step), now);
}

bool tick_pps(TickDiscipline* d, uint64_t edge, uint64_t now) {
  if (d->used == 0) {
    keep_edge(d, edge);
    return true;
  }
  if (edge <= d->last_edge) return false;
  const uint64_t since = edge - d->last_edge;
  uint64_t seconds = whole_seconds(d, since);
  if (seconds == 1 && !d->acquired && d->used >= 2) { /* as long as those before it */
    const uint64_t mean = (d->last_edge - oldest(d)) / (d->used - 1U);
    if (difference(since, mean) > d->agree) seconds = 0;
  }
  if (seconds == 0) {
    if (!d->acquired || ++d->refused >= pps_refused_limit) {
      clear_edges(d);
      d->locked = false;
      keep_edge(d, edge);
    }
    return false;
  }
  keep_edge(d, edge);
  /* Of a run with gaps the older edges go until what is left is 16 s at most. */
  uint64_t span = whole_seconds(d, edge - oldest(d));
  while (d->acquired && span == 0 && d->used > 2) {
    d->first = (uint8_t)((d->first + 1U) % tick_pps_edges);
    --d->used;
    span = whole_seconds(d, edge - oldest(d));
  }
  if (!d->acquired) {
    if (d->used < pps_to_acquire) return true;
    span = d->used - 1U;
    d->acquired = true;
  }
  if (span == 0) span = seconds; /* two edges are left: `seconds` apart */
  d->estimate = rate_of(span, edge - oldest(d));
  steer(d, edge, now);
  return true;
}

void tick_advance(TickDiscipline* d, uint64_t now) {
  if (d->used > 0 && now > d->last_edge && now - d->last_edge > pps_lost_s * d->counts_hz) {
    if (d->locked) set_rate(d, d->estimate, now); /* without what steered the phase */
    d->locked = false;
    if (now - d->last_edge > pps_seconds * d->counts_hz) clear_edges(d);
  }
  if (now > d->segment.count && now - d->segment.count > d->counts_hz)
    set_rate(d, d->segment.rate, now);
}
