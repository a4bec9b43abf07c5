#include "firmware_iface/trigger/board/board.h"
#include "firmware_iface/trigger/board/board_internal.h"

/* What the host asks, and the answers. */

enum { start_lead_us = 1000 /* from START to the first edge */ };

static void answer_error(TriggerBoard* board, const TriggerFrame* frame, TriggerErrorCode code) {
  const TriggerError error = {frame->type, (uint8_t)code};
  uint8_t payload[trigger_error_payload_size];
  trigger_put_error(&error, payload);
  outbox_answer(&board->outbox, trigger_error, frame->sequence, payload, sizeof payload);
}

static void on_hello(TriggerBoard* board, const TriggerFrame* frame) {
  const BoardDescription* description = &board->description;
  if (frame->payload[0] != trigger_protocol_version) {
    answer_error(board, frame, trigger_error_version);
    return;
  }
  TriggerInfo info = {0};
  info.version = trigger_protocol_version;
  info.firmware_major = board_firmware_major;
  info.firmware_minor = board_firmware_minor;
  info.firmware_patch = board_firmware_patch;
  info.boot_id = board->boot_id;
  info.tick_hz = description->counts_hz;
  info.lines = description->lines;
  info.feedback_inputs = description->feedback_inputs;
  info.has_pps = description->has_pps ? 1 : 0;
  info.has_ins = description->has_ins ? 1 : 0;
  memcpy(info.serial, description->serial, sizeof info.serial);
  uint8_t payload[trigger_info_payload_size];
  trigger_put_info(&info, payload);
  outbox_answer(&board->outbox, trigger_info, frame->sequence, payload, sizeof payload);
  tick_hold_rate(&board->ticks);
}

static bool input_exists(uint8_t edge, bool wired) {
  return edge <= trigger_edge_falling && (edge == trigger_edge_none || wired);
}

/* 0: the board can do this, and *schedule is set for it; else a TriggerErrorCode. */
static uint8_t refusal(const TriggerBoard* board, const TriggerConfig* config,
                       PulseSchedule* schedule) {
  const BoardDescription* description = &board->description;
  const unsigned lines = (1U << description->lines) - 1U;
  const unsigned inputs = (1U << description->feedback_inputs) - 1U;
  if (config->lines == 0 || ((unsigned)(config->lines | config->active_low) & ~lines) != 0)
    return trigger_error_line;
  if (((unsigned)(config->feedback_inputs | config->feedback_active_low) & ~inputs) != 0)
    return trigger_error_line;
  if (!input_exists(config->pps_edge, description->has_pps) ||
      !input_exists(config->ins_edge, description->has_ins))
    return trigger_error_line;
  if (config->rate_millihertz == 0 || config->rate_millihertz > description->max_millihertz)
    return trigger_error_rate;
  schedule_set(schedule, description->counts_hz, config->rate_millihertz, config->dither_us);
  if (schedule_shortest(schedule) <
      (uint64_t)description->counts_hz * 1000U / description->max_millihertz)
    return trigger_error_rate;
  if (config->pulse_us == 0 || config->pulse_us > board_max_pulse_us) return trigger_error_pulse;
  if (board_counts_of_us(board, config->pulse_us) >= schedule_shortest(schedule))
    return trigger_error_pulse;
  return 0;
}

static void on_config(TriggerBoard* board, const TriggerFrame* frame, uint64_t now) {
  TriggerConfig config = {0};
  PulseSchedule schedule = board->schedule;
  (void)trigger_get_config(frame->payload, frame->size, &config); /* its size was checked */
  if (board->state != trigger_stopped) {
    answer_error(board, frame, trigger_error_not_stopped);
    return;
  }
  const uint8_t code = refusal(board, &config, &schedule);
  if (code != 0) {
    answer_error(board, frame, (TriggerErrorCode)code);
    return;
  }
  board_close_event(board);
  board->config = config;
  board->schedule = schedule;
  board->config_crc = trigger_crc32(frame->payload, frame->size);
  board_answer_status(board, now, frame->sequence);
}

static void on_start(TriggerBoard* board, const TriggerFrame* frame, uint64_t now) {
  if (board->config_crc == 0) {
    answer_error(board, frame, trigger_error_not_configured);
    return;
  }
  if (board->stop_asked) {
    answer_error(board, frame, trigger_error_not_stopped);
    return;
  }
  if (board->state == trigger_stopped) {
    board->state = trigger_running;
    board->left_out = 0;
    board->first_pulse = true;
    schedule_begin(&board->schedule, now + board_counts_of_us(board, start_lead_us));
  }
  board_answer_status(board, now, frame->sequence);
}

static void on_stop(TriggerBoard* board, const TriggerFrame* frame, uint64_t now) {
  if (board->stop_asked) {
    answer_error(board, frame, trigger_error_not_stopped);
    return;
  }
  board->stop_sequence = frame->sequence;
  board->stop_asked = board->armed;
  if (!board->armed) board_finish_stop(board, now);
}

static void on_pause(TriggerBoard* board, const TriggerFrame* frame, uint64_t now) {
  TriggerPause pause = {0};
  (void)trigger_get_pause(frame->payload, frame->size, &pause);
  if (board->state == trigger_stopped) {
    answer_error(board, frame, trigger_error_not_running);
    return;
  }
  if (board->state == trigger_paused) board->first_pulse = true; /* also when this PAUSE is none */
  board->left_out = pause.pulses;
  board->state = pause.pulses == 0 ? trigger_running : trigger_paused;
  board_answer_status(board, now, frame->sequence);
}

static void on_ping(TriggerBoard* board, const TriggerFrame* frame, uint64_t count) {
  TriggerPing ping = {0};
  (void)trigger_get_ping(frame->payload, frame->size, &ping);
  const TriggerPong pong = {ping.token, board->boot_id, tick_of(&board->ticks, count), 0};
  uint8_t payload[trigger_pong_payload_size];
  trigger_put_pong(&pong, payload);
  outbox_answer(&board->outbox, trigger_pong, frame->sequence, payload, sizeof payload);
}

/* Payload size of what a host may send; −1: no such message. */
static int size_of(uint8_t type) {
  switch (type) {
    case trigger_hello:
      return 1;
    case trigger_config:
      return trigger_config_payload_size;
    case trigger_start:
    case trigger_stop:
      return 0;
    case trigger_pause:
      return trigger_pause_payload_size;
    case trigger_ping:
      return trigger_ping_payload_size;
    default:
      return -1;
  }
}

void board_receive(TriggerBoard* board, uint64_t now, uint64_t count, uint8_t byte) {
  TriggerFrame frame;
  if (trigger_decode(&board->decoder, byte, &frame) != trigger_frame_ready) return;
  const int size = size_of(frame.type);
  if (size < 0) {
    answer_error(board, &frame, trigger_error_unknown_type);
    return;
  }
  if (frame.size != size) {
    ++board->wrong_sizes;
    answer_error(board, &frame, trigger_error_wrong_size);
    return;
  }
  switch (frame.type) {
    case trigger_hello:
      on_hello(board, &frame);
      break;
    case trigger_config:
      on_config(board, &frame, now);
      break;
    case trigger_start:
      on_start(board, &frame, now);
      break;
    case trigger_stop:
      on_stop(board, &frame, now);
      break;
    case trigger_pause:
      on_pause(board, &frame, now);
      break;
    default:
      on_ping(board, &frame, count);
      break;
  }
}
