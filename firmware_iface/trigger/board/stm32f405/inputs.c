/*
 * Inputs are stamped by capture units that count in step with TIM2: RM0090 "Input capture mode",
 * "Timer synchronization" (trigger mode; they start a few clock periods after TIM2). Feedback 0, 1:
 * PA0 (TIM5_CH1), PA2 (TIM5_CH3), alternate function 2; each pin feeds two capture channels, one
 * for either edge, so that start and end of an exposure are both stamped and told apart by
 * hardware. PPS, INS:      PB6 (TIM4_CH1), PB7 (TIM4_CH2), alternate function 2. EXTI lines 6 and 7
 * of the same pins call the interrupt; TIM4 has the stamp. Without it (no capture came) the
 * interrupt's own time is the stamp, later by its latency.
 */
#include "firmware_iface/trigger/board/hal.h"
#include "firmware_iface/trigger/board/stm32f405/pins.h"
#include "firmware_iface/trigger/board/stm32f405/port.h"

enum {
  capture_filter = 3,          /* ICxF: eight equal samples of the timer's clock, 0.1 us */
  capture_mode_own = 1,        /* CCxS: the channel's own pin */
  capture_mode_other = 2,      /* the pin of its neighbour */
  trigger_mode = 6,            /* SMS */
  trigger_of_tim2_at_tim4 = 1, /* TS: ITR1 */
  trigger_of_tim2_at_tim5 = 0, /* ITR0 */
  capture_polls = 16, /* an edge passes the capture's filter later than EXTI's, by less than this */
  feedback_count = 2,
  exti_pps = 6
};

RecordRing port_stamps;

static void start_slave(TimerRegisters* timer, uint32_t top, uint32_t trigger) {
  timer->arr = top;
  timer->psc = 0;
  timer->egr = 1; /* UG */
  timer->sr = 0;
  timer->smcr = (trigger << 4U) | trigger_mode;
}

void inputs_start(void) {
  const uint32_t own = capture_mode_own | (capture_filter << 4U);
  const uint32_t other = capture_mode_other | (capture_filter << 4U);
  TIM5->ccmr[0] = own | (other << 8U); /* IC1 and IC2 on TI1 */
  TIM5->ccmr[1] = own | (other << 8U); /* IC3 and IC4 on TI3 */
  TIM4->ccmr[0] = own | (own << 8U);
  start_slave(TIM5, UINT32_MAX, trigger_of_tim2_at_tim5);
  start_slave(TIM4, UINT16_MAX, trigger_of_tim2_at_tim4);
  pin_set(GPIOA, 0, pin_alternate, 2);
  pin_set(GPIOA, 2, pin_alternate, 2);
  pin_set(GPIOB, 6, pin_alternate, 2);
  pin_set(GPIOB, 7, pin_alternate, 2);
  SYSCFG->exticr[1] = (SYSCFG->exticr[1] & ~0xFF00U) | 0x1100U; /* EXTI6, EXTI7: port B */
  irq_enable(irq_tim5, 0x10);
  irq_enable(irq_exti9_5, 0x10);
}

static void configure_edge(unsigned channel, uint8_t edge) {
  const uint32_t bit = 1U << (exti_pps + channel);
  const uint32_t enable = edge == trigger_edge_none     ? 0U
                          : edge == trigger_edge_rising ? 1U
                                                        : 3U; /* CCxE, CCxP: falling */
  TIM4->ccer = (TIM4->ccer & ~(0xFU << (4U * channel))) | (enable << (4U * channel));
  EXTI->imr &= ~bit;
  EXTI->rtsr = (EXTI->rtsr & ~bit) | (edge == trigger_edge_rising ? bit : 0U);
  EXTI->ftsr = (EXTI->ftsr & ~bit) | (edge == trigger_edge_falling ? bit : 0U);
  TIM4->sr = ~((2U << channel) | (0x200U << channel)); /* CCxIF, CCxOF of before */
  EXTI->pr = bit;
  if (edge != trigger_edge_none) EXTI->imr |= bit;
}

void hal_configure(const TriggerConfig* config) {
  pulses_configure(config->lines, config->active_low);
  TIM5->dier = 0;
  uint32_t ccer = 0, dier = 0;
  for (unsigned k = 0; k < feedback_count; ++k)
    if ((((unsigned)config->feedback_inputs >> k) & 1U) != 0) {
      ccer |= 0x31U << (8U * k); /* rising edge on the lower channel, falling on the upper */
      dier |= 6U << (2U * k);    /* CC1IE, CC2IE or CC3IE, CC4IE */
    }
  TIM5->ccer = ccer;
  TIM5->sr = 0;
  TIM5->dier = dier;
  configure_edge(0, config->pps_edge);
  configure_edge(1, config->ins_edge);
}

static void push_feedback(unsigned input, bool rising, uint32_t count) {
  record_push(&port_stamps, (StampRecord){.count = count,
                                          .source = (uint8_t)(board_input_feedback + input),
                                          .rising = rising});
}

/* A capture that overwrote another is one edge lost. */
static void count_overcapture(TimerRegisters* timer, uint32_t status, unsigned channel) {
  const uint32_t flag = 1U << (9U + channel); /* CCxOF */
  if ((status & flag) == 0) return;
  timer->sr = ~flag;
  ++port_stamps.lost;
}

void tim5_handler(void) {
  const uint32_t status = TIM5->sr & (TIM5->dier | 0x1E00U);
  for (unsigned k = 0; k < feedback_count; ++k) {
    const bool rose = (status & (2U << (2U * k))) != 0;
    const bool fell = (status & (4U << (2U * k))) != 0;
    const unsigned channel = 2U * k;
    count_overcapture(TIM5, status, channel);
    count_overcapture(TIM5, status, channel + 1U);
    const uint32_t rise = rose ? TIM5->ccr[channel] : 0; /* reading clears the flag */
    const uint32_t fall = fell ? TIM5->ccr[channel + 1U] : 0;
    const bool fall_first = rose && fell && (int32_t)(fall - rise) < 0;
    if (fell && fall_first) push_feedback(k, false, fall);
    if (rose) push_feedback(k, true, rise);
    if (fell && !fall_first) push_feedback(k, false, fall);
  }
}

static uint32_t captured(unsigned channel) {
  for (unsigned i = 0; i < capture_polls; ++i)
    if ((TIM4->sr & (2U << channel)) != 0) {
      count_overcapture(TIM4, TIM4->sr, channel);
      const uint32_t low = TIM4->ccr[channel];
      const uint32_t now = TIM2->cnt;
      return now - ((now - low) & 0xFFFFU); /* 16 bits in step with TIM2: 0.8 ms at 84 MHz, longer
                                               than any latency here */
    }
  return TIM2->cnt;
}

void exti9_5_handler(void) {
  for (unsigned channel = 0; channel < 2; ++channel) {
    const uint32_t bit = 1U << (exti_pps + channel);
    if ((EXTI->pr & bit) == 0) continue;
    EXTI->pr = bit; /* cleared by writing one */
    const StampRecord record = {.count = captured(channel),
                                .source = (uint8_t)(board_input_pps + channel),
                                .rising = (EXTI->rtsr & bit) != 0};
    record_push(&port_stamps, record);
  }
}

bool hal_stamped(StampRecord* record) { return record_pop(&port_stamps, record); }

uint32_t hal_stamps_lost(void) { return __atomic_load_n(&port_stamps.lost, __ATOMIC_RELAXED); }
