#include "firmware_iface/trigger/board/schedule.h"

void schedule_set(PulseSchedule* s, uint32_t counts_hz, uint32_t rate_millihertz,
                  uint32_t dither_us) {
  const uint64_t counts = (uint64_t)counts_hz * 1000U;
  s->interval = counts / rate_millihertz;
  s->remainder = counts % rate_millihertz;
  s->rate_millihertz = rate_millihertz;
  s->vary = ((uint64_t)counts_hz * dither_us + 500000U) / 1000000U;
  s->carried = 0;
}

void schedule_begin(PulseSchedule* s, uint64_t count) {
  s->due = count;
  s->carried = 0;
}

void schedule_advance(PulseSchedule* s) {
  s->due += s->interval;
  s->carried += s->remainder;
  if (s->carried >= s->rate_millihertz) {
    s->carried -= s->rate_millihertz;
    ++s->due;
  }
  if (s->vary != 0)
    s->due = trigger_interval_is_longer(s->next) ? s->due + s->vary : s->due - s->vary;
  ++s->next;
}

uint64_t schedule_shortest(const PulseSchedule* s) {
  return s->vary < s->interval ? s->interval - s->vary : 0;
}
