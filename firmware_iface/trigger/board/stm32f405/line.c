/*
 * The line to the host: USART1 on PA9 (TX) and PA10 (RX), alternate function 7, 921600 baud 8N1.
 * RM0090 "USART". Received bytes are stamped in the interrupt; sending is polled, which tells the
 * moment of a frame's first bit.
 */
#include "firmware_iface/trigger/board/hal.h"
#include "firmware_iface/trigger/board/stm32f405/pins.h"
#include "firmware_iface/trigger/board/stm32f405/port.h"

enum {
  baud = 921600,
  sr_ore = 1 << 3,
  sr_rxne = 1 << 5,
  sr_tc = 1 << 6,
  sr_txe = 1 << 7,
  cr1_re = 1 << 2,
  cr1_te = 1 << 3,
  cr1_rxneie = 1 << 5,
  cr1_ue = 1 << 13
};

static ByteRing received;

void line_start(uint32_t clock_hz) {
  GPIOA->pupdr =
      (GPIOA->pupdr & ~(3U << 20U)) | (1U << 20U); /* PA10: pull-up, a line without host is idle */
  pin_set(GPIOA, 9, pin_alternate, 7);
  pin_set(GPIOA, 10, pin_alternate, 7);
  USART1->brr = (clock_hz + baud / 2) /
                baud; /* sixteen times oversampled: the divider in sixteenths is clock / baud */
  USART1->cr1 = cr1_ue | cr1_te | cr1_re | cr1_rxneie;
  irq_enable(irq_usart1, 0x20); /* below those that stamp edges */
}

/* An overrun lost a byte: its frame fails the CRC and is counted there. Reading sr, then dr clears
 * both flags. */
void usart1_handler(void) {
  const uint32_t status = USART1->sr;
  if ((status & (sr_rxne | sr_ore)) == 0) return;
  const uint8_t byte = (uint8_t)USART1->dr;
  if ((status & sr_rxne) != 0) byte_push(&received, (ByteRecord){.count = hal_now(), .byte = byte});
}

bool hal_received(ByteRecord* record) { return byte_pop(&received, record); }

bool hal_line_idle(void) { return (USART1->sr & sr_tc) != 0; }

bool hal_send(uint8_t byte) {
  if ((USART1->sr & sr_txe) == 0) return false;
  USART1->dr = byte;
  return true;
}
