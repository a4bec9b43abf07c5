// SPDX-License-Identifier: GPL-2.0 OR MIT
/*
 * A virtual IEEE 1394 card. To the kernel's FireWire core it is a link-layer controller like any
 * other, so /dev/fw*, sysfs, udev events, bus resets, transactions and isochronous reception are
 * the real ones. The remote nodes are played by a user program through /dev/vbus1394
 * (vergence_1394_abi.h).
 *
 * Cycle time follows CLOCK_MONOTONIC: second = ns / 1e9 mod 128, cycle = (ns mod 1e9) / 125 us,
 * with the drift and the offset of the parameters (vergence_1394.drift_ppb=50000
 * vergence_1394.offset_s=120 on the kernel's command line). Not emulated: isochronous transmission,
 * multichannel reception, requests from remote nodes to the host.
 */
#include <linux/dma-mapping.h>
#include <linux/firewire-constants.h>
#include <linux/firewire.h>
#include <linux/highmem.h>
#include <linux/ktime.h>
#include <linux/miscdevice.h>
#include <linux/module.h>
#include <linux/mutex.h>
#include <linux/platform_device.h>
#include <linux/poll.h>
#include <linux/slab.h>
#include <linux/uaccess.h>
#include <linux/vmalloc.h>

#include "core.h"
#include "vergence_1394_abi.h"

#define VB_GUID 0x00000000deb1394aULL
#define VB_ROM_BYTES 1024
#define VB_MAX_PENDING 64
#define VB_MAX_WRITE (4u << 20)

/* bits of the packet headers, IEEE 1394-1995 clause 6.2 */
#define H0_DEST(q) (((q) >> 16) & 0xffff)
#define H0_TLABEL(q) (((q) >> 10) & 0x3f)
#define H0_TCODE(q) (((q) >> 4) & 0x0f)
#define H3_LENGTH(q) (((q) >> 16) & 0xffff)
#define H3_EXTCODE(q) ((q)&0xffff)

/* One packet slot the host has queued in a receive context. */
struct vslot {
  struct list_head link;
  struct fw_iso_buffer* buffer;
  unsigned long offset;
  u32 length;
  bool irq;
  bool wait_sync;
};

struct vcontext {
  struct fw_iso_context base;
  struct list_head link; /* in vcard.contexts */
  struct list_head slots;
  bool running;
  u32 sync;
  u32 tags;
  u32 last_stamp;
  size_t header_bytes;
  u8* header; /* one page */
  u64 received, dropped;
};

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

static struct vcard* the_card;

static struct vcard* to_vcard(struct fw_card* card) {
  return container_of(card, struct vcard, card);
}

static int drift_ppb;
module_param(drift_ppb, int, 0444);
MODULE_PARM_DESC(drift_ppb, "how much faster than CLOCK_MONOTONIC the bus clock runs");
static int offset_s;
module_param(offset_s, int, 0444);
MODULE_PARM_DESC(offset_s, "bus time at CLOCK_MONOTONIC zero, in seconds");

static u64 bus_ns(void) {
  u64 ns = ktime_get_ns();

  return ns + div_s64((s64)ns * drift_ppb, NSEC_PER_SEC) + (u64)offset_s * NSEC_PER_SEC;
}

static u32 cycle_time_now(void) {
  u64 ns = bus_ns();
  u32 rest = do_div(ns, NSEC_PER_SEC);
  u32 seconds = ns & 0x7f;

  return seconds << 25 | (rest / 125000) << 12 | ((rest % 125000) * 3072) / 125000;
}

/* ---- bus resets ---- */

static u32 self_id(u32 id, u32 gap, u32 speed, bool contender, u32 p0, u32 p1, u32 p2) {
  return 2u << 30 | id << 24 | 1u << 22 | gap << 16 | speed << 14 | (contender ? 1u << 11 : 0) |
         4u << 8 | p0 << 6 | p1 << 4 | p2 << 2;
}

