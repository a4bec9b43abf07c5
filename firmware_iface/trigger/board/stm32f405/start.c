/* Vector table, reset, faults. */
#include "firmware_iface/trigger/board/hal.h"
#include "firmware_iface/trigger/board/stm32f405/port.h"
#include "firmware_iface/trigger/board/stm32f405/registers.h"

extern uint32_t stack_top, data_load, data_begin, data_end, bss_begin,
    bss_end; /* the linker script's */

void reset_handler(void);

/* Unexpected interrupt: the board restarts, which the host detects by another boot id.
 * PM0214 "AIRCR": key and SYSRESETREQ. */
void restart(void) {
  SCB_AIRCR = 0x05FA0004U;
  for (;;) {
  }
}

typedef union {
  uint32_t* stack;
  void (*handler)(void);
} Vector;

#define UNEXPECTED \
  { .handler = restart }
__attribute__((section(".vectors"), used)) static const Vector kVectors[16 + irq_count] = {
    [0] = {.stack = &stack_top},
    [1] = {.handler = reset_handler},
    [2] = UNEXPECTED, /* NMI: the clock security system found the crystal dead; the next start runs
                         on the internal oscillator */
    [3] = UNEXPECTED,
    [4] = UNEXPECTED,
    [5] = {.handler = bus_fault_handler},
    [6 ... 15 + irq_exti9_5] = UNEXPECTED,
    [16 + irq_exti9_5] = {.handler = exti9_5_handler},
    [17 + irq_exti9_5... 15 + irq_tim2] = UNEXPECTED,
    [16 + irq_tim2] = {.handler = tim2_handler},
    [17 + irq_tim2... 15 + irq_usart1] = UNEXPECTED,
    [16 + irq_usart1] = {.handler = usart1_handler},
    [17 + irq_usart1... 15 + irq_tim5] = UNEXPECTED,
    [16 + irq_tim5] = {.handler = tim5_handler},
    [17 + irq_tim5... 15 + irq_count] = UNEXPECTED,
};

void reset_handler(void) {
  const uint32_t* from = &data_load;
  for (uint32_t* to = &data_begin; to < &data_end;) *to++ = *from++;
  for (uint32_t* to = &bss_begin; to < &bss_end;) *to++ = 0;
  /* What a boot loader may have left: its interrupts, its vectors. */
  SYSTICK_CTRL = 0;
  for (unsigned i = 0; i <= irq_count / 32U; ++i) {
    NVIC_ICER[i] = UINT32_MAX;
    NVIC_ICPR[i] = UINT32_MAX;
  }
  SCB_VTOR = (uint32_t)kVectors;
  SCB_SHCSR |= 1U << 17U; /* BUSFAULTENA, for probe_word() */
  irq_restore(0);
  firmware_main();
  restart();
}
