#ifndef VERGENCE_FIRMWARE_IFACE_TRIGGER_BOARD_BOARD_INTERNAL_H
#define VERGENCE_FIRMWARE_IFACE_TRIGGER_BOARD_BOARD_INTERNAL_H
/*
 * What board.c and board_requests.c share. Private to them.
 */
#include "firmware_iface/trigger/board/board.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Rounded up. */
static inline uint64_t board_counts_of_us(const TriggerBoard* board, uint64_t us) {
  return (us * board->description.counts_hz + 999999U) / 1000000U;
}

/* STATUS as it is `now`, into payload[trigger_status_payload_size]. */
void board_put_status(TriggerBoard* board, uint64_t now, uint8_t* payload);
/* The same as an answer to the request of this sequence number. */
void board_answer_status(TriggerBoard* board, uint64_t now, uint8_t sequence);
/* EVENT of the pulse whose exposures are collected, if there is one. */
void board_close_event(TriggerBoard* board);
/* Precondition: no pulse is armed. */
void board_finish_stop(TriggerBoard* board, uint64_t now);

#ifdef __cplusplus
}
#endif
#endif
