#ifndef VERGENCE_FIRMWARE_IFACE_TRIGGER_TRIGGER_H
#define VERGENCE_FIRMWARE_IFACE_TRIGGER_TRIGGER_H
/*
 * What host and trigger board say to each other: one C11 header for both sides (the host includes
 * it from C++).
 *
 * Frame      COBS(type u8, sequence u8, payload 0..64 bytes, CRC-32 of all before it) and one byte
 * 00. 00 stands nowhere else, so a receiver that starts or stumbles anywhere is right again at the
 * next 00. All numbers are little endian, without padding. CRC        CRC-32 of IEEE 802.3:
 * reflected polynomial EDB88320, start and final exclusive-or FFFFFFFF. Answers    The host numbers
 * its messages 0..127, and the board answers each with the same sequence: HELLO by INFO, PING by
 * PONG, the others by STATUS once they are in effect, or by ERROR. What the board sends unasked
 * (EVENT, PPS, INS, STATUS every second and when its state changes) has bit 7 set and counts in the
 * others, so that it is never taken for an answer; a gap is a message lost. Boot       boot_id
 * differs at every start of the board. Pulse numbers and ticks mean nothing across two boot_ids.
 * Ticks      64-bit microseconds of the board's clock since its start, taken by hardware at the
 * edge. With PPS they are seconds of PPS divided by a million; they never step, and after the first
 * HELLO their rate moves by at most 1 ppm a second (or by a sixteenth of what is missing, if that
 * is more). Memory     The caller's; no heap, no state but in TriggerDecoder. Threads: whatever the
 * caller does with its own objects. Errors Closed enums; a call that is not ok has changed no
 * output.
 */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
  trigger_protocol_version = 1, /* a board with another one is refused by name */
  trigger_max_lines = 4,
  trigger_max_payload = 64,
  trigger_unasked = 0x80, /* in a sequence: nobody asked */
  trigger_overhead = 6,   /* type, sequence, CRC */
  trigger_max_body =
      trigger_max_payload + trigger_overhead, /* < 254: COBS then adds exactly one byte */
  trigger_max_frame = trigger_max_body + 2,   /* COBS byte and 00 */
  trigger_info_payload_size = 28,
  trigger_config_payload_size = 18,
  trigger_pause_payload_size = 4,
  trigger_ping_payload_size = 4,
  trigger_pong_payload_size = 24,
  trigger_event_payload_size = 50,
  trigger_edge_payload_size = 16,
  trigger_status_payload_size = 38,
  trigger_error_payload_size = 2
};

typedef enum {
  trigger_hello = 0x01,  /* host: version u8 */
  trigger_config = 0x02, /* host: TriggerConfig; only while stopped */
  trigger_start = 0x03,  /* host: pulses begin, numbers go on from the last */
  trigger_stop = 0x04,   /* host: pulses end */
  trigger_pause = 0x05,  /* host: TriggerPause */
  trigger_ping = 0x06,   /* host: token u32 */
  trigger_info = 0x81,   /* board: TriggerInfo */
  trigger_pong = 0x86,   /* board: TriggerPong */
  trigger_event = 0x90,  /* board: TriggerEvent, one a pulse */
  trigger_pps = 0x91,    /* board: TriggerEdge of the GNSS pulse per second */
  trigger_ins = 0x92,    /* board: TriggerEdge of the INS' SyncOut */
  trigger_status = 0x93, /* board: TriggerStatus */
  trigger_error = 0x94   /* board: TriggerError */
} TriggerType;

/* Edge that counts on an input. */
typedef enum {
  trigger_edge_none = 0,
  trigger_edge_rising = 1,
  trigger_edge_falling = 2
} TriggerEdgeKind;

typedef enum { trigger_stopped = 0, trigger_running = 1, trigger_paused = 2 } TriggerState;

typedef enum {
  trigger_error_unknown_type = 1,
  trigger_error_wrong_size = 2, /* a payload of another size than its type has */
  trigger_error_version = 3,
  trigger_error_not_stopped =
      4, /* CONFIG while pulses run; START or STOP before the last STOP was answered */
  trigger_error_not_configured = 5,
  trigger_error_rate = 6,  /* the timer cannot make this rate */
  trigger_error_pulse = 7, /* pulse width 0, above a second or not below the shortest interval */
  trigger_error_line = 8,  /* a line or input that the board does not have, or no line at all */
  trigger_error_not_running = 9 /* PAUSE while stopped */
} TriggerErrorCode;

/* INFO, 28 bytes: 0 version, 1..3 firmware, 4 boot_id, 8 tick_hz, 12 lines, 13 feedback_inputs, 14
 * has_pps, 15 has_ins, 16 serial */