static void reset_work(struct work_struct* work) {
  struct vcard* v = container_of(work, struct vcard, reset_work);
  u32 ids[VB_MAX_NODES + 1], port[VB_MAX_NODES], count, i;
  struct vpending *p, *next;
  LIST_HEAD(stale);
  int generation;

  spin_lock_irq(&v->lock);
  count = v->node_count;
  v->generation = (v->generation + 1) & 0xff;
  generation = v->generation;
  v->bus_manager_id = 0x3f;
  v->bandwidth = BANDWIDTH_AVAILABLE_INITIAL;
  v->channels_hi = 0xffffffff;
  v->channels_lo = 0xffffffff;
  list_splice_init(&v->pending,
                   &stale); /* split transactions die with the reset; the core times them out */
  v->pending_count = 0;
  for (i = 0; i < count; i++) ids[i] = self_id(i, v->gap_count, v->speed, false, 2, 0, 0);
  for (i = 0; i < VB_MAX_NODES; i++) port[i] = i < count ? 3 : 1;
  ids[count] =
      self_id(count, v->gap_count, 3, true, port[0], port[1], port[2]); /* the card itself: S800 */
  v->reset_to_report = true;
  spin_unlock_irq(&v->lock);

  list_for_each_entry_safe(p, next, &stale, link) {
    kfree(p->record);
    kfree(p);
  }
  fw_core_handle_bus_reset(&v->card, LOCAL_BUS | count, generation, count + 1, ids, false);
  wake_up_interruptible(&v->wait);
}

/* ---- asynchronous packets ---- */

static void answer_local_rom(struct vcard* v, struct fw_packet* packet, u32 csr) {
  struct fw_packet response;
  int tcode = H0_TCODE(packet->header[0]);
  u32 at = csr - CSR_CONFIG_ROM,
      length = tcode == TCODE_READ_BLOCK_REQUEST ? H3_LENGTH(packet->header[3]) : 4;

  if (tcode != TCODE_READ_QUADLET_REQUEST && tcode != TCODE_READ_BLOCK_REQUEST)
    fw_fill_response(&response, packet->header, RCODE_TYPE_ERROR, NULL, 0);
  else if (at + length > VB_ROM_BYTES)
    fw_fill_response(&response, packet->header, RCODE_ADDRESS_ERROR, NULL, 0);
  else
    fw_fill_response(&response, packet->header, RCODE_COMPLETE, (u8*)v->rom + at, length);
  fw_core_handle_response(&v->card, &response);
}

static void answer_local_resource(struct vcard* v, struct fw_packet* packet, u32 csr) {
  struct fw_packet response;
  int tcode = H0_TCODE(packet->header[0]);
  __be32 *argument = packet->payload, old;
  unsigned long flags;
  u32* cell;

  spin_lock_irqsave(&v->lock, flags);
  switch (csr) {
    case CSR_BUS_MANAGER_ID:
      cell = &v->bus_manager_id;
      break;
    case CSR_BANDWIDTH_AVAILABLE:
      cell = &v->bandwidth;
      break;
    case CSR_CHANNELS_AVAILABLE_HI:
      cell = &v->channels_hi;
      break;
    default:
      cell = &v->channels_lo;
      break;
  }
  old = cpu_to_be32(*cell);
  if (tcode == TCODE_LOCK_REQUEST && H3_EXTCODE(packet->header[3]) == EXTCODE_COMPARE_SWAP &&
      H3_LENGTH(packet->header[3]) == 8) {
    if (old == argument[0]) *cell = be32_to_cpu(argument[1]);
    fw_fill_response(&response, packet->header, RCODE_COMPLETE, &old, 4);
  } else if (tcode == TCODE_READ_QUADLET_REQUEST) {
    fw_fill_response(&response, packet->header, RCODE_COMPLETE, &old, 4);
  } else {
    fw_fill_response(&response, packet->header, RCODE_TYPE_ERROR, NULL, 0);
  }
  spin_unlock_irqrestore(&v->lock, flags);
  fw_core_handle_response(&v->card, &response);
}

