#ifndef VERGENCE_FIRMWARE_IFACE_TRIGGER_BOARD_HAL_H
#define VERGENCE_FIRMWARE_IFACE_TRIGGER_BOARD_HAL_H
/*
 * What a port provides: this and an entry point that calls firmware_main().
 * firmware_iface/trigger/README.md says how to write one.
 *
 * Threads    The main loop calls; interrupts only stamp edges and bytes into rings.
 * Time       One free-running 32-bit counter; an edge is made or stamped by it in hardware.
 * Errors     Every wait for hardware is bounded and has a fallback that is told: a worse clock in
 * hal_describe(), a late pulse.
 */
#include <stdbool.h>
#include <stdint.h>

#include "firmware_iface/trigger/board/board.h"
#include "firmware_iface/trigger/board/records.h"

/* Clocks, counter, line, interrupts. Outputs stay high-impedance. */
void hal_start(void);
/* What hal_start() found. */
void hal_describe(BoardDescription* description);
/* Another number at every start. */
uint32_t hal_boot_id(void);
/* The counter. */
uint32_t hal_now(void);
/* Inputs and outputs as configured; only while stopped. All lines inactive. */
void hal_configure(const TriggerConfig* config);
/* The compare unit makes the edges of this pulse, and a record_pulse of the leading one. False: too
 * late, nothing is armed. */
bool hal_arm(uint32_t count, uint32_t width, uint8_t lines);
/* True: the armed pulse is taken back. False: it has gone out or is about to; its record comes. */
bool hal_disarm(void);
/* Edges that the compare unit should long have made are made now, the leading one with a late
 * record_pulse. */
void hal_check_pulse(void);
/* The oldest stamped edge. */
bool hal_stamped(StampRecord* record);
/* Edges that found no room since start. */
uint32_t hal_stamps_lost(void);
/* The oldest received byte. */
bool hal_received(ByteRecord* record);
/* All bits of what was sent are out: the next byte's first bit leaves at once. */
bool hal_line_idle(void);
/* False: no room, try again. */
bool hal_send(uint8_t byte);
/* To be called at least every 100 ms, else the board starts anew. */
void hal_feed_watchdog(void);

/* The main loop; never returns. */
void firmware_main(void);

#endif
