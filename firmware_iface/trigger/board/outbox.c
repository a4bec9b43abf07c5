#include "firmware_iface/trigger/board/outbox.h"

static void put(Outbox* box, uint8_t type, uint8_t sequence, const uint8_t* payload, uint8_t size,
                uint8_t room) {
  if (box->used >= room || size > trigger_max_payload) {
    ++box->dropped;
    return;
  }
  OutboxMessage* message = &box->messages[(uint8_t)(box->first + box->used) % outbox_capacity];
  message->type = type;
  message->sequence = sequence;
  message->size = size;
  memcpy(message->payload, payload, size);
  ++box->used;
}

void outbox_answer(Outbox* box, uint8_t type, uint8_t sequence, const uint8_t* payload,
                   uint8_t size) {
  put(box, type, sequence, payload, size, outbox_capacity);
}

/* A message that is dropped takes its sequence number with it: the gap tells the host. */
void outbox_send(Outbox* box, uint8_t type, const uint8_t* payload, uint8_t size) {
  put(box, type, (uint8_t)(trigger_unasked | box->sequence++), payload, size,
      outbox_capacity - outbox_for_answers);
}

OutboxMessage* outbox_front(Outbox* box) {
  return box->used == 0 ? NULL : &box->messages[box->first];
}

void outbox_pop(Outbox* box) {
  box->first = (uint8_t)((box->first + 1U) % outbox_capacity);
  --box->used;
}