static void request_to_self(struct vcard* v, struct fw_packet* packet) {
  u64 offset = (u64)(packet->header[1] & 0xffff) << 32 | packet->header[2];
  u64 csr = offset - CSR_REGISTER_BASE;

  packet->ack = ACK_PENDING;
  packet->callback(packet, &v->card, packet->ack);
  if (csr >= CSR_CONFIG_ROM && csr < CSR_CONFIG_ROM_END)
    answer_local_rom(v, packet, csr);
  else if (csr == CSR_BUS_MANAGER_ID || csr == CSR_BANDWIDTH_AVAILABLE ||
           csr == CSR_CHANNELS_AVAILABLE_HI || csr == CSR_CHANNELS_AVAILABLE_LO)
    answer_local_resource(v, packet, csr);
  else
    fw_core_handle_request(&v->card, packet);
}

static int request_to_program(struct vcard* v, struct fw_packet* packet) {
  int tcode = H0_TCODE(packet->header[0]);
  u32 node = H0_DEST(packet->header[0]) & 0x3f, carried = 0;
  struct vb_request* record;
  struct vpending* p;
  unsigned long flags;
  int ack = ACK_PENDING;

  if (tcode == TCODE_WRITE_BLOCK_REQUEST || tcode == TCODE_LOCK_REQUEST)
    carried = packet->payload_length;
  else if (tcode == TCODE_WRITE_QUADLET_REQUEST)
    carried = 4;
  p = kzalloc(sizeof(*p), GFP_ATOMIC);
  record = kzalloc(sizeof(*record) + carried, GFP_ATOMIC);
  if (!p || !record) goto busy;
  record->r.type = VB_REQUEST;
  record->r.length = sizeof(*record) + carried;
  record->generation = packet->generation;
  record->node = node;
  record->tcode = tcode;
  record->speed = packet->speed;
  record->offset = (u64)(packet->header[1] & 0xffff) << 32 | packet->header[2];
  if (tcode == TCODE_WRITE_QUADLET_REQUEST) {
    memcpy(record + 1, &packet->header[3], 4); /* the core keeps these four bytes in bus order */
    record->size = 4;
  } else if (tcode == TCODE_READ_QUADLET_REQUEST) {
    record->size = 4;
  } else {
    record->size = H3_LENGTH(packet->header[3]);
    record->extcode = H3_EXTCODE(packet->header[3]);
    if (carried) memcpy(record + 1, packet->payload, carried);
  }
  memcpy(p->header, packet->header, sizeof(p->header));
  p->record = record;
  p->record_bytes = record->r.length;

  spin_lock_irqsave(&v->lock, flags);
  if (packet->generation != v->generation) {
    ack = RCODE_GENERATION;
  } else if (!v->opened || node >= v->node_count) {
    ack = RCODE_NO_ACK;
  } else if (v->pending_count >= VB_MAX_PENDING) {
    ack = ACK_BUSY_X;
  } else {
    p->cookie = record->cookie = ++v->cookie;
    v->pending_count++;
    list_add_tail(&p->link, &v->pending);
    p = NULL;
    record = NULL;
  }
  spin_unlock_irqrestore(&v->lock, flags);
  kfree(record);
  kfree(p);
  return ack;
busy:
  kfree(record);
  kfree(p);
  return ACK_BUSY_X;
}

