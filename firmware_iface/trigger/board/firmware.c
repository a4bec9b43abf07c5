/* The main loop: the portable board on a port's hardware layer. */
#include "firmware_iface/trigger/board/hal.h"

enum { records_a_turn = 32, bytes_a_turn = 32 };

typedef struct {
  TriggerBoard board;
  uint64_t now;
  uint32_t lost;    /* stamps, as told to the board */
  uint32_t applied; /* configuration that the hardware has */
  uint8_t frame[trigger_max_frame];
  uint8_t size, sent;
} Firmware;

/* 32 bits of counter become 64; called many times in each of its turns. */
static uint64_t refresh(Firmware* firmware) {
  firmware->now += (uint32_t)(hal_now() - (uint32_t)firmware->now);
  return firmware->now;
}

/* Of a stamp that is older than `now`, by less than a turn of the counter. */
static uint64_t whole(const Firmware* firmware, uint32_t count) {
  return firmware->now - (uint32_t)((uint32_t)firmware->now - count);
}

static void read_stamps(Firmware* firmware) {
  StampRecord record;
  for (unsigned n = 0; n < records_a_turn && hal_stamped(&record); ++n) {
    const uint64_t now = refresh(firmware);
    const uint64_t count = whole(firmware, record.count);
    if (record.source == record_pulse)
      board_pulse_made(&firmware->board, now, count, record.late);
    else
      board_edge(&firmware->board, now, (BoardInput)record.source, record.rising, count);
  }
  const uint32_t lost = hal_stamps_lost();
  board_edges_lost(&firmware->board, lost - firmware->lost);
  firmware->lost = lost;
}

static void drive_pulses(Firmware* firmware) {
  BoardPulse pulse;
  if (board_wants_disarm(&firmware->board) && hal_disarm())
    board_pulse_disarmed(&firmware->board, firmware->now);
  if (firmware->board.config_crc != firmware->applied) {
    hal_configure(board_configuration(&firmware->board));
    firmware->applied = firmware->board.config_crc;
  }
  if (!board_schedule_pulse(&firmware->board, refresh(firmware), &pulse)) return;
  if (!hal_arm((uint32_t)pulse.count, (uint32_t)pulse.width,
               pulse.lines)) /* at most a second: it fits */
    board_pulse_refused(&firmware->board);
}

static void read_bytes(Firmware* firmware) {
  ByteRecord record;
  for (unsigned n = 0; n < bytes_a_turn && hal_received(&record); ++n) {
    const uint64_t now = refresh(firmware);
    board_receive(&firmware->board, now, whole(firmware, record.count), record.byte);
    drive_pulses(firmware); /* what was asked is in effect before the next message is read */
  }
}

/* A frame starts on an idle line, so that the moment of its first bit is known. */
static void give_bytes(Firmware* firmware) {
  if (firmware->sent == firmware->size && hal_line_idle()) {
    firmware->size = (uint8_t)board_send(&firmware->board, refresh(firmware), firmware->frame);
    firmware->sent = 0;
  }
  while (firmware->sent < firmware->size && hal_send(firmware->frame[firmware->sent]))
    ++firmware->sent;
}

void firmware_main(void) {
  static Firmware firmware; /* the only one; too big for the stack */
  BoardDescription description;
  hal_start();
  hal_describe(&description);
  firmware.now = hal_now();
  board_init(&firmware.board, &description, hal_boot_id(), firmware.now);
  for (;;) {
    hal_feed_watchdog();
    hal_check_pulse();
    read_stamps(&firmware);
    read_bytes(&firmware);
    board_poll(&firmware.board, refresh(&firmware));
    drive_pulses(&firmware);
    give_bytes(&firmware);
  }
}
