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

#include "firmware_iface/trigger/messages.h"
#include "firmware_iface/trigger/payloads.h"

#ifdef __cplusplus
extern "C" {
#endif

static inline uint32_t trigger_crc32(const uint8_t* bytes, size_t size) {
  uint32_t crc = 0xFFFFFFFFU;
  for (size_t i = 0; i < size; ++i) {
    crc ^= bytes[i];
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ (0xEDB88320U & (0U - (crc & 1U)));
  }
  return crc ^ 0xFFFFFFFFU;
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
