#ifndef VERGENCE_FIRMWARE_IFACE_TRIGGER_BOARD_STM32F405_REGISTERS_H
#define VERGENCE_FIRMWARE_IFACE_TRIGGER_BOARD_STM32F405_REGISTERS_H
/*
 * The registers that the port uses, by the chapters of the reference manual RM0090 (STM32F405/415…)
 * and, for the core, of the Cortex-M4 programming manual PM0214. Base addresses: RM0090 "Memory
 * map".
 */
#include <stdint.h>

typedef volatile uint32_t Register;

/* "Reset and clock control (RCC)" */
typedef struct {
  Register cr, pllcfgr, cfgr, cir, ahb1rstr, ahb2rstr, ahb3rstr, reserved_1c, apb1rstr, apb2rstr,
      reserved_28[2], ahb1enr, ahb2enr, ahb3enr, reserved_3c, apb1enr, apb2enr;
} RccRegisters;

/* "General-purpose I/Os (GPIO)" */
typedef struct {
  Register moder, otyper, ospeedr, pupdr, idr, odr, bsrr, lckr, afr[2];
} GpioRegisters;

/* "General-purpose timers (TIM2 to TIM5)" */
typedef struct {
  Register cr1, cr2, smcr, dier, sr, egr, ccmr[2], ccer, cnt, psc, arr, reserved_30, ccr[4];
} TimerRegisters;

/* "Universal synchronous asynchronous receiver transmitter (USART)" */
typedef struct {
  Register sr, dr, brr, cr1, cr2, cr3;
} UsartRegisters;

/* "Interrupts and events": EXTI */
typedef struct {
  Register imr, emr, rtsr, ftsr, swier, pr;
} ExtiRegisters;

/* "System configuration controller (SYSCFG)" */
typedef struct {
  Register memrmp, pmc, exticr[4];
} SyscfgRegisters;

/* "Independent watchdog (IWDG)" */
typedef struct {
  Register kr, pr, rlr, sr;
} WatchdogRegisters;

/* "Random number generator (RNG)" */
typedef struct {
  Register cr, sr, dr;
} RandomRegisters;

#define RCC ((RccRegisters*)0x40023800UL)
#define GPIOA ((GpioRegisters*)0x40020000UL)
#define GPIOB ((GpioRegisters*)0x40020400UL)
#define TIM2 ((TimerRegisters*)0x40000000UL)
#define TIM4 ((TimerRegisters*)0x40000800UL)
#define TIM5 ((TimerRegisters*)0x40000C00UL)
#define USART1 ((UsartRegisters*)0x40011000UL)
#define EXTI ((ExtiRegisters*)0x40013C00UL)
#define SYSCFG ((SyscfgRegisters*)0x40013800UL)
#define IWDG ((WatchdogRegisters*)0x40003000UL)
#define RNG ((RandomRegisters*)0x50060800UL)
#define FLASH_ACR                                                                  \
  (*(Register*)0x40023C00UL)  /* "Embedded Flash memory interface": access control \
                               */
#define UNIQUE_ID 0x1FFF7A10U /* "Device electronic signature": 96 bits */

/* PM0214 "Nested vectored interrupt controller", "System control block" */
#define NVIC_ISER ((Register*)0xE000E100UL)
#define NVIC_ICER ((Register*)0xE000E180UL)
#define NVIC_ICPR ((Register*)0xE000E280UL)
#define NVIC_IPR ((volatile uint8_t*)0xE000E400UL)
#define SYSTICK_CTRL (*(Register*)0xE000E010UL)
#define SCB_VTOR (*(Register*)0xE000ED08UL)
#define SCB_AIRCR (*(Register*)0xE000ED0CUL)
#define SCB_SHCSR (*(Register*)0xE000ED24UL)
#define SCB_CFSR (*(Register*)0xE000ED28UL)

/* Positions in the vector table: RM0090 "Interrupts and events", vector table for STM32F405. */
enum { irq_exti9_5 = 23, irq_tim2 = 28, irq_usart1 = 37, irq_tim5 = 50, irq_count = 82 };

#endif
