/* Starts the port; who the board is, which start this is, and the watchdog: RM0090 "Device
 * electronic signature", "Random number generator", "IWDG". */
#include "firmware_iface/trigger/board/hal.h"
#include "firmware_iface/trigger/board/stm32f405/port.h"
#include "firmware_iface/trigger/board/stm32f405/registers.h"

enum {
  noise_words = 64,
  rng_loops = 1000, /* a number takes 40 clocks of 48 MHz */
  watchdog_loops = 100000
};

static Clocks clocks;

/* Random when power comes up; then it carries each start's value to the next, where the generator
 * has no clock. */
static uint32_t noise[noise_words] __attribute__((section(".noinit")));

static void start_watchdog(void) {
  IWDG->kr = 0xCCCC; /* starts, on its own 32 kHz */
  IWDG->kr = 0x5555; /* opens the two registers below */
  IWDG->pr = 4;      /* / 64: 2 ms */
  IWDG->rlr = 100;   /* 0.2 s */
  for (unsigned i = 0; i < watchdog_loops && IWDG->sr != 0; ++i) {
  }
  IWDG->kr = 0xAAAA;
}

void hal_feed_watchdog(void) { IWDG->kr = 0xAAAA; }

void hal_start(void) {
  clocks_start(&clocks);
  inputs_start(); /* before the time base: they start with it */
  pulses_start();
  line_start(clocks.usart1_hz);
  start_watchdog();
}

void hal_describe(BoardDescription* description) {
  *description = (BoardDescription){
      .counts_hz = clocks.timers_hz,
      .crystal_ppm = clocks.ppm,
      .max_millihertz = 1000000,
      .lines = 4,
      .feedback_inputs = 2,
      .has_pps = true,
      .has_ins = true,
  };
  for (unsigned i = 0; i < 3; ++i) {
    uint32_t word = 0;
    if (!probe_word(UNIQUE_ID + 4U * i, &word)) continue;
    (void)trigger_put_bytes(description->serial + 4U * i, word, 4);
  }
}

/* The generator's second number (the first is not to be used: RM0090 "RNG operation"), 0 where it
 * has no clock. */
static uint32_t random_word(void) {
  uint32_t word = 0;
  RNG->cr = 1U << 2U;
  for (unsigned n = 0; n < 2; ++n) {
    unsigned i = 0;
    while (i < rng_loops && (RNG->sr & 1U) == 0) ++i;
    word = i < rng_loops ? RNG->dr : 0;
  }
  return word;
}

uint32_t hal_boot_id(void) {
  uint32_t mixed = 2166136261U; /* FNV-1a over words */
  for (unsigned i = 0; i < noise_words; ++i) mixed = (mixed ^ noise[i]) * 16777619U;
  mixed = (mixed ^ random_word()) * 16777619U;
  mixed ^= mixed >> 15U;
  noise[0] = mixed;
  return mixed;
}
