/* The processor's own: interrupts (PM0214 "NVIC"), and loads where the bus may have nothing. */
#include "firmware_iface/trigger/board/stm32f405/port.h"
#include "firmware_iface/trigger/board/stm32f405/registers.h"

static volatile bool probing, absent;

/* A load from an address where the bus may have nothing. The instruction is two bytes long: the
 * fault handler steps over it. */
bool probe_word(uint32_t address, uint32_t* word) {
  register uint32_t value __asm("r3") = 0;
  absent = false;
  probing = true;
  __asm volatile("ldr.n %0, [%1]\n dsb" : "+l"(value) : "l"(address) : "memory");
  probing = false;
  *word = absent ? 0 : value;
  return !absent;
}

/* stacked: r0 r1 r2 r3 r12 lr pc xpsr (PM0214 "Exception entry"). */
__attribute__((used)) static void on_bus_fault(uint32_t* stacked) {
  if (!probing) restart();
  absent = true;
  stacked[6] += 2;
  SCB_CFSR = SCB_CFSR; /* cleared by writing ones */
}

__attribute__((naked)) void bus_fault_handler(void) {
  __asm volatile("mrs r0, msp\n b on_bus_fault");
}

void irq_enable(unsigned irq, uint8_t priority) {
  NVIC_IPR[irq] = priority;
  NVIC_ISER[irq / 32U] = 1U << (irq % 32U);
}

uint32_t irq_off(void) {
  uint32_t primask = 0;
  __asm volatile("mrs %0, primask\n cpsid i" : "=r"(primask)::"memory");
  return primask;
}

void irq_restore(uint32_t primask) { __asm volatile("msr primask, %0" ::"r"(primask) : "memory"); }
