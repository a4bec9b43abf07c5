// SPDX-License-Identifier: GPL-2.0 OR MIT
/* Isochronous reception of the virtual IEEE 1394 card. */
#include <linux/highmem.h>

#include "vergence_1394_card.h"

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

void vcard_take_iso(struct vcard* v, const struct vb_iso* iso, const u8* data, size_t bytes) {
  u32 stamp = iso->cycle == 0xffffffff ? (vcard_cycle_time() >> 12) & 0xffff : iso->cycle & 0xffff;
  struct vcontext* c;

  spin_lock_irq(&v->lock);
  list_for_each_entry(c, &v->contexts, link) if (c->base.channel == iso->channel)
      deliver(c, iso, stamp, data, bytes);
  spin_unlock_irq(&v->lock);
}

/* An OHCI controller gives a channel to one receive context. */
static bool channel_taken(const struct vcard* v, int channel) {
  const struct vcontext* c;

  list_for_each_entry(c, &v->contexts, link) if (c->base.channel == channel) return true;
  return false;
}

struct fw_iso_context* vcard_allocate_iso(struct fw_card* card, int type, int channel,
                                          size_t header_size) {
  struct vcard* v = to_vcard(card);
  struct vcontext* c;
  bool taken;

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
  taken = channel_taken(v, channel);
  if (!taken) list_add_tail(&c->link, &v->contexts);
  spin_unlock_irq(&v->lock);
  if (taken) {
    free_page((unsigned long)c->header);
    kfree(c);
    return ERR_PTR(-EBUSY);
  }
  return &c->base;
}

static void drop_slots(struct vcontext* c) {
  struct vslot *s, *next;

  list_for_each_entry_safe(s, next, &c->slots, link) {
    list_del(&s->link);
    kfree(s);
  }
}

int vcard_start_iso(struct fw_iso_context* base, s32 cycle, u32 sync, u32 tags) {
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

int vcard_stop_iso(struct fw_iso_context* base) {
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

void vcard_free_iso(struct fw_iso_context* base) {
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

int vcard_set_iso_channels(struct fw_iso_context* base, u64* channels) { return -EOPNOTSUPP; }

int vcard_queue_iso(struct fw_iso_context* base, struct fw_iso_packet* packet,
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

void vcard_flush_queue(struct fw_iso_context* base) {}

int vcard_flush_completions(struct fw_iso_context* base) {
  struct vcontext* c = container_of(base, struct vcontext, base);
  struct vcard* v = to_vcard(base->card);
  unsigned long flags;

  spin_lock_irqsave(&v->lock, flags);
  report_headers(c);
  spin_unlock_irqrestore(&v->lock, flags);
  return 0;
}