static void vcard_send_request(struct fw_card* card, struct fw_packet* packet) {
  struct vcard* v = to_vcard(card);

  packet->timestamp = (cycle_time_now() >> 12) & 0xffff;
  if (H0_TCODE(packet->header[0]) == TCODE_LINK_INTERNAL) {
    /* a PHY configuration packet: keep the gap count it sets */
    if ((packet->header[1] >> 30) == 0 && (packet->header[1] & (1u << 22)))
      v->gap_count = (packet->header[1] >> 16) & 0x3f;
    packet->ack = ACK_COMPLETE;
    packet->callback(packet, card, packet->ack);
    return;
  }
  if (H0_TCODE(packet->header[0]) == TCODE_STREAM_DATA) {
    packet->ack = ACK_COMPLETE;
    packet->callback(packet, card, packet->ack);
    return;
  }
  if (H0_DEST(packet->header[0]) == (LOCAL_BUS | v->node_count) &&
      packet->generation == v->generation) {
    request_to_self(v, packet);
    return;
  }
  if ((H0_DEST(packet->header[0]) & 0x3f) == 0x3f) { /* broadcast write: nobody answers */
    packet->ack = ACK_COMPLETE;
    packet->callback(packet, card, packet->ack);
    return;
  }
  packet->ack = request_to_program(v, packet);
  packet->callback(packet, card, packet->ack);
  if (packet->ack == ACK_PENDING) wake_up_interruptible(&v->wait);
}

static void vcard_send_response(struct fw_card* card, struct fw_packet* packet) {
  struct vcard* v = to_vcard(card);

  packet->timestamp = (cycle_time_now() >> 12) & 0xffff;
  if (H0_DEST(packet->header[0]) == (LOCAL_BUS | v->node_count))
    fw_core_handle_response(card, packet);
  packet->ack = ACK_COMPLETE;
  packet->callback(packet, card, packet->ack);
}

static int vcard_cancel_packet(struct fw_card* card, struct fw_packet* packet) {
  return -ENOENT; /* every packet has left by the time the core could ask */
}

/* A response of the program becomes a packet of the bus. */
static int take_response(struct vcard* v, const struct vb_response* r, const u8* payload,
                         size_t bytes) {
  struct vpending *p = NULL, *iter;
  struct fw_packet response;

  spin_lock_irq(&v->lock);
  list_for_each_entry(iter, &v->pending, link) {
    if (iter->handed_over && iter->cookie == r->cookie) {
      p = iter;
      list_del(&p->link);
      v->pending_count--;
      break;
    }
  }
  spin_unlock_irq(&v->lock);
  if (!p) return -ESTALE; /* a bus reset came between */
  memset(&response, 0, sizeof(response));
  fw_fill_response(&response, p->header, r->rcode, (void*)payload, bytes);
  response.timestamp = (cycle_time_now() >> 12) & 0xffff;
  response.generation = v->generation;
  fw_core_handle_response(&v->card, &response);
  kfree(p->record);
  kfree(p);
  return 0;
}

/* ---- isochronous reception ---- */

static void report_headers(struct vcontext* c) {
  if (!c->header_bytes) return;
  c->base.callback.sc(&c->base, c->last_stamp, c->header_bytes, c->header, c->base.callback_data);
  c->header_bytes = 0;
}

static void copy_into(struct vslot* s, const u8* data, size_t bytes) {
  unsigned long at = s->offset;

  if (bytes > s->length) bytes = s->length;
  while (bytes) {
    size_t room = min_t(size_t, bytes, PAGE_SIZE - (at & ~PAGE_MASK));
    struct page* page = s->buffer->pages[at >> PAGE_SHIFT];

    memcpy_to_page(page, at & ~PAGE_MASK, data, room);
    data += room;
    at += room;
    bytes -= room;
  }
}

