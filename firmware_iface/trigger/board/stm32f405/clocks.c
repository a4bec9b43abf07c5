/*
 * 168 MHz from the crystal; where it or the PLL does not come up the board runs on the internal 16
 * MHz and says so by tick_hz. RM0090 "Reset and clock control", "Embedded Flash memory interface".
 */
#include "firmware_iface/trigger/board/stm32f405/port.h"
#include "firmware_iface/trigger/board/stm32f405/registers.h"

#ifndef VERGENCE_BOARD_CRYSTAL_MHZ
#define VERGENCE_BOARD_CRYSTAL_MHZ 8
#endif
/* What the timers count a second on the internal oscillator. QEMU's count 1 GHz whatever the clocks
 * are: with that here, a second of an emulated board's is one of the host's. */
#ifndef VERGENCE_BOARD_INTERNAL_HZ
#define VERGENCE_BOARD_INTERNAL_HZ 16000000
#endif
_Static_assert(VERGENCE_BOARD_CRYSTAL_MHZ >= 4 && VERGENCE_BOARD_CRYSTAL_MHZ <= 26,
               "HSE takes 4 to 26 MHz");

enum {
  internal_hz = VERGENCE_BOARD_INTERNAL_HZ,
  internal_ppm = 20000, /* +-1 % at 25 degrees, more when it is hot: data sheet "HSI oscillator" */
  crystal_ppm = 200,    /* crystals of such boards have 20 to 50 */
  system_hz = 168000000,
  ready_loops = 100000 /* of some 5 cycles at 16 MHz: 30 ms; a crystal needs 2, the PLL 0.3 */
};

enum {
  cr_hsion = 1 << 0,
  cr_hseon = 1 << 16,
  cr_hserdy = 1 << 17,
  cr_csson = 1 << 19,
  cr_pllon = 1 << 24,
  cr_pllrdy = 1 << 25,
  cfgr_sw_mask = 3,
  cfgr_sw_pll = 2,
  cfgr_sws_mask = 3 << 2,
  cfgr_sws_pll = 2 << 2,
  cfgr_ppre1_4 = 5 << 10, /* APB1 42 MHz, its timers twice that */
  cfgr_ppre2_2 = 4 << 13, /* APB2 84 MHz */
  acr_latency_5 = 5,      /* 2.7 to 3.6 V, above 150 MHz */
  acr_caches = (1 << 8) | (1 << 9) | (1 << 10)
};

static bool wait_for(const Register* at, uint32_t mask, uint32_t value) {
  for (unsigned i = 0; i < ready_loops; ++i)
    if ((*at & mask) == value) return true;
  return false;
}

static bool start_pll(void) {
  RCC->cr |= cr_hseon;
  if (!wait_for(&RCC->cr, cr_hserdy, cr_hserdy)) return false;
  /* VCO: crystal / M * 336 = 336 MHz; / P = 2: 168 MHz; / Q = 7: 48 MHz, which the random number
   * generator needs. */
  RCC->pllcfgr =
      VERGENCE_BOARD_CRYSTAL_MHZ | (336U << 6U) | (0U << 16U) | (1U << 22U) | (7U << 24U);
  RCC->cr |= cr_pllon;
  if (!wait_for(&RCC->cr, cr_pllrdy, cr_pllrdy)) return false;
  FLASH_ACR = acr_latency_5 | acr_caches;
  if (!wait_for(&FLASH_ACR, 7U, acr_latency_5)) return false;
  RCC->cfgr = cfgr_ppre1_4 | cfgr_ppre2_2;
  RCC->cfgr |= cfgr_sw_pll;
  if (!wait_for(&RCC->cfgr, cfgr_sws_mask, cfgr_sws_pll)) return false;
  RCC->cr |= cr_csson; /* the crystal dies: NMI */
  return true;
}

void clocks_start(Clocks* clocks) {
  /* What a boot loader may have left behind. */
  RCC->cr |= cr_hsion;
  RCC->cfgr &= ~(uint32_t)cfgr_sw_mask;
  (void)wait_for(&RCC->cfgr, cfgr_sws_mask, 0);
  RCC->cr &= ~(uint32_t)(cr_pllon | cr_csson);
  (void)wait_for(&RCC->cr, cr_pllrdy, 0);
  RCC->cfgr = 0;

  const bool fast = start_pll();
  if (!fast) {
    RCC->cfgr = 0;
    RCC->cr &= ~(uint32_t)cr_pllon;
  }
  clocks->timers_hz = fast ? system_hz / 2 : internal_hz;
  clocks->usart1_hz = fast ? system_hz / 2 : internal_hz;
  clocks->ppm = fast ? crystal_ppm : internal_ppm;

  const uint32_t ahb1 = (1U << 0U) | (1U << 1U);              /* GPIOA, GPIOB */
  const uint32_t apb1 = (1U << 0U) | (1U << 2U) | (1U << 3U); /* TIM2, TIM4, TIM5 */
  const uint32_t apb2 = (1U << 4U) | (1U << 14U);             /* USART1, SYSCFG */
  RCC->ahb1enr |= ahb1;
  RCC->ahb2enr |= 1U << 6U; /* RNG */
  RCC->apb1enr |= apb1;
  RCC->apb2enr |= apb2;
  (void)RCC->apb2enr;   /* errata "delay after an RCC peripheral clock enabling" */
  RCC->ahb1rstr = ahb1; /* all as after power-up, whatever a boot loader did with them */
  RCC->apb1rstr = apb1;
  RCC->apb2rstr = apb2;
  RCC->ahb1rstr = 0;
  RCC->apb1rstr = 0;
  RCC->apb2rstr = 0;
}
