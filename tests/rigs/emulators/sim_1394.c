/* sim_1394: cameras on the virtual IEEE 1394 bus (/dev/vbus1394), at most three.
 *
 * Options and commands are those of sim_cameras.h, and the command
 *   plug N        N cameras on the bus from now on (0 to 3): a bus reset
 * An incomplete frame lacks one packet in its middle. At the end it prints for each camera what
 * was exposed and what was put on the bus.
 */
#include <endian.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "tests/rigs/emulators/sim_cameras.h"
#include "tests/rigs/emulators/sim_clock.h"
#include "tests/rigs/kernel/vergence_1394_abi.h"

#define MAX_BATCH (1u << 20)

enum { WRITE_QUADLET = 0, WRITE_BLOCK = 1, READ_QUADLET = 4, READ_BLOCK = 5, LOCK = 9 };

struct node {
  struct sim_camera c;
  uint64_t next_cycle; /* of its next packet */
};

static struct node nodes[VB_MAX_NODES];
static unsigned node_count;
static int bus = -1;

/* The bus clock may drift against CLOCK_MONOTONIC: the card says how. */
static long drift_ppb, offset_s;

static long parameter(const char* name) {
  char path[96];
  long v = 0;
  snprintf(path, sizeof path, "/sys/module/vergence_1394/parameters/%s", name);
  FILE* f = fopen(path, "r");
  if (f) {
    if (fscanf(f, "%ld", &v) != 1) v = 0;
    fclose(f);
  }
  return v;
}

static uint64_t bus_time(uint64_t ns) {
  return ns + (uint64_t)((int64_t)ns * drift_ppb / 1000000000) + (uint64_t)offset_s * 1000000000u;
}

static void send_records(const void* records, size_t bytes) {
  if (bytes && write(bus, records, bytes) != (ssize_t)bytes)
    fprintf(stderr, "sim_1394: write: %s\n", strerror(errno));
}

static void announce(void) {
  struct vb_topology t = {{VB_TOPOLOGY, sizeof t}, node_count, 2};
  send_records(&t, sizeof t);
}

static void answer(const struct vb_request* q) {
  union {
    struct vb_response head;
    uint8_t bytes[sizeof(struct vb_response) + 4096];
  } r;
  const uint8_t* in = (const uint8_t*)(q + 1);
  uint8_t* out = r.bytes + sizeof r.head;
  struct iidc_camera* c = &nodes[q->node % VB_MAX_NODES].c.camera;
  size_t carried = 0;
  uint32_t v;
  int rcode = 0;

  switch (q->tcode) {
    case READ_QUADLET:
    case READ_BLOCK:
      for (; carried + 4 <= q->size && !rcode; carried += 4) {
        rcode = iidc_read(c, q->offset + carried, &v);
        v = htobe32(v);
        memcpy(out + carried, &v, 4);
      }
      break;
    case WRITE_QUADLET:
    case WRITE_BLOCK:
      for (size_t i = 0; i + 4 <= q->size && !rcode; i += 4) {
        memcpy(&v, in + i, 4);
        rcode = iidc_write(c, q->offset + i, be32toh(v));
      }
      break;
    default:
      rcode = 6; /* type error: these cameras know no lock */
      break;
  }
  if (rcode) carried = 0;
  r.head.r.type = VB_RESPONSE;
  r.head.r.length = (uint32_t)(sizeof r.head + carried);
  r.head.cookie = q->cookie;
  r.head.rcode = (uint32_t)rcode;
  send_records(&r, r.head.r.length);
}

/* Appends the packets that are due up to `cycle` to the batch, at the pace of the bus: one each 125
 * us. */
static size_t transmit(struct node* n, uint64_t cycle, uint8_t* batch, size_t room) {
  struct iidc_camera* c = &n->c.camera;
  size_t used = 0, packet = iidc_packet_bytes(c);

  while (n->c.sent < n->c.bytes && n->next_cycle <= cycle && packet) {
    size_t bytes = n->c.bytes - n->c.sent < packet ? n->c.bytes - n->c.sent : packet;
    struct vb_iso iso = {
        {VB_ISO, (uint32_t)(sizeof iso + packet)}, (uint8_t)c->channel, 0, n->c.sent == 0, 0, 0};
    size_t whole = (sizeof iso + packet + 7) & ~(size_t)7;
    if (n->c.tearing && n->c.sent >= n->c.bytes / 2) { /* nobody hears this one */
      n->c.tearing = false;
      n->c.sent += bytes;
      n->next_cycle++;
      continue;
    }
    if (used + whole > room) break;
    iso.cycle = (uint32_t)(n->next_cycle / 8000 % 8 << 13 | n->next_cycle % 8000);
    memcpy(batch + used, &iso, sizeof iso);
    memcpy(batch + used + sizeof iso, n->c.image + n->c.sent, bytes);
    memset(batch + used + sizeof iso + bytes, 0,
           whole - sizeof iso - bytes); /* the last packet is padded */
    used += whole;
    n->c.sent += bytes;
    n->next_cycle++;
  }
  return used;
}