static void deliver(struct vcontext* c, const struct vb_iso* iso, u32 stamp, const u8* data,
                    size_t bytes) {
  struct vslot* s = list_first_entry_or_null(&c->slots, struct vslot, link);
  size_t stripped = 0;
  __be32 q[2];

  if (!c->running || !(c->tags & (1u << iso->tag))) return;
  if (!s || (s->wait_sync && iso->sy != c->sync)) {
    c->dropped++;
    return;
  }
  list_del(&s->link);
  c->received++;
  if (c->header_bytes + c->base.header_size > PAGE_SIZE && !c->base.drop_overflow_headers)
    report_headers(c);
  c->last_stamp = stamp;
  if (c->header_bytes + c->base.header_size <= PAGE_SIZE) {
    u8* h = c->header + c->header_bytes;
    size_t lead = min_t(size_t, c->base.header_size, 8);

    q[0] = cpu_to_be32((u32)bytes << 16 | iso->tag << 14 | iso->channel << 8 |
                       TCODE_STREAM_DATA << 4 | iso->sy);
    q[1] = cpu_to_be32(0x00110000u | stamp); /* "complete" and the 16-bit stamp */
    memset(h, 0, c->base.header_size);
    memcpy(h, q, lead);
    if (c->base.header_size > 8) {
      stripped = min_t(size_t, c->base.header_size - 8, bytes);
      memcpy(h + 8, data, stripped);
    }
    c->header_bytes += c->base.header_size;
  }
  copy_into(s, data + stripped, bytes - stripped);
  if (s->irq) report_headers(c);
  kfree(s);
}

static void take_iso(struct vcard* v, const struct vb_iso* iso, const u8* data, size_t bytes) {
  u32 stamp = iso->cycle == 0xffffffff ? (cycle_time_now() >> 12) & 0xffff : iso->cycle & 0xffff;
  struct vcontext* c;

  spin_lock_irq(&v->lock);
  list_for_each_entry(c, &v->contexts, link) if (c->base.channel == iso->channel)
      deliver(c, iso, stamp, data, bytes);
  spin_unlock_irq(&v->lock);
}

static struct fw_iso_context* vcard_allocate_iso(struct fw_card* card, int type, int channel,
                                                 size_t header_size) {
  struct vcard* v = to_vcard(card);
  struct vcontext* c;

  if (type != FW_ISO_CONTEXT_RECEIVE) return ERR_PTR(-EOPNOTSUPP);
  c = kzalloc(sizeof(*c), GFP_KERNEL);
  if (!c) return ERR_PTR(-ENOMEM);
  c->header = (u8*)__get_free_page(GFP_KERNEL | __GFP_ZERO);
  if (!c->header) {
    kfree(c);
    return ERR_PTR(-ENOMEM);
  }
  INIT_LIST_HEAD(&c->slots);
  c->base.channel = channel;
  c->base.header_size = header_size;
  spin_lock_irq(&v->lock);
  list_add_tail(&c->link, &v->contexts);
  spin_unlock_irq(&v->lock);
  return &c->base;
}

static void drop_slots(struct vcontext* c) {
  struct vslot *s, *next;

  list_for_each_entry_safe(s, next, &c->slots, link) {
    list_del(&s->link);
    kfree(s);
  }
}

static int vcard_start_iso(struct fw_iso_context* base, s32 cycle, u32 sync, u32 tags) {
  struct vcontext* c = container_of(base, struct vcontext, base);
  struct vcard* v = to_vcard(base->card);
  unsigned long flags;

  spin_lock_irqsave(&v->lock, flags);
  c->sync = sync;
  c->tags = tags;
  c->header_bytes = 0;
  c->running = true;
  spin_unlock_irqrestore(&v->lock, flags);
  return 0;
}

static int vcard_stop_iso(struct fw_iso_context* base) {
  struct vcontext* c = container_of(base, struct vcontext, base);
  /* the core may have replaced card->driver on removal, but the card is still ours */
  struct vcard* v = to_vcard(base->card);
  unsigned long flags;

  spin_lock_irqsave(&v->lock, flags);
  c->running = false;
  drop_slots(c);
  spin_unlock_irqrestore(&v->lock, flags);
  return 0;
}

static void vcard_free_iso(struct fw_iso_context* base) {
  struct vcontext* c = container_of(base, struct vcontext, base);
  struct vcard* v = to_vcard(base->card);

  vcard_stop_iso(base);
  spin_lock_irq(&v->lock);
  list_del(&c->link);
  spin_unlock_irq(&v->lock);
  if (c->dropped)
    pr_info("vergence_1394: channel %d: %llu packets taken, %llu without a buffer or sync\n",
            base->channel, c->received, c->dropped);
  free_page((unsigned long)c->header);
  kfree(c);
}

