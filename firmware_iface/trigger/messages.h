#ifndef VERGENCE_FIRMWARE_IFACE_TRIGGER_MESSAGES_H
#define VERGENCE_FIRMWARE_IFACE_TRIGGER_MESSAGES_H
/* What host and trigger board send each other, as values: trigger.h says how it travels. */
#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
  trigger_protocol_version = 1, /* a board with another one is refused by name */
  trigger_max_lines = 4,
  trigger_max_payload = 64,
  trigger_unasked = 0x80, /* flag of a sequence number: unsolicited */
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

/* CONFIG, 18 bytes: 0 rate_millihertz, 4 pulse_us, 8 dither_us, 12 lines, 13 active_low, 14
 * feedback_inputs, 15 feedback_active_low, 16 pps_edge, 17 ins_edge. Bit k of a mask is line or
 * input k. */
typedef struct {
  uint32_t rate_millihertz;
  uint32_t pulse_us;
  uint32_t dither_us; /* 0: even intervals; else every interval is longer or shorter by this:
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

/* With dither_us: whether the interval that begins at this pulse is longer. The same bits on both
 * sides, and no run of 24 intervals among the first 100 000 fits itself shifted by up to eight, so
 * that a camera's own intervals prove which frame belongs to which pulse. */
static inline bool trigger_interval_is_longer(uint32_t pulse) {
  uint32_t mixed = pulse + 1U;
  mixed = (mixed ^ (mixed >> 16U)) * 0x45D9F3BU;
  mixed = (mixed ^ (mixed >> 15U)) * 0x2C1B3C6DU;
  return ((mixed >> 13U) & 1U) != 0U;
}

#ifdef __cplusplus
}
#endif
#endif
