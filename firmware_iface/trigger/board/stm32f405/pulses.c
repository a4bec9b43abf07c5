/*
 * Pulses by TIM2, which is the time base: all channels of a pulse match on one count, so that the
 * compare unit makes their edges, not an interrupt. RM0090 "General-purpose timers (TIM2 to TIM5)":
 * output compare mode, forced output mode. Lines 0..3: PA5 (TIM2_CH1), PA1 (CH2), PB10 (CH3), PB11
 * (CH4), alternate function 1.
 */
#include "firmware_iface/trigger/board/hal.h"
#include "firmware_iface/trigger/board/stm32f405/pins.h"
#include "firmware_iface/trigger/board/stm32f405/port.h"

enum {
  line_count = 4,
  mode_active_on_match = 1, /* OCxM */
  mode_inactive_on_match = 2,
  mode_force_inactive = 4,
  mode_force_active = 5,
  /* A compare is set at least so many counts ahead, and taken back only before that: longer than
   * the code between look and deed, with interrupts off (some 250 processor cycles, of which a
   * count has one or two). */
  guard_counts = 400,
  overdue_counts = 100000 /* about 1 ms: the compare unit's interrupt should have come long ago */
};

typedef enum { pulse_idle, pulse_armed, pulse_active } PulsePhase;

/* Main loop with interrupts off, and TIM2's interrupt. */
static struct {
  PulsePhase phase;
  uint8_t lines;
  uint32_t flag; /* CCxIF and CCxIE of the lowest line, which stands for all */
  uint32_t at;   /* of the edge to come */
  uint32_t width;
} pulse;

static GpioRegisters* line_port(unsigned line) { return line < 2 ? GPIOA : GPIOB; }

static unsigned line_pin(unsigned line) {
  static const uint8_t kPins[line_count] = {5, 1, 10, 11};
  return kPins[line];
}

static bool has_line(uint8_t mask, unsigned line) { return (((unsigned)mask >> line) & 1U) != 0; }

static void set_mode(uint8_t lines, uint32_t mode) {
  for (unsigned k = 0; k < line_count; ++k) {
    if (!has_line(lines, k)) continue;
    const unsigned shift = 8U * (k % 2U) + 4U;
    TIM2->ccmr[k / 2U] = (TIM2->ccmr[k / 2U] & ~(7U << shift)) | (mode << shift);
  }
}

static void set_compare(uint8_t lines, uint32_t count) {
  for (unsigned k = 0; k < line_count; ++k)
    if (has_line(lines, k)) TIM2->ccr[k] = count;
}

static bool edge_was_made(void) { return (TIM2->sr & pulse.flag) != 0; }

static void end_pulse(void) {
  set_mode(pulse.lines, mode_force_inactive);
  TIM2->dier = 0;
  pulse.phase = pulse_idle;
}

/* The leading edge was made at `count`: next comes the trailing one. */
static void begin_pulse(uint32_t count, bool late) {
  record_push(&port_stamps,
              (StampRecord){.count = count, .source = record_pulse, .rising = true, .late = late});
  pulse.at = count + pulse.width;
  pulse.phase = pulse_active;
  set_compare(pulse.lines, pulse.at);
  set_mode(pulse.lines, mode_inactive_on_match);
  if ((int32_t)(pulse.at - TIM2->cnt) <= 0 && !edge_was_made())
    end_pulse(); /* this came too late for a match */
}

void pulses_start(void) {
  TIM2->arr = UINT32_MAX;
  TIM2->psc = 0;
  TIM2->cr2 = 1U << 4U; /* MMS = 001: its enable is the trigger of TIM4 and TIM5 */
  TIM2->egr = 1;        /* UG: counter and prescaler to zero */
  TIM2->sr = 0;
  set_mode(0xF, mode_force_inactive);
  irq_enable(irq_tim2, 0x10);
  TIM2->cr1 = 1; /* CEN */
}

uint32_t hal_now(void) { return TIM2->cnt; }

void pulses_configure(uint8_t lines, uint8_t active_low) {
  const uint32_t primask = irq_off();
  set_mode(0xF, mode_force_inactive);
  TIM2->dier = 0;
  pulse.phase = pulse_idle;
  uint32_t ccer = 0;
  for (unsigned k = 0; k < line_count; ++k)
    if (has_line(lines, k))
      ccer |= (has_line(active_low, k) ? 3U : 1U) << (4U * k); /* CCxE, CCxP */
  TIM2->ccer = ccer;
  for (unsigned k = 0; k < line_count; ++k)
    pin_set(line_port(k), line_pin(k), has_line(lines, k) ? pin_alternate : pin_input, 1);
  irq_restore(primask);
}

bool hal_arm(uint32_t count, uint32_t width, uint8_t lines) {
  const uint32_t primask = irq_off();
  const bool ok = pulse.phase == pulse_idle && (int32_t)(count - TIM2->cnt) > guard_counts;
  if (ok) {
    pulse.lines = lines;
    pulse.flag = (lines & (0U - lines)) << 1U; /* CC1IF is bit 1 */
    pulse.at = count;
    pulse.width = width;
    pulse.phase = pulse_armed;
    set_compare(lines, count);
    TIM2->sr = ~pulse.flag;
    set_mode(lines, mode_active_on_match);
    TIM2->dier = pulse.flag;
  }
  irq_restore(primask);
  return ok;
}

bool hal_disarm(void) {
  const uint32_t primask = irq_off();
  const bool ok = pulse.phase == pulse_armed && (int32_t)(pulse.at - TIM2->cnt) > guard_counts &&
                  !edge_was_made();
  if (ok) end_pulse();
  irq_restore(primask);
  return ok;
}

void tim2_handler(void) {
  if (!edge_was_made()) return;
  TIM2->sr = ~pulse.flag;
  if (pulse.phase == pulse_armed)
    begin_pulse(pulse.at, false);
  else
    end_pulse();
}

void hal_check_pulse(void) {
  const uint32_t primask = irq_off();
  if (pulse.phase != pulse_idle && (int32_t)(TIM2->cnt - pulse.at) > overdue_counts &&
      !edge_was_made()) {
    if (pulse.phase == pulse_armed) {
      set_mode(pulse.lines, mode_force_active);
      begin_pulse(TIM2->cnt, true);
    } else {
      end_pulse();
    }
  }
  irq_restore(primask);
}
