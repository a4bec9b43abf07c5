#ifndef VERGENCE_FIRMWARE_IFACE_TRIGGER_BOARD_STM32F405_PORT_H
#define VERGENCE_FIRMWARE_IFACE_TRIGGER_BOARD_STM32F405_PORT_H
/* What the files of this port have of each other. */
#include <stdbool.h>
#include <stdint.h>

#include "firmware_iface/trigger/board/records.h"

typedef struct {
  uint32_t timers_hz; /* TIM2, TIM4, TIM5 */
  uint32_t usart1_hz;
  uint32_t ppm; /* that they may be off */
} Clocks;

/* processor.c. A word, or 0 and false where the bus has nothing there. */
bool probe_word(uint32_t address, uint32_t* word);
void bus_fault_handler(void);
void irq_enable(unsigned irq, uint8_t priority);
/* Interrupts off; → what irq_restore() takes. */
uint32_t irq_off(void);
void irq_restore(uint32_t primask);

/* clocks.c */
void clocks_start(Clocks* clocks);

/* pulses.c, inputs.c: TIM2 is the time base and makes the pulses; TIM4 and TIM5 count in step with
 * it and stamp inputs. */
void pulses_start(void);
void pulses_configure(uint8_t lines, uint8_t active_low);
void inputs_start(void);
void tim2_handler(void);
void tim5_handler(void);
void exti9_5_handler(void);
/* Stamps of both; its interrupts have one priority, so that they are one producer. */
extern RecordRing port_stamps;

/* line.c */
void line_start(uint32_t clock_hz);
void usart1_handler(void);

/* start.c */
void restart(void) __attribute__((noreturn));

#endif
