#ifndef VERGENCE_FIRMWARE_IFACE_TRIGGER_BOARD_BOARD_H
#define VERGENCE_FIRMWARE_IFACE_TRIGGER_BOARD_BOARD_H
/*
 * The trigger board without its hardware: what it answers, when it pulses, which exposure belongs
 * to which pulse, what time it is. The firmware (board/firmware.c on a port's hardware layer), the
 * simulated board and the tests drive this same code.
 *
 * Drive it   board_init(), then in a loop, in this order, as often as there is something to do and
 * at the latest at board_deadline(): board_edge(), board_pulse_made()   what the hardware stamped,
 * oldest first board_receive()                    each byte from the host with the count of its
 * arrival board_poll() board_wants_disarm()               true: take back the pulse that is armed,
 * then board_pulse_disarmed(); if it has gone out in the meantime board_pulse_made() comes instead
 *              board_schedule_pulse()                 true: arm this pulse in hardware (or
 * board_pulse_refused()), later board_pulse_made() board_send()                       one frame for
 * the host, when the line has room for trigger_max_frame bytes Ownership  Everything is in the
 * caller's TriggerBoard; several boards in one process know nothing of each other. Threads    One
 * at a time. Interrupts hand over what they stamped in a RecordRing (records.h). Memory     Fixed,
 * no heap. Messages that find no room are dropped and counted (outbox.h). Time       Counts: the
 * hardware's free-running counter, 64 bits, never back, counts_hz a second. `now` never decreases
 * from call to call; stamps may be older than `now`. On the wire counts become ticks
 * (discipline.h). Errors     What comes from the wire is refused by ERROR or counted. Preconditions
 * are the caller's; nothing else can fail.
 */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware_iface/trigger/board/discipline.h"
#include "firmware_iface/trigger/board/outbox.h"
#include "firmware_iface/trigger/board/schedule.h"
#include "firmware_iface/trigger/trigger.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
  board_firmware_major = 1,
  board_firmware_minor = 0,
  board_firmware_patch = 0,
  board_max_pulse_us = 1000000,
  board_lead_us = 50 /* a pulse is armed at least so long before its edge */
};

/* What the hardware is. */
typedef struct {
  uint32_t counts_hz;      /* 1 MHz .. 1 GHz */
  uint32_t crystal_ppm;    /* how far counts_hz may be off */
  uint32_t max_millihertz; /* fastest rate the timer makes; at most 2 000 000 */
  uint8_t lines;           /* number of outputs, at most trigger_max_lines */
  uint8_t feedback_inputs; /* number, at most `lines`: input k is wired to the camera of line k */
  bool has_pps, has_ins;
  uint8_t serial[12];
} BoardDescription;

/* Inputs; feedback k is board_input_feedback + k. */
typedef enum { board_input_pps = 0, board_input_ins = 1, board_input_feedback = 2 } BoardInput;

/* A pulse to be armed: active from `count` on for `width` counts, on the lines of the mask; active
 * is low where active_low says. */
typedef struct {
  uint64_t count, width;
  uint32_t number;
  uint8_t lines, active_low;
} BoardPulse;

/* The pulse whose exposures are being collected. */
typedef struct {
  bool open;
  uint8_t waiting; /* mask of feedback inputs whose end is still to come */
  uint64_t count;
  uint64_t close_at;
  TriggerEvent event;
} OpenEvent;

typedef struct {
  BoardDescription description;
  uint32_t boot_id;
  TickDiscipline ticks;
  TriggerDecoder decoder;
  Outbox outbox;
  PulseSchedule schedule;
  OpenEvent event;
  TriggerConfig config;
  uint32_t config_crc; /* 0: none */
  uint8_t state;       /* TriggerState */
  uint32_t left_out;   /* pulses that a PAUSE still leaves out */
  bool first_pulse;    /* the next one is the first after START or a pause */
  bool armed;          /* a pulse is in the hardware's hands */
  bool armed_late;
  bool stop_asked; /* STOP is answered when the armed pulse is back or out */
  uint8_t stop_sequence;
  uint8_t reported_state, reported_locked;
  uint64_t status_due;
  uint32_t pps_edges, ins_edges;
  uint64_t last_pps;
  uint32_t edges_dropped;
  uint32_t wrong_sizes;
} TriggerBoard;

/* boot_id: differs at every start. */
void board_init(TriggerBoard* board, const BoardDescription* description, uint32_t boot_id,
                uint64_t now);

/* One byte from the host, whose last bit came at `count` (`now` where the hardware does not stamp
 * it). */
void board_receive(TriggerBoard* board, uint64_t now, uint64_t count, uint8_t byte);
/* An input's level changed at `count`. Precondition: as many inputs as described. */
void board_edge(TriggerBoard* board, uint64_t now, BoardInput input, bool rising, uint64_t count);
/* The armed pulse's leading edge was made at `count`. Ignored when none is armed. late: not by the
 * compare unit, or not when it was due. */
void board_pulse_made(TriggerBoard* board, uint64_t now, uint64_t count, bool late);
/* So many stamped edges found no room before they came here. */
void board_edges_lost(TriggerBoard* board, uint32_t edges);
/* What is due by itself: slots left out, events that close, STATUS. */
void board_poll(TriggerBoard* board, uint64_t now);

/* True: *pulse is to be armed now; it is at least board_lead_us away and at most 250 ms. */
bool board_schedule_pulse(TriggerBoard* board, uint64_t now, BoardPulse* pulse);
/* The pulse just taken could not be armed in time: board_schedule_pulse() gives it again, later and
 * marked late. */
void board_pulse_refused(TriggerBoard* board);
bool board_wants_disarm(const TriggerBoard* board);
void board_pulse_disarmed(TriggerBoard* board, uint64_t now);

/* The next frame for the host into out[trigger_max_frame]; its first bit leaves at `departure`.
 * Returns its size, 0: none. */
size_t board_send(TriggerBoard* board, uint64_t departure, uint8_t* out);

/* Count at which board_poll() or board_schedule_pulse() has something to do at the latest. */
uint64_t board_deadline(const TriggerBoard* board);
/* In effect; all zero before the first CONFIG. Ports set their inputs by it. */
const TriggerConfig* board_configuration(const TriggerBoard* board);
/* Tick of a count, as the wire shows it. */
uint64_t board_tick(const TriggerBoard* board, uint64_t count);

#ifdef __cplusplus
}
#endif
#endif