typedef struct {
  uint8_t version;
  uint8_t firmware_major, firmware_minor, firmware_patch;
  uint32_t boot_id;
  uint32_t tick_hz; /* of the hardware counter behind the ticks: their resolution; ticks on the wire
                       are microseconds */
  uint8_t lines;
  uint8_t feedback_inputs;
  uint8_t has_pps, has_ins; /* 0 or 1 */
  uint8_t serial[12];       /* of the board's processor */
} TriggerInfo;

/* CONFIG, 18 bytes: 0 rate_millihertz, 4 pulse_us, 8 vary_us, 12 lines, 13 active_low, 14
 * feedback_inputs, 15 feedback_active_low, 16 pps_edge, 17 ins_edge. Bit k of a mask is line or
 * input k. */
typedef struct {
  uint32_t rate_millihertz;
  uint32_t pulse_us;
  uint32_t vary_us; /* 0: even intervals; else every interval is longer or shorter by this:
                       trigger_interval_is_longer() */
  uint8_t lines;
  uint8_t active_low;
  uint8_t feedback_inputs; /* exposure-active outputs of the cameras: input k is that of line k's
                              camera */
  uint8_t feedback_active_low;
  uint8_t pps_edge; /* TriggerEdgeKind */
  uint8_t ins_edge;
} TriggerConfig;

/* PAUSE, 4 bytes: 0 pulses. So many pulses are left out after the one that the timer already holds,
 * then they go on by themselves; their numbers are left out too. In a pause: so many from now on; 0
 * ends it. */
typedef struct {
  uint32_t pulses;
} TriggerPause;

/* PING, 4 bytes: 0 token. */
typedef struct {
  uint32_t token;
} TriggerPing;

/* PONG, 24 bytes: 0 token, 4 boot_id, 8 received, 16 sent: ticks of the PING's last byte and of the
 * PONG's first. */
typedef struct {
  uint32_t token;
  uint32_t boot_id;
  uint64_t received;
  uint64_t sent;
} TriggerPong;

/* One line's exposure as its camera's feedback told it, microseconds after the pulse's edge. */
typedef struct {
  int32_t start_us,
      end_us; /* TRIGGER_NOT_SEEN: no edge before the next pulse, or no feedback wired */
} TriggerExposure;
#define TRIGGER_NOT_SEEN INT32_MIN

/* EVENT, 50 bytes: 0 boot_id, 4 pulse, 8 tick, 16 lines, 17 flags, 18 + 8 k start_us and end_us of
 * line k. Sent when the exposures are over, at the latest at the next pulse or, where none comes,
 * an interval after its own. */
typedef struct {
  uint32_t boot_id;
  uint32_t pulse; /* from 0 at every boot, one more a pulse, also for those a PAUSE left out */
  uint64_t tick;  /* of the pulse's active edge */
  uint8_t lines;  /* mask of the lines that were pulsed */
  uint8_t flags;  /* bit 0: first after START or a pause; bit 1: the board was late, the edge is off
                     the grid or numbers were left out */
  TriggerExposure exposure[trigger_max_lines];
} TriggerEvent;

/* PPS and INS, 16 bytes: 0 boot_id, 4 count, 8 tick. */
typedef struct {
  uint32_t boot_id;
  uint32_t count; /* edges since boot */
  uint64_t tick;
} TriggerEdge;

/* STATUS, 38 bytes: 0 boot_id, 4 tick, 12 pulses, 16 configuration, 20 frames_refused, 24
 * events_dropped, 28 edges_dropped, 32 pps_age_ms, 36 state, 37 pps_locked */
typedef struct {
  uint32_t boot_id;
  uint64_t tick;
  uint32_t pulses;         /* number of the next pulse */
  uint32_t configuration;  /* CRC-32 of the CONFIG payload in effect; 0: none */
  uint32_t frames_refused; /* received with a wrong CRC, size or coding */
  uint32_t events_dropped; /* messages that found no room on the way out */
  uint32_t edges_dropped;
  uint32_t pps_age_ms; /* FFFFFFFF: never seen */
  uint8_t state;       /* TriggerState */
  uint8_t pps_locked;  /* 1: ticks are disciplined by PPS */
} TriggerStatus;

/* ERROR, 2 bytes: 0 type of the refused message, 1 code. */
typedef struct {
  uint8_t refused;
  uint8_t code; /* TriggerErrorCode */
} TriggerError;

/* With vary_us: whether the interval that begins at this pulse is longer. The same bits on both
 * sides, and no run of 24 intervals among the first 100 000 fits itself shifted by up to eight, so
 * that a camera's own intervals prove which frame belongs to which pulse. */
static inline bool trigger_interval_is_longer(uint32_t pulse) {
  uint32_t mixed = pulse + 1U;
  mixed = (mixed ^ (mixed >> 16U)) * 0x45D9F3BU;
  mixed = (mixed ^ (mixed >> 15U)) * 0x2C1B3C6DU;
  return ((mixed >> 13U) & 1U) != 0U;
}

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