/* What this camera puts on the bus until now. A frame starts in the cycle after its exposure. */
static size_t advance(struct node* n, uint64_t ns, uint64_t edge, uint8_t* batch, size_t room) {
  struct iidc_camera* c = &n->c.camera;
  uint64_t begin, cycle = bus_time(ns) / 125000, shutter = (uint64_t)((double)c->shutter_abs * 1e9);
  size_t used = transmit(n, cycle, batch, room);

  while (iidc_next_frame(c, &n->c.sensor, ns, edge, &begin)) {
    edge = 0;
    n->c.exposed++;
    if (n->c.sent < n->c.bytes) { /* the bus is slower than the trigger */
      n->c.overtaken++;
      c->frames_made++;
      continue;
    }
    n->c.bytes = iidc_frame_bytes(c);
    n->c.image = realloc(n->c.image, n->c.bytes + 64);
    iidc_draw(c, n->c.image, begin + shutter / 2,
              cycle_time(bus_time(begin + shutter))); /* cameras stamp its end */
    n->c.sent = 0;
    n->c.tearing = false;
    n->next_cycle = bus_time(begin + shutter) / 125000 + 1;
    if (n->c.drop) {
      n->c.drop--;
      n->c.dropped++;
      n->c.sent = n->c.bytes;
    } else if (n->c.tear) {
      n->c.tear--;
      n->c.incomplete++;
      n->c.tearing = true;
    } else {
      n->c.transmitted++;
    }
    used += transmit(n, cycle, batch + used, room - used);
  }
  return used;
}

static bool plug(const char* line) {
  unsigned a = 0;
  if (sscanf(line, "plug %u", &a) != 1 || a > VB_MAX_NODES) return false;
  node_count = a;
  announce();
  return true;
}

int main(int argc, char** argv) {
  struct sim_options o;
  struct sim_camera* cameras[VB_MAX_NODES];
  uint8_t* batch = malloc(MAX_BATCH);

  if (sim_parse(argc, argv, VB_MAX_NODES, &o) || !batch) return 2;
  node_count = o.cameras;
  bus = open("/dev/vbus1394", O_RDWR | O_NONBLOCK);
  if (bus < 0) return perror("sim_1394: /dev/vbus1394"), 1;
  for (unsigned i = 0; i < VB_MAX_NODES; i++) {
    cameras[i] = &nodes[i].c;
    iidc_init(&cameras[i]->camera, i);
    if (i < node_count && o.film && iidc_load_film(&cameras[i]->camera, o.film, i, o.film_hz))
      return 1;
  }
  drift_ppb = parameter("drift_ppb");
  offset_s = parameter("offset_s");
  announce();
  sim_tell_ready(&o);

  for (;;) {
    struct pollfd fds[2] = {{bus, POLLIN, 0}, {sim_listening() ? 0 : -1, POLLIN, 0}};
    uint64_t edge = 0;
    bool busy = false;
    union {
      struct vb_record head;
      struct vb_request request;
      uint8_t bytes[8192];
    } record;

    for (unsigned i = 0; i < node_count; i++) busy |= sim_busy(cameras[i]);
    poll(fds, 2, busy ? 1 : 20);
    if (fds[1].revents && !sim_obey(cameras, VB_MAX_NODES, &edge, plug)) break;
    while (read(bus, &record, sizeof record) > 0)
      if (record.head.type == VB_REQUEST) answer(&record.request);

    uint64_t ns = now_ns(), pulse = o.trigger_hz > 0 ? sim_pulse(&o, ns) : 0;
    if (pulse) edge = pulse;
    size_t used = 0;
    for (unsigned i = 0; i < node_count; i++)
      used += advance(&nodes[i], ns, edge, batch + used, MAX_BATCH - used);
    send_records(batch, used);
  }
  for (unsigned i = 0; i < VB_MAX_NODES; i++) sim_report("sim_1394", i, cameras[i], "transmitted");
  return 0;
}
