#ifndef VERGENCE_FIRMWARE_IFACE_TRIGGER_PAYLOADS_H
#define VERGENCE_FIRMWARE_IFACE_TRIGGER_PAYLOADS_H
/*
 * Messages to bytes and back: little endian, without padding. put writes exactly the payload's
 * size; get is false, *m untouched, for any other size.
 */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "firmware_iface/trigger/messages.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- bytes ---- */

static inline uint8_t* trigger_put_bytes(uint8_t* at, uint64_t value, unsigned bytes) {
  for (unsigned i = 0; i < bytes; ++i) at[i] = (uint8_t)(value >> (8U * i));
  return at + bytes;
}

static inline uint64_t trigger_get_bytes(const uint8_t* at, unsigned bytes) {
  uint64_t value = 0;
  for (unsigned i = bytes; i-- > 0U;) value = (value << 8U) | at[i];
  return value;
}

static inline uint32_t trigger_get_u32(const uint8_t* at) {
  return (uint32_t)trigger_get_bytes(at, 4);
}

/* Two's complement without a conversion whose result the language leaves open. */
static inline int32_t trigger_get_i32(const uint8_t* at) {
  const uint32_t bits = trigger_get_u32(at);
  int32_t value = 0;
  memcpy(&value, &bits, sizeof value);
  return value;
}

/* ---- payloads: put writes exactly the payload's size; get is false, *m untouched, for any other
 * size ---- */

static inline void trigger_put_info(const TriggerInfo* m, uint8_t* p) {
  p = trigger_put_bytes(p, m->version, 1);
  p = trigger_put_bytes(p, m->firmware_major, 1);
  p = trigger_put_bytes(p, m->firmware_minor, 1);
  p = trigger_put_bytes(p, m->firmware_patch, 1);
  p = trigger_put_bytes(p, m->boot_id, 4);
  p = trigger_put_bytes(p, m->tick_hz, 4);
  p = trigger_put_bytes(p, m->lines, 1);
  p = trigger_put_bytes(p, m->feedback_inputs, 1);
  p = trigger_put_bytes(p, m->has_pps, 1);
  p = trigger_put_bytes(p, m->has_ins, 1);
  memcpy(p, m->serial, sizeof m->serial);
}

static inline bool trigger_get_info(const uint8_t* p, size_t size, TriggerInfo* m) {
  if (size != trigger_info_payload_size) return false;
  m->version = p[0];
  m->firmware_major = p[1];
  m->firmware_minor = p[2];
  m->firmware_patch = p[3];
  m->boot_id = trigger_get_u32(p + 4);
  m->tick_hz = trigger_get_u32(p + 8);
  m->lines = p[12];
  m->feedback_inputs = p[13];
  m->has_pps = p[14];
  m->has_ins = p[15];
  memcpy(m->serial, p + 16, sizeof m->serial);
  return true;
}

static inline void trigger_put_config(const TriggerConfig* m, uint8_t* p) {
  p = trigger_put_bytes(p, m->rate_millihertz, 4);
  p = trigger_put_bytes(p, m->pulse_us, 4);
  p = trigger_put_bytes(p, m->dither_us, 4);
  p = trigger_put_bytes(p, m->lines, 1);
  p = trigger_put_bytes(p, m->active_low, 1);
  p = trigger_put_bytes(p, m->feedback_inputs, 1);
  p = trigger_put_bytes(p, m->feedback_active_low, 1);
  p = trigger_put_bytes(p, m->pps_edge, 1);
  (void)trigger_put_bytes(p, m->ins_edge, 1);
}

static inline bool trigger_get_config(const uint8_t* p, size_t size, TriggerConfig* m) {
  if (size != trigger_config_payload_size) return false;
  m->rate_millihertz = trigger_get_u32(p);
  m->pulse_us = trigger_get_u32(p + 4);
  m->dither_us = trigger_get_u32(p + 8);
  m->lines = p[12];
  m->active_low = p[13];
  m->feedback_inputs = p[14];
  m->feedback_active_low = p[15];
  m->pps_edge = p[16];
  m->ins_edge = p[17];
  return true;
}

static inline void trigger_put_pause(const TriggerPause* m, uint8_t* p) {
  (void)trigger_put_bytes(p, m->pulses, 4);
}

static inline bool trigger_get_pause(const uint8_t* p, size_t size, TriggerPause* m) {
  if (size != trigger_pause_payload_size) return false;
  m->pulses = trigger_get_u32(p);
  return true;
}

static inline void trigger_put_ping(const TriggerPing* m, uint8_t* p) {
  (void)trigger_put_bytes(p, m->token, 4);
}

