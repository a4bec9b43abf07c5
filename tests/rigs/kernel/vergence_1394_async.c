// SPDX-License-Identifier: GPL-2.0 OR MIT
/* Asynchronous packets of the virtual IEEE 1394 card: requests to itself and to the program. */
#include <linux/uaccess.h>

#include "vergence_1394_card.h"

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

void vcard_send_request(struct fw_card* card, struct fw_packet* packet) {
  struct vcard* v = to_vcard(card);

  packet->timestamp = (vcard_cycle_time() >> 12) & 0xffff;
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

void vcard_send_response(struct fw_card* card, struct fw_packet* packet) {
  struct vcard* v = to_vcard(card);

  packet->timestamp = (vcard_cycle_time() >> 12) & 0xffff;
  if (H0_DEST(packet->header[0]) == (LOCAL_BUS | v->node_count))
    fw_core_handle_response(card, packet);
  packet->ack = ACK_COMPLETE;
  packet->callback(packet, card, packet->ack);
}

int vcard_cancel_packet(struct fw_card* card, struct fw_packet* packet) {
  return -ENOENT; /* every packet has left by the time the core could ask */
}

/* A response of the program becomes a packet of the bus. */
int vcard_take_response(struct vcard* v, const struct vb_response* r, const u8* payload,
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
  response.timestamp = (vcard_cycle_time() >> 12) & 0xffff;
  response.generation = v->generation;
  fw_core_handle_response(&v->card, &response);
  kfree(p->record);
  kfree(p);
  return 0;
}
