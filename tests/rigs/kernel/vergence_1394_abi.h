/* SPDX-License-Identifier: GPL-2.0 OR MIT */
/*
 * /dev/vbus1394: a virtual IEEE 1394 bus. The kernel side (vergence_1394_main.c) is a card driver
 * for the kernel's own FireWire core; the other nodes of the bus live in one user program, which
 * opens the device, announces the nodes, answers the requests sent to them and sends isochronous
 * packets.
 * All records start with struct vb_record and are padded to 8 bytes. Host byte order, except packet
 * payload, which is bus order (big endian) as on the wire.
 */
#ifndef VERGENCE_1394_ABI_H
#define VERGENCE_1394_ABI_H

#include <linux/types.h>

enum {
  /* program -> kernel (any number of records in one write) */
  VB_TOPOLOGY = 1, /* struct vb_topology: the nodes now present; always a bus reset */
  VB_RESPONSE = 2, /* struct vb_response, then length - sizeof bytes of payload */
  VB_ISO = 3,      /* struct vb_iso, then the payload of one isochronous packet */
  /* kernel -> program (one record in one read) */
  VB_REQUEST = 16, /* struct vb_request, then payload */
  VB_RESET = 17,   /* struct vb_reset */
};

#define VB_MAX_NODES 3

struct vb_record {
  __u32 type;
  __u32 length; /* of the whole record with this header, without padding */
};

struct vb_topology {
  struct vb_record r;
  __u32
      count; /* 0 to VB_MAX_NODES; node i gets physical id i, the host is the root with id count */
  __u32 speed; /* 2: S400, 3: S800 */
};

struct vb_request {
  struct vb_record r;
  __u32 generation;
  __u32 cookie;
  __u16 node; /* physical id */
  __u8 tcode;
  __u8 speed;
  __u16 extcode; /* of a lock request */
  __u16 size;    /* asked for (reads) or carried (writes, locks) */
  __u64 offset;
};

struct vb_response {
  struct vb_record r;
  __u32 cookie;
  __u32 rcode;
};

struct vb_iso {
  struct vb_record r;
  __u8 channel;
  __u8 tag;
  __u8 sy;
  __u8 reserved;
  __u32 cycle; /* 0xffffffff: now; else seconds (3 bits) << 13 | cycle (13 bits) */
};

struct vb_reset {
  struct vb_record r;
  __u32 generation;
  __u32 count;
};

#endif