static int vcard_set_iso_channels(struct fw_iso_context* base, u64* channels) {
  return -EOPNOTSUPP;
}

static int vcard_queue_iso(struct fw_iso_context* base, struct fw_iso_packet* packet,
                           struct fw_iso_buffer* buffer, unsigned long payload) {
  struct vcontext* c = container_of(base, struct vcontext, base);
  struct vcard* v = to_vcard(base->card);
  u32 count = packet->header_length / base->header_size, each, i;
  unsigned long flags;
  LIST_HEAD(made);

  if (!count) return -EINVAL;
  each = packet->payload_length / count;
  for (i = 0; i < count; i++) {
    struct vslot* s = kzalloc(sizeof(*s), GFP_ATOMIC);

    if (!s) {
      struct vslot* next;

      list_for_each_entry_safe(s, next, &made, link) kfree(s);
      return -ENOMEM;
    }
    s->buffer = buffer;
    s->offset = payload + (unsigned long)i * each;
    s->length = each;
    s->wait_sync = packet->skip && i == 0;
    s->irq = packet->interrupt && i == count - 1;
    list_add_tail(&s->link, &made);
  }
  spin_lock_irqsave(&v->lock, flags);
  list_splice_tail(&made, &c->slots);
  spin_unlock_irqrestore(&v->lock, flags);
  return 0;
}

static void vcard_flush_queue(struct fw_iso_context* base) {}

static int vcard_flush_completions(struct fw_iso_context* base) {
  struct vcontext* c = container_of(base, struct vcontext, base);
  struct vcard* v = to_vcard(base->card);
  unsigned long flags;

  spin_lock_irqsave(&v->lock, flags);
  report_headers(c);
  spin_unlock_irqrestore(&v->lock, flags);
  return 0;
}

/* ---- the rest of the card ---- */

static int vcard_set_rom(struct fw_card* card, const __be32* rom, size_t quadlets) {
  struct vcard* v = to_vcard(card);

  memset(v->rom, 0, sizeof(v->rom));
  memcpy(v->rom, rom, min_t(size_t, quadlets * 4, VB_ROM_BYTES));
  schedule_work(&v->reset_work);
  return 0;
}

static int vcard_read_phy(struct fw_card* card, int address) { return 0; }

static int vcard_update_phy(struct fw_card* card, int address, int clear, int set) {
  if ((address == 1 && (set & PHY_BUS_RESET)) || (address == 5 && (set & PHY_BUS_SHORT_RESET)))
    schedule_work(&to_vcard(card)->reset_work);
  return 0;
}

static int vcard_enable_dma(struct fw_card* card, int node_id, int generation) { return -ENODEV; }

static u32 vcard_read_csr(struct fw_card* card, int offset) {
  struct vcard* v = to_vcard(card);
  u64 ns;

  switch (offset) {
    case CSR_STATE_CLEAR:
    case CSR_STATE_SET:
      return CSR_STATE_BIT_CMSTR;
    case CSR_NODE_IDS:
      return (LOCAL_BUS | v->node_count) << 16;
    case CSR_CYCLE_TIME:
      return cycle_time_now();
    case CSR_BUS_TIME:
      ns = bus_ns();
      do_div(ns, NSEC_PER_SEC);
      return (u32)ns;
    default:
      return 0;
  }
}

static void vcard_write_csr(struct fw_card* card, int offset, u32 value) {}

static const struct fw_card_driver vcard_driver = {
    .enable = vcard_set_rom,
    .read_phy_reg = vcard_read_phy,
    .update_phy_reg = vcard_update_phy,
    .set_config_rom = vcard_set_rom,
    .send_request = vcard_send_request,
    .send_response = vcard_send_response,
    .cancel_packet = vcard_cancel_packet,
    .enable_phys_dma = vcard_enable_dma,
    .read_csr = vcard_read_csr,
    .write_csr = vcard_write_csr,
    .allocate_iso_context = vcard_allocate_iso,
    .free_iso_context = vcard_free_iso,
    .start_iso = vcard_start_iso,
    .set_iso_channels = vcard_set_iso_channels,
    .queue_iso = vcard_queue_iso,
    .flush_queue_iso = vcard_flush_queue,
    .flush_iso_completions = vcard_flush_completions,
    .stop_iso = vcard_stop_iso,
};

