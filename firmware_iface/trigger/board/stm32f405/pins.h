#ifndef VERGENCE_FIRMWARE_IFACE_TRIGGER_BOARD_STM32F405_PINS_H
#define VERGENCE_FIRMWARE_IFACE_TRIGGER_BOARD_STM32F405_PINS_H
/* A pin's function: RM0090 "GPIO registers"; alternate functions: data sheet DS8626 "Alternate
 * function mapping". */
#include "firmware_iface/trigger/board/stm32f405/registers.h"

enum { pin_input = 0, pin_alternate = 2 };

static inline void pin_set(GpioRegisters* port, unsigned pin, uint32_t mode, uint32_t alternate) {
  const unsigned half = 4U * (pin % 8U);
  port->afr[pin / 8U] = (port->afr[pin / 8U] & ~(0xFU << half)) | (alternate << half);
  port->moder = (port->moder & ~(3U << (2U * pin))) |
                (mode << (2U * pin)); /* last: no edge of another function */
}

#endif
