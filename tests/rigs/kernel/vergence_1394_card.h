/* SPDX-License-Identifier: GPL-2.0 OR MIT */
/*
 * The virtual IEEE 1394 card (vergence_1394_main.c) as its parts see it: asynchronous packets,
 * isochronous reception, and the user program's device. One card; its lock is over everything in
 * it, the write mutex over the records of the program, one at a time.
 */
#ifndef VERGENCE_1394_CARD_H
#define VERGENCE_1394_CARD_H

#include <linux/firewire-constants.h>
#include <linux/firewire.h>
#include <linux/miscdevice.h>
#include <linux/mutex.h>
#include <linux/platform_device.h>
#include <linux/poll.h>
#include <linux/slab.h>

#include "core.h"
#include "vergence_1394_abi.h"

#define VB_ROM_BYTES 1024
#define VB_MAX_PENDING 64

/* bits of the packet headers, IEEE 1394-1995 clause 6.2 */
#define H0_DEST(q) (((q) >> 16) & 0xffff)
#define H0_TLABEL(q) (((q) >> 10) & 0x3f)
#define H0_TCODE(q) (((q) >> 4) & 0x0f)
#define H3_LENGTH(q) (((q) >> 16) & 0xffff)
#define H3_EXTCODE(q) ((q)&0xffff)

/* A request on its way to the program, or waiting for its answer. */
struct vpending {
  struct list_head link;
  bool handed_over;
  u32 cookie;
  u32 header[4]; /* of the request */
  struct vb_request* record;
  size_t record_bytes;
};

struct vcard {
  struct fw_card card;
  struct platform_device* pdev;
  spinlock_t lock;
  struct mutex write_mutex;
  bool opened;
  u32 node_count;
  u32 speed;
  u32 gap_count;
  int generation;
  u32 cookie;
  unsigned int pending_count;
  struct list_head pending;
  bool reset_to_report;
  wait_queue_head_t wait;
  struct list_head contexts;
  struct work_struct reset_work;
  __be32 rom[VB_ROM_BYTES / 4];
  u32 bus_manager_id, bandwidth, channels_hi, channels_lo;
};

extern struct vcard* vcard_only;
extern struct miscdevice vb_device; /* /dev/vbus1394 */

static inline struct vcard* to_vcard(struct fw_card* card) {
  return container_of(card, struct vcard, card);
}

u32 vcard_cycle_time(void);

/* asynchronous packets */
void vcard_send_request(struct fw_card* card, struct fw_packet* packet);
void vcard_send_response(struct fw_card* card, struct fw_packet* packet);
int vcard_cancel_packet(struct fw_card* card, struct fw_packet* packet);
/* A response of the program becomes a packet of the bus. */
int vcard_take_response(struct vcard* v, const struct vb_response* r, const u8* payload,
                        size_t bytes);

/* isochronous reception */
struct fw_iso_context* vcard_allocate_iso(struct fw_card* card, int type, int channel,
                                          size_t header_size);
void vcard_free_iso(struct fw_iso_context* base);
int vcard_start_iso(struct fw_iso_context* base, s32 cycle, u32 sync, u32 tags);
int vcard_stop_iso(struct fw_iso_context* base);
int vcard_set_iso_channels(struct fw_iso_context* base, u64* channels);
int vcard_queue_iso(struct fw_iso_context* base, struct fw_iso_packet* packet,
                    struct fw_iso_buffer* buffer, unsigned long payload);
void vcard_flush_queue(struct fw_iso_context* base);
int vcard_flush_completions(struct fw_iso_context* base);
/* A packet of the program goes to the contexts of its channel. */
void vcard_take_iso(struct vcard* v, const struct vb_iso* iso, const u8* data, size_t bytes);

#endif