static inline uint32_t trigger_crc32(const uint8_t* bytes, size_t size) {
  uint32_t crc = 0xFFFFFFFFU;
  for (size_t i = 0; i < size; ++i) {
    crc ^= bytes[i];
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ (0xEDB88320U & (0U - (crc & 1U)));
  }
  return crc ^ 0xFFFFFFFFU;
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
  p = trigger_put_bytes(p, m->vary_us, 4);
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
  m->vary_us = trigger_get_u32(p + 8);
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

/* ---- frames ---- */

/* Writes a whole frame, its 00 included, to out[trigger_max_frame]; returns its size, 0 for a
 * payload that is too long. */
static inline size_t trigger_write_frame(uint8_t type, uint8_t sequence, const uint8_t* payload,
                                         size_t size, uint8_t* out) {
  uint8_t body[trigger_max_body];
  if (size > trigger_max_payload) return 0;
  body[0] = type;
  body[1] = sequence;
  if (size > 0) memcpy(body + 2, payload, size);
  (void)trigger_put_bytes(body + 2 + size, trigger_crc32(body, size + 2), 4);

  /* COBS: each 00 is replaced by the distance to the next; bodies are shorter than 254, so one byte
   * is added. */
  size_t code_at = 0, at = 1;
  uint8_t code = 1;
  for (size_t i = 0; i < size + trigger_overhead; ++i) {
    if (body[i] == 0) {
      out[code_at] = code;
      code_at = at++;
      code = 1;
    } else {
      out[at++] = body[i];
      ++code;
    }
  }
  out[code_at] = code;
  out[at++] = 0;
  return at;
}

typedef enum {
  trigger_wait,        /* more bytes are needed */
  trigger_frame_ready, /* *frame is filled */
  trigger_bad_coding, /* the bytes before this 00 are no COBS: most often the stream's cut beginning
                       */
  trigger_bad_length, /* shorter than a frame can be, or longer */
  trigger_bad_crc
} TriggerDecodeStatus;

typedef struct {
  uint8_t type, sequence;
  uint8_t size; /* of the payload */
  uint8_t payload[trigger_max_payload];
} TriggerFrame;

/* Takes a stream apart. All zero is its start. */
typedef struct {
  uint8_t buffer[trigger_max_body + 1];
  uint8_t used;
  bool overrun; /* the frame being received is too long: skip to its 00 */
  uint32_t frames, bad_coding, bad_length, bad_crc;
} TriggerDecoder;

/* Undoes COBS in place: returns the length of the body, 0 where the bytes are no COBS. */
static inline size_t trigger_uncobs(uint8_t* bytes, size_t size) {
  size_t from = 0, to = 0;
  while (from < size) {
    const size_t code = bytes[from];
    if (code == 0 || from + code > size) return 0;
    for (size_t i = 1; i < code; ++i) bytes[to++] = bytes[from + i];
    from += code;
    if (from < size) bytes[to++] = 0; /* to is behind from: nothing unread is overwritten */
  }
  return to;
}

/* One received byte. Anything but trigger_frame_ready leaves *frame alone. Idle 00 bytes between
 * frames are nothing. */
static inline TriggerDecodeStatus trigger_decode(TriggerDecoder* decoder, uint8_t byte,
                                                 TriggerFrame* frame) {
  if (byte != 0) {
    if (decoder->used == sizeof decoder->buffer)
      decoder->overrun = true;
    else
      decoder->buffer[decoder->used++] = byte;
    return trigger_wait;
  }
  const size_t received = decoder->used;
  const bool overrun = decoder->overrun;
  decoder->used = 0;
  decoder->overrun = false;
  if (received == 0) return trigger_wait;
  if (overrun) {
    ++decoder->bad_length;
    return trigger_bad_length;
  }
  const size_t size = trigger_uncobs(decoder->buffer, received);
  if (size == 0) {
    ++decoder->bad_coding;
    return trigger_bad_coding;
  }
  if (size < trigger_overhead) {
    ++decoder->bad_length;
    return trigger_bad_length;
  }
  if (trigger_crc32(decoder->buffer, size - 4) != trigger_get_u32(decoder->buffer + size - 4)) {
    ++decoder->bad_crc;
    return trigger_bad_crc;
  }
  frame->type = decoder->buffer[0];
  frame->sequence = decoder->buffer[1];
  frame->size = (uint8_t)(size - trigger_overhead);
  memcpy(frame->payload, decoder->buffer + 2, frame->size);
  ++decoder->frames;
  return trigger_frame_ready;
}

#ifdef __cplusplus
}
#endif
#endif