/* ---- /dev/vbus1394 ---- */

static int vb_open(struct inode* inode, struct file* file) {
  struct vcard* v = the_card;
  int err = 0;

  spin_lock_irq(&v->lock);
  if (v->opened)
    err = -EBUSY;
  else
    v->opened = true;
  spin_unlock_irq(&v->lock);
  file->private_data = v;
  return err ? err : nonseekable_open(inode, file);
}

static int vb_release(struct inode* inode, struct file* file) {
  struct vcard* v = file->private_data;

  spin_lock_irq(&v->lock);
  v->opened = false;
  v->node_count = 0; /* the program is gone: all its nodes are unplugged */
  spin_unlock_irq(&v->lock);
  schedule_work(&v->reset_work);
  return 0;
}

static struct vpending* first_unread(struct vcard* v) {
  struct vpending* p;

  list_for_each_entry(p, &v->pending, link) if (!p->handed_over) return p;
  return NULL;
}

static bool readable(struct vcard* v) {
  bool yes;

  spin_lock_irq(&v->lock);
  yes = v->reset_to_report || first_unread(v);
  spin_unlock_irq(&v->lock);
  return yes;
}

static ssize_t vb_read(struct file* file, char __user* to, size_t room, loff_t* pos) {
  struct vcard* v = file->private_data;
  u8 copy[sizeof(struct vb_request) + 512], *record = copy;
  size_t bytes = 0;
  struct vpending* p;
  ssize_t ret;

  while (!bytes) {
    if (!readable(v)) {
      if (file->f_flags & O_NONBLOCK) return -EAGAIN;
      if (wait_event_interruptible(v->wait, readable(v))) return -ERESTARTSYS;
    }
    spin_lock_irq(&v->lock);
    p = first_unread(v);
    if (v->reset_to_report) {
      struct vb_reset reset = {{VB_RESET, sizeof(reset)}, v->generation, v->node_count};

      bytes = sizeof(reset);
      memcpy(copy, &reset, bytes);
      v->reset_to_report = false;
    } else if (p) {
      bytes = p->record_bytes;
      record = bytes <= sizeof(copy) ? copy : kmalloc(bytes, GFP_ATOMIC);
      if (record) {
        memcpy(record, p->record, bytes);
        p->handed_over = true;
      }
    }
    spin_unlock_irq(&v->lock);
    if (!record) return -ENOMEM;
  }
  ret = bytes > room ? -EMSGSIZE : copy_to_user(to, record, bytes) ? -EFAULT : bytes;
  if (record != copy) kfree(record);
  return ret;
}

static __poll_t vb_poll(struct file* file, poll_table* table) {
  struct vcard* v = file->private_data;

  poll_wait(file, &v->wait, table);
  return EPOLLOUT | EPOLLWRNORM | (readable(v) ? EPOLLIN | EPOLLRDNORM : 0);
}

static int take_record(struct vcard* v, const u8* at, size_t length) {
  const struct vb_record* r = (const void*)at;

  if (r->type == VB_TOPOLOGY && length == sizeof(struct vb_topology)) {
    const struct vb_topology* t = (const void*)at;

    if (t->count > VB_MAX_NODES || t->speed > 3) return -EINVAL;
    spin_lock_irq(&v->lock);
    v->node_count = t->count;
    v->speed = t->speed;
    spin_unlock_irq(&v->lock);
    schedule_work(&v->reset_work);
    flush_work(&v->reset_work);
    return 0;
  }
  if (r->type == VB_RESPONSE && length >= sizeof(struct vb_response)) {
    take_response(v, (const void*)at, at + sizeof(struct vb_response),
                  length - sizeof(struct vb_response));
    return 0;
  }
  if (r->type == VB_ISO && length >= sizeof(struct vb_iso)) {
    const struct vb_iso* iso = (const void*)at;

    if (iso->channel > 63 || iso->tag > 3 || iso->sy > 15) return -EINVAL;
    take_iso(v, iso, at + sizeof(*iso), length - sizeof(*iso));
    return 0;
  }
  return -EINVAL;
}

