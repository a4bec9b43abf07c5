#include "firmware_iface/trigger/board/board.h"

#include "firmware_iface/trigger/board/board_internal.h"

enum {
  slots_a_poll = 64, /* left out at most in one call: a long pause is walked through in several */
  arm_ahead_divisor = 4, /* armed at most a quarter of a second ahead: half a turn of a 32-bit
                            counter at 1 GHz is two */
  flag_first = 1,
  flag_late = 2
};

/* ---- messages ---- */

void board_put_status(TriggerBoard* board, uint64_t now, uint8_t* payload) {
  const TriggerDecoder* decoder = &board->decoder;
  TriggerStatus status = {0};
  status.boot_id = board->boot_id;
  status.tick = tick_of(&board->ticks, now);
  status.pulses = board->schedule.next;
  status.configuration = board->config_crc;
  status.frames_refused =
      decoder->bad_coding + decoder->bad_length + decoder->bad_crc + board->wrong_sizes;
  status.events_dropped = board->outbox.dropped;
  status.edges_dropped = board->edges_dropped;
  status.pps_age_ms = UINT32_MAX;
  if (board->pps_edges != 0) {
    const uint64_t age = now > board->last_pps
                             ? (now - board->last_pps) / (board->description.counts_hz / 1000U)
                             : 0;
    status.pps_age_ms = age < UINT32_MAX ? (uint32_t)age : UINT32_MAX - 1U;
  }
  status.state = board->state;
  status.pps_locked = board->ticks.locked ? 1 : 0;
  board->reported_state = status.state;
  board->reported_locked = status.pps_locked;
  trigger_put_status(&status, payload);
}

void board_answer_status(TriggerBoard* board, uint64_t now, uint8_t sequence) {
  uint8_t payload[trigger_status_payload_size];
  board_put_status(board, now, payload);
  outbox_answer(&board->outbox, trigger_status, sequence, payload, sizeof payload);
}

static void report_edge(TriggerBoard* board, TriggerType type, uint32_t count, uint64_t at) {
  const TriggerEdge edge = {board->boot_id, count, tick_of(&board->ticks, at)};
  uint8_t payload[trigger_edge_payload_size];
  trigger_put_edge(&edge, payload);
  outbox_send(&board->outbox, (uint8_t)type, payload, sizeof payload);
}

/* ---- the pulse whose exposures are collected ---- */

void board_close_event(TriggerBoard* board) {
  uint8_t payload[trigger_event_payload_size];
  if (!board->event.open) return;
  board->event.open = false;
  trigger_put_event(&board->event.event, payload);
  outbox_send(&board->outbox, trigger_event, payload, sizeof payload);
}

static void open_event(TriggerBoard* board, uint64_t count, uint8_t flags) {
  OpenEvent* open = &board->event;
  open->open = true;
  open->waiting = board->config.feedback_inputs & board->config.lines;
  open->count = count;
  open->close_at = count + board->schedule.interval + board->schedule.vary;
  open->event.boot_id = board->boot_id;
  open->event.pulse = board->schedule.next;
  open->event.tick = tick_of(&board->ticks, count);
  open->event.lines = board->config.lines;
  open->event.flags = flags;
  for (unsigned k = 0; k < trigger_max_lines; ++k) {
    open->event.exposure[k].start_us = TRIGGER_NOT_SEEN;
    open->event.exposure[k].end_us = TRIGGER_NOT_SEEN;
  }
  if (open->waiting == 0) board_close_event(board);
}

/* An end without its start belongs to an exposure that began before this pulse: no end of this one.
 */
static void feedback_edge(TriggerBoard* board, unsigned input, bool rising, uint64_t count) {
  OpenEvent* open = &board->event;
  const unsigned bit = 1U << input;
  if (!open->open || (open->waiting & bit) == 0 || count < open->count) return;
  const bool active = rising != ((board->config.feedback_active_low & bit) != 0);
  TriggerExposure* exposure = &open->event.exposure[input];
  const uint64_t after = tick_length(&board->ticks, count - open->count);
  const int32_t after_us = after < INT32_MAX ? (int32_t)after : INT32_MAX;
  if (active) {
    if (exposure->start_us == TRIGGER_NOT_SEEN) exposure->start_us = after_us;
    return;
  }
  if (exposure->start_us == TRIGGER_NOT_SEEN) return;
  exposure->end_us = after_us;
  open->waiting = (uint8_t)(open->waiting & ~bit);
  if (open->waiting == 0) board_close_event(board);
}

void board_finish_stop(TriggerBoard* board, uint64_t now) {
  board->stop_asked = false;
  board->state = trigger_stopped;
  board->left_out = 0;
  board_answer_status(board, now, board->stop_sequence);
}

/* ---- what the hardware stamps ---- */

void board_edge(TriggerBoard* board, uint64_t now, BoardInput input, bool rising, uint64_t count) {
  const uint8_t edge = rising ? trigger_edge_rising : trigger_edge_falling;
  if (input == board_input_pps) {
    if (board->config.pps_edge != edge) return;
    board->last_pps = count;
    report_edge(board, trigger_pps, board->pps_edges++, count);
    (void)tick_pps(&board->ticks, count, now);
  } else if (input == board_input_ins) {
    if (board->config.ins_edge != edge) return;
    report_edge(board, trigger_ins, board->ins_edges++, count);
  } else {
    feedback_edge(board, (unsigned)input - board_input_feedback, rising, count);
  }
}

