#ifndef VERGENCE_FIRMWARE_IFACE_TRIGGER_BOARD_OUTBOX_H
#define VERGENCE_FIRMWARE_IFACE_TRIGGER_BOARD_OUTBOX_H
/*
 * Messages on their way out, oldest first. When it is full the newest is dropped and counted; the
 * last places are kept for answers, so that a host that asks is answered however many events wait.
 *
 * Memory     The caller's struct, nothing else. Threads: one at a time.
 */
#include <stdbool.h>
#include <stdint.h>

#include "firmware_iface/trigger/trigger.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { outbox_capacity = 24, outbox_for_answers = 6 };

typedef struct {
  uint8_t type, sequence, size;
  uint8_t payload[trigger_max_payload];
} OutboxMessage;

typedef struct {
  OutboxMessage messages[outbox_capacity];
  uint8_t first, used;
  uint8_t sequence; /* of the next message that nobody asked for, modulo 128 */
  uint32_t dropped;
} Outbox;

/* All zero is its start. `payload` has `size` bytes. */
void outbox_answer(Outbox* box, uint8_t type, uint8_t sequence, const uint8_t* payload,
                   uint8_t size);
void outbox_send(Outbox* box, uint8_t type, const uint8_t* payload, uint8_t size);
/* The oldest, null when there is none; valid until outbox_pop(). */
OutboxMessage* outbox_front(Outbox* box);
/* Precondition: outbox_front() is not null. */
void outbox_pop(Outbox* box);

#ifdef __cplusplus
}
#endif
#endif