static ssize_t vb_write(struct file* file, const char __user* from, size_t bytes, loff_t* pos) {
  struct vcard* v = file->private_data;
  size_t at = 0;
  int err = 0;
  u8* copy;

  if (bytes < sizeof(struct vb_record) || bytes > VB_MAX_WRITE) return -EINVAL;
  copy = kvmalloc(bytes, GFP_KERNEL);
  if (!copy) return -ENOMEM;
  if (copy_from_user(copy, from, bytes)) {
    kvfree(copy);
    return -EFAULT;
  }
  mutex_lock(&v->write_mutex);
  while (!err && at < bytes) {
    const struct vb_record* r = (const void*)(copy + at);

    if (bytes - at < sizeof(*r) || r->length < sizeof(*r) || r->length > bytes - at)
      err = -EINVAL;
    else
      err = take_record(v, copy + at, r->length);
    at += err ? 0 : ALIGN(r->length, 8);
  }
  mutex_unlock(&v->write_mutex);
  kvfree(copy);
  return err ? err : bytes;
}

static const struct file_operations vb_ops = {
    .owner = THIS_MODULE,
    .open = vb_open,
    .release = vb_release,
    .read = vb_read,
    .write = vb_write,
    .poll = vb_poll,
    .llseek = no_llseek,
};

static struct miscdevice vb_device = {
    .minor = MISC_DYNAMIC_MINOR,
    .name = "vbus1394",
    .fops = &vb_ops,
};

static int __init vb_init(void) {
  struct vcard* v = kzalloc(sizeof(*v), GFP_KERNEL);
  int err;

  if (!v) return -ENOMEM;
  v->pdev = platform_device_register_simple("vergence1394", -1, NULL, 0);
  if (IS_ERR(v->pdev)) {
    err = PTR_ERR(v->pdev);
    goto fail_free;
  }
  err = dma_coerce_mask_and_coherent(&v->pdev->dev, DMA_BIT_MASK(64));
  if (err) goto fail_device;
  spin_lock_init(&v->lock);
  mutex_init(&v->write_mutex);
  INIT_LIST_HEAD(&v->pending);
  INIT_LIST_HEAD(&v->contexts);
  init_waitqueue_head(&v->wait);
  INIT_WORK(&v->reset_work, reset_work);
  v->speed = SCODE_400;
  v->gap_count = 5;
  v->bandwidth = BANDWIDTH_AVAILABLE_INITIAL;
  the_card = v;
  fw_card_initialize(&v->card, &vcard_driver, &v->pdev->dev);
  err = fw_card_add(&v->card, 10, SCODE_800, VB_GUID); /* 2^(10+1) bytes of payload */
  if (err) goto fail_device;
  err = misc_register(&vb_device);
  if (err) goto fail_card;
  return 0;
fail_card:
  fw_core_remove_card(&v->card);
  cancel_work_sync(&v->reset_work);
fail_device:
  platform_device_unregister(v->pdev);
fail_free:
  kfree(v);
  return err;
}

static void __exit vb_exit(void) {
  struct vcard* v = the_card;

  misc_deregister(&vb_device);
  fw_core_remove_card(&v->card);
  cancel_work_sync(&v->reset_work);
  platform_device_unregister(v->pdev);
  kfree(v);
}

/* After the FireWire core, also when built in. */
late_initcall(vb_init);
module_exit(vb_exit);

MODULE_DESCRIPTION("Virtual IEEE 1394 card; remote nodes live in a user program");
MODULE_LICENSE("Dual MIT/GPL");
