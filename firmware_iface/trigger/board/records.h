#ifndef VERGENCE_FIRMWARE_IFACE_TRIGGER_BOARD_RECORDS_H
#define VERGENCE_FIRMWARE_IFACE_TRIGGER_BOARD_RECORDS_H
/*
 * From interrupts to the main loop: rings of what was stamped, without a lock. When a ring is full
 * the newest is dropped and counted.
 *
 * Threads    One producer (interrupts of one priority count as one) and one consumer, at the same
 * time. Memory     The caller's; all zero is empty.
 */
#include <stdbool.h>
#include <stdint.h>

enum {
  record_ring_capacity = 64,
  byte_ring_capacity = 256
}; /* powers of two: indices run freely and wrap with their type */

/* Source: a BoardInput, or record_pulse for a pulse's leading edge. */
enum { record_pulse = 0xFF };

typedef struct {
  uint32_t count; /* low 32 bits of the free-running counter */
  uint8_t source;
  bool rising;
  bool late; /* a pulse that the main loop had to force */
} StampRecord;

typedef struct {
  uint32_t count; /* of the last bit's arrival */
  uint8_t byte;
} ByteRecord;

typedef struct {
  StampRecord records[record_ring_capacity];
  uint32_t written, read, lost;
} RecordRing;

typedef struct {
  ByteRecord records[byte_ring_capacity];
  uint32_t written, read, lost;
} ByteRing;

static inline void record_push(RecordRing* ring, StampRecord record) {
  const uint32_t written = ring->written;
  if (written - __atomic_load_n(&ring->read, __ATOMIC_ACQUIRE) == record_ring_capacity) {
    __atomic_store_n(&ring->lost, ring->lost + 1U, __ATOMIC_RELAXED);
    return;
  }
  ring->records[written % record_ring_capacity] = record;
  __atomic_store_n(&ring->written, written + 1U, __ATOMIC_RELEASE);
}

static inline bool record_pop(RecordRing* ring, StampRecord* record) {
  const uint32_t read = ring->read;
  if (read == __atomic_load_n(&ring->written, __ATOMIC_ACQUIRE)) return false;
  *record = ring->records[read % record_ring_capacity];
  __atomic_store_n(&ring->read, read + 1U, __ATOMIC_RELEASE);
  return true;
}

static inline void byte_push(ByteRing* ring, ByteRecord record) {
  const uint32_t written = ring->written;
  if (written - __atomic_load_n(&ring->read, __ATOMIC_ACQUIRE) == byte_ring_capacity) {
    __atomic_store_n(&ring->lost, ring->lost + 1U, __ATOMIC_RELAXED);
    return;
  }
  ring->records[written % byte_ring_capacity] = record;
  __atomic_store_n(&ring->written, written + 1U, __ATOMIC_RELEASE);
}

static inline bool byte_pop(ByteRing* ring, ByteRecord* record) {
  const uint32_t read = ring->read;
  if (read == __atomic_load_n(&ring->written, __ATOMIC_ACQUIRE)) return false;
  *record = ring->records[read % byte_ring_capacity];
  __atomic_store_n(&ring->read, read + 1U, __ATOMIC_RELEASE);
  return true;
}

#endif