static inline bool trigger_get_ping(const uint8_t* p, size_t size, TriggerPing* m) {
  if (size != trigger_ping_payload_size) return false;
  m->token = trigger_get_u32(p);
  return true;
}

static inline void trigger_put_pong(const TriggerPong* m, uint8_t* p) {
  p = trigger_put_bytes(p, m->token, 4);
  p = trigger_put_bytes(p, m->boot_id, 4);
  p = trigger_put_bytes(p, m->received, 8);
  (void)trigger_put_bytes(p, m->sent, 8);
}

static inline bool trigger_get_pong(const uint8_t* p, size_t size, TriggerPong* m) {
  if (size != trigger_pong_payload_size) return false;
  m->token = trigger_get_u32(p);
  m->boot_id = trigger_get_u32(p + 4);
  m->received = trigger_get_bytes(p + 8, 8);
  m->sent = trigger_get_bytes(p + 16, 8);
  return true;
}

static inline void trigger_put_event(const TriggerEvent* m, uint8_t* p) {
  p = trigger_put_bytes(p, m->boot_id, 4);
  p = trigger_put_bytes(p, m->pulse, 4);
  p = trigger_put_bytes(p, m->tick, 8);
  p = trigger_put_bytes(p, m->lines, 1);
  p = trigger_put_bytes(p, m->flags, 1);
  for (int k = 0; k < trigger_max_lines; ++k) {
    p = trigger_put_bytes(p, (uint32_t)m->exposure[k].start_us, 4);
    p = trigger_put_bytes(p, (uint32_t)m->exposure[k].end_us, 4);
  }
}

static inline bool trigger_get_event(const uint8_t* p, size_t size, TriggerEvent* m) {
  if (size != trigger_event_payload_size) return false;
  m->boot_id = trigger_get_u32(p);
  m->pulse = trigger_get_u32(p + 4);
  m->tick = trigger_get_bytes(p + 8, 8);
  m->lines = p[16];
  m->flags = p[17];
  for (int k = 0; k < trigger_max_lines; ++k) {
    m->exposure[k].start_us = trigger_get_i32(p + 18U + 8U * (size_t)k);
    m->exposure[k].end_us = trigger_get_i32(p + 22U + 8U * (size_t)k);
  }
  return true;
}

static inline void trigger_put_edge(const TriggerEdge* m, uint8_t* p) {
  p = trigger_put_bytes(p, m->boot_id, 4);
  p = trigger_put_bytes(p, m->count, 4);
  (void)trigger_put_bytes(p, m->tick, 8);
}

static inline bool trigger_get_edge(const uint8_t* p, size_t size, TriggerEdge* m) {
  if (size != trigger_edge_payload_size) return false;
  m->boot_id = trigger_get_u32(p);
  m->count = trigger_get_u32(p + 4);
  m->tick = trigger_get_bytes(p + 8, 8);
  return true;
}

static inline void trigger_put_status(const TriggerStatus* m, uint8_t* p) {
  p = trigger_put_bytes(p, m->boot_id, 4);
  p = trigger_put_bytes(p, m->tick, 8);
  p = trigger_put_bytes(p, m->pulses, 4);
  p = trigger_put_bytes(p, m->configuration, 4);
  p = trigger_put_bytes(p, m->frames_refused, 4);
  p = trigger_put_bytes(p, m->events_dropped, 4);
  p = trigger_put_bytes(p, m->edges_dropped, 4);
  p = trigger_put_bytes(p, m->pps_age_ms, 4);
  p = trigger_put_bytes(p, m->state, 1);
  (void)trigger_put_bytes(p, m->pps_locked, 1);
}

static inline bool trigger_get_status(const uint8_t* p, size_t size, TriggerStatus* m) {
  if (size != trigger_status_payload_size) return false;
  m->boot_id = trigger_get_u32(p);
  m->tick = trigger_get_bytes(p + 4, 8);
  m->pulses = trigger_get_u32(p + 12);
  m->configuration = trigger_get_u32(p + 16);
  m->frames_refused = trigger_get_u32(p + 20);
  m->events_dropped = trigger_get_u32(p + 24);
  m->edges_dropped = trigger_get_u32(p + 28);
  m->pps_age_ms = trigger_get_u32(p + 32);
  m->state = p[36];
  m->pps_locked = p[37];
  return true;
}

static inline void trigger_put_error(const TriggerError* m, uint8_t* p) {
  p[0] = m->refused;
  p[1] = m->code;
}

static inline bool trigger_get_error(const uint8_t* p, size_t size, TriggerError* m) {
  if (size != trigger_error_payload_size) return false;
  m->refused = p[0];
  m->code = p[1];
  return true;
}

#ifdef __cplusplus
}
#endif
#endif