void board_edges_lost(TriggerBoard* board, uint32_t edges) { board->edges_dropped += edges; }

void board_pulse_made(TriggerBoard* board, uint64_t now, uint64_t count, bool late) {
  if (!board->armed) return;
  const unsigned flags =
      (board->first_pulse ? flag_first : 0U) | (late || board->armed_late ? flag_late : 0U);
  board->armed = false;
  board->armed_late = false;
  board->first_pulse = false;
  board_close_event(board);
  open_event(board, count, (uint8_t)flags);
  schedule_advance(&board->schedule);
  if (board->stop_asked) board_finish_stop(board, now);
}

/* ---- what happens by itself ---- */

static void next_slot(TriggerBoard* board) {
  schedule_advance(&board->schedule);
  if (board->state != trigger_paused) {
    board->armed_late = true; /* nobody asked for this gap: the next pulse says so */
    return;
  }
  if (--board->left_out > 0) return;
  board->state = trigger_running;
  board->first_pulse = true;
}

/* The next slot is left out: in a pause when its time has come, else when half its interval is over
 * before it could be armed. */
static bool slot_is_over(const TriggerBoard* board, uint64_t now) {
  if (board->state == trigger_stopped || board->armed) return false;
  if (board->state == trigger_paused) return board->schedule.due <= now;
  return board->schedule.due + board->schedule.interval / 2U < now;
}

void board_poll(TriggerBoard* board, uint64_t now) {
  tick_advance(&board->ticks, now);
  for (unsigned n = 0; n < slots_a_poll && slot_is_over(board, now); ++n) next_slot(board);
  if (board->event.open && now >= board->event.close_at) board_close_event(board);
  const uint8_t locked = board->ticks.locked ? 1 : 0;
  if (now < board->status_due && board->state == board->reported_state &&
      locked == board->reported_locked)
    return;
  uint8_t payload[trigger_status_payload_size];
  board_put_status(board, now, payload);
  outbox_send(&board->outbox, trigger_status, payload, sizeof payload);
  board->status_due = now + board->description.counts_hz;
}

bool board_schedule_pulse(TriggerBoard* board, uint64_t now, BoardPulse* pulse) {
  const PulseSchedule* schedule = &board->schedule;
  const uint64_t earliest = now + board_counts_of_us(board, board_lead_us);
  if (board->state != trigger_running || board->armed || slot_is_over(board, now)) return false;
  if (schedule->due > now + board->description.counts_hz / arm_ahead_divisor) return false;
  const bool late = schedule->due < earliest;
  board->armed = true;
  board->armed_late = board->armed_late || late;
  pulse->count = late ? earliest : schedule->due;
  pulse->width = board_counts_of_us(board, board->config.pulse_us);
  pulse->number = schedule->next;
  pulse->lines = board->config.lines;
  pulse->active_low = board->config.active_low;
  return true;
}

void board_pulse_refused(TriggerBoard* board) { board->armed = false; }

bool board_wants_disarm(const TriggerBoard* board) { return board->armed && board->stop_asked; }

void board_pulse_disarmed(TriggerBoard* board, uint64_t now) {
  board->armed = false;
  board->armed_late = false;
  if (board->stop_asked) board_finish_stop(board, now);
}

size_t board_send(TriggerBoard* board, uint64_t departure, uint8_t* out) {
  OutboxMessage* message = outbox_front(&board->outbox);
  if (message == NULL) return 0;
  if (message->type == trigger_pong)
    (void)trigger_put_bytes(message->payload + 16, tick_of(&board->ticks, departure), 8);
  const size_t size =
      trigger_write_frame(message->type, message->sequence, message->payload, message->size, out);
  outbox_pop(&board->outbox);
  return size;
}

static uint64_t sooner(uint64_t a, uint64_t b) { return a < b ? a : b; }

uint64_t board_deadline(const TriggerBoard* board) {
  uint64_t at = board->status_due;
  if (board->event.open) at = sooner(at, board->event.close_at);
  if (board->state == trigger_stopped || board->armed) return at;
  const uint64_t ahead = board->description.counts_hz / arm_ahead_divisor;
  const uint64_t due = board->schedule.due;
  if (board->state == trigger_paused) return sooner(at, due);
  return sooner(at, due > ahead ? due - ahead : 0);
}

const TriggerConfig* board_configuration(const TriggerBoard* board) { return &board->config; }

uint64_t board_tick(const TriggerBoard* board, uint64_t count) {
  return tick_of(&board->ticks, count);
}

void board_init(TriggerBoard* board, const BoardDescription* description, uint32_t boot_id,
                uint64_t now) {
  memset(board, 0, sizeof *board);
  board->description = *description;
  board->boot_id = boot_id;
  board->state = trigger_stopped;
  board->status_due = now; /* the first thing that is said: here I am */
  tick_init(&board->ticks, description->counts_hz, description->crystal_ppm, now);
}
