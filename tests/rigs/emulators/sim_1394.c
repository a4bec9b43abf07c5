/* sim_1394: cameras on the virtual IEEE 1394 bus (/dev/vbus1394).
 *
 *   sim_1394 [--cameras N] [--s800] [--trigger-hz F] [--seconds S] [--ready FILE] [--film DIR]
 * [--film-hz F]
 *
 * Commands on standard input, one a line:
 *   plug N        N cameras on the bus from now on (0 to 3): a bus reset
 *   trigger [NS]  one external trigger pulse to all cameras, now or at that time of
 * CLOCK_MONOTONIC, a moment ago miss C N      the next N pulses do not reach camera C drop C N the
 * next N frames of camera C are exposed but lost on the wire tear C N      the next N frames of
 * camera C lose one packet each, in the middle mute C 0|1    camera C stops sending / goes on quit
 * At the end it prints for each camera what was exposed and what was put on the bus.
 */
#include <endian.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "tests/rigs/emulators/iidc_model.h"
#include "tests/rigs/emulators/sim_clock.h"
#include "tests/rigs/kernel/vergence_1394_abi.h"

#define MAX_BATCH (1u << 20)

enum { WRITE_QUADLET = 0, WRITE_BLOCK = 1, READ_QUADLET = 4, READ_BLOCK = 5, LOCK = 9 };

struct node {
  struct iidc_camera camera;
  uint8_t* image; /* the frame on its way, or NULL-sized */
  size_t bytes, sent;
  uint64_t next_cycle; /* of its next packet */
  struct iidc_sensor sensor;
  unsigned drop, tear, miss;
  bool muted, tearing;
  uint64_t exposed, transmitted, overtaken, dropped, torn;
};

static struct node nodes[VB_MAX_NODES];
static unsigned node_count = 2;
static bool s800;
static int bus = -1;
static volatile sig_atomic_t stop;

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

static void bus_clock(void) {
  drift_ppb = parameter("drift_ppb");
  offset_s = parameter("offset_s");
}

static uint64_t bus_time(uint64_t ns) {
  return ns + (uint64_t)((int64_t)ns * drift_ppb / 1000000000) + (uint64_t)offset_s * 1000000000u;
}

static void on_signal(int n) {
  (void)n;
  stop = 1;
}

static void send_records(const void* records, size_t bytes) {
  if (bytes && write(bus, records, bytes) != (ssize_t)bytes)
    fprintf(stderr, "sim_1394: write: %s\n", strerror(errno));
}

static void announce(void) {
  struct vb_topology t = {{VB_TOPOLOGY, sizeof t}, node_count, s800 ? 3 : 2};
  send_records(&t, sizeof t);
}

static void answer(const struct vb_request* q) {
  union {
    struct vb_response head;
    uint8_t bytes[sizeof(struct vb_response) + 4096];
  } r;
  const uint8_t* in = (const uint8_t*)(q + 1);
  uint8_t* out = r.bytes + sizeof r.head;
  struct iidc_camera* c = &nodes[q->node % VB_MAX_NODES].camera;
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
  struct iidc_camera* c = &n->camera;
  size_t used = 0, packet = iidc_packet_bytes(c);

  while (n->sent < n->bytes && n->next_cycle <= cycle && packet) {
    size_t bytes = n->bytes - n->sent < packet ? n->bytes - n->sent : packet;
    struct vb_iso iso = {
        {VB_ISO, (uint32_t)(sizeof iso + packet)}, (uint8_t)c->channel, 0, n->sent == 0, 0, 0};
    size_t whole = (sizeof iso + packet + 7) & ~(size_t)7;
    if (n->tearing && n->sent >= n->bytes / 2) { /* nobody hears this one */
      n->tearing = false;
      n->sent += bytes;
      n->next_cycle++;
      continue;
    }
    if (used + whole > room) break;
    iso.cycle = (uint32_t)(n->next_cycle / 8000 % 8 << 13 | n->next_cycle % 8000);
    memcpy(batch + used, &iso, sizeof iso);
    memcpy(batch + used + sizeof iso, n->image + n->sent, bytes);
    memset(batch + used + sizeof iso + bytes, 0,
           whole - sizeof iso - bytes); /* the last packet is padded */
    used += whole;
    n->sent += bytes;
    n->next_cycle++;
  }
  return used;
}

/* What this camera puts on the bus until now. A frame starts in the cycle after its exposure. */
static size_t advance(struct node* n, uint64_t ns, uint64_t edge, uint8_t* batch, size_t room) {
  struct iidc_camera* c = &n->camera;
  uint64_t begin, cycle = bus_time(ns) / 125000, shutter = (uint64_t)((double)c->shutter_abs * 1e9);
  size_t used = transmit(n, cycle, batch, room);

  while (iidc_next_frame(c, &n->sensor, ns, edge, &begin)) {
    edge = 0;
    n->exposed++;
    if (n->sent < n->bytes) { /* the bus is slower than the trigger */
      n->overtaken++;
      c->frames_made++;
      continue;
    }
    n->bytes = iidc_frame_bytes(c);
    n->image = realloc(n->image, n->bytes + 64);
    iidc_draw(c, n->image, begin + shutter / 2,
              cycle_time(bus_time(begin + shutter))); /* cameras stamp its end */
    n->sent = 0;
    n->tearing = false;
    n->next_cycle = bus_time(begin + shutter) / 125000 + 1;
    if (n->drop || n->muted) {
      n->drop -= n->drop > 0;
      n->dropped++;
      n->sent = n->bytes;
    } else if (n->tear) {
      n->tear--;
      n->torn++;
      n->tearing = true;
    } else {
      n->transmitted++;
    }
    used += transmit(n, cycle, batch + used, room - used);
  }
  return used;
}

static void command(const char* line, uint64_t* edge) {
  unsigned a = 0, b = 0;
  unsigned long long at = 0;
  if (sscanf(line, "plug %u", &a) == 1 && a <= VB_MAX_NODES) {
    node_count = a;
    announce();
  } else if (sscanf(line, "trigger %llu", &at) == 1) {
    *edge = at;
  } else if (!strncmp(line, "trigger", 7)) {
    *edge = now_ns();
  } else if (sscanf(line, "drop %u %u", &a, &b) == 2 && a < VB_MAX_NODES) {
    nodes[a].drop = b;
  } else if (sscanf(line, "miss %u %u", &a, &b) == 2 && a < VB_MAX_NODES) {
    nodes[a].miss = b;
  } else if (sscanf(line, "tear %u %u", &a, &b) == 2 && a < VB_MAX_NODES) {
    nodes[a].tear = b;
  } else if (sscanf(line, "mute %u %u", &a, &b) == 2 && a < VB_MAX_NODES) {
    nodes[a].muted = b;
  } else if (!strncmp(line, "quit", 4)) {
    stop = 1;
  } else {
    fprintf(stderr, "sim_1394: what is '%s'?\n", line);
  }
}

int main(int argc, char** argv) {
  double trigger_hz = 0, seconds = 0, film_hz = 10;
  const char *ready = NULL, *film = NULL;
  uint64_t start = now_ns(), last_pulse = 0;
  uint8_t* batch = malloc(MAX_BATCH);
  char line[128];
  size_t filled = 0;
  bool input = true;

  for (int i = 1; i < argc; i++) {
    const char* value = i + 1 < argc ? argv[i + 1] : "0";
    if (!strcmp(argv[i], "--cameras"))
      node_count = (unsigned)atoi(value), i++;
    else if (!strcmp(argv[i], "--s800"))
      s800 = true;
    else if (!strcmp(argv[i], "--trigger-hz"))
      trigger_hz = atof(value), i++;
    else if (!strcmp(argv[i], "--seconds"))
      seconds = atof(value), i++;
    else if (!strcmp(argv[i], "--film"))
      film = value, i++;
    else if (!strcmp(argv[i], "--film-hz"))
      film_hz = atof(value), i++;
    else if (!strcmp(argv[i], "--ready"))
      ready = value, i++;
    else
      return fprintf(stderr, "sim_1394: unknown option %s\n", argv[i]), 2;
  }
  if (node_count > VB_MAX_NODES || !batch) return 2;
  bus = open("/dev/vbus1394", O_RDWR | O_NONBLOCK);
  if (bus < 0) return perror("sim_1394: /dev/vbus1394"), 1;
  signal(SIGTERM, on_signal);
  signal(SIGINT, on_signal);
  for (unsigned i = 0; i < VB_MAX_NODES; i++) {
    iidc_init(&nodes[i].camera, i);
    if (s800) iidc_init_beta(&nodes[i].camera);
    if (i < node_count && film && iidc_load_film(&nodes[i].camera, film, i, film_hz)) return 1;
  }
  bus_clock();
  announce();
  if (ready) close(open(ready, O_CREAT | O_WRONLY, 0644));

  while (!stop) {
    struct pollfd fds[2] = {{bus, POLLIN, 0}, {input ? 0 : -1, POLLIN, 0}};
    uint64_t edge = 0;
    bool busy = false;
    union {
      struct vb_record head;
      struct vb_request request;
      uint8_t bytes[8192];
    } record;

    for (unsigned i = 0; i < node_count; i++)
      busy |= nodes[i].camera.transmitting || nodes[i].camera.one_shot ||
              nodes[i].camera.multi_shot || nodes[i].sent < nodes[i].bytes;
    poll(fds, 2, busy ? 1 : 20);
    if (fds[1].revents) {
      ssize_t got = read(0, line + filled, sizeof line - 1 - filled);
      if (got <= 0) {
        input = false;
      } else {
        char* end;
        filled += (size_t)got;
        line[filled] = 0;
        while ((end = strchr(line, '\n'))) {
          *end = 0;
          command(line, &edge);
          filled -= (size_t)(end + 1 - line);
          memmove(line, end + 1, filled + 1);
        }
        if (filled == sizeof line - 1) filled = 0;
      }
    }
    while (read(bus, &record, sizeof record) > 0)
      if (record.head.type == VB_REQUEST) answer(&record.request);

    uint64_t ns = now_ns();
    if (trigger_hz > 0) {
      uint64_t pulse = (uint64_t)((double)ns * 1e-9 * trigger_hz);
      if (pulse != last_pulse) edge = (uint64_t)((double)pulse / trigger_hz * 1e9);
      last_pulse = pulse;
    }
    size_t used = 0;
    for (unsigned i = 0; i < node_count; i++) {
      bool missed = edge && nodes[i].miss;
      nodes[i].miss -= missed;
      used += advance(&nodes[i], ns, missed ? 0 : edge, batch + used, MAX_BATCH - used);
    }
    send_records(batch, used);
    if (seconds > 0 && (double)(ns - start) > seconds * 1e9) break;
  }
  for (unsigned i = 0; i < VB_MAX_NODES; i++)
    if (nodes[i].exposed)
      printf(
          "sim_1394: camera %u exposed %llu transmitted %llu torn %llu dropped %llu overtaken %llu "
          "missed triggers %llu\n",
          i, (unsigned long long)nodes[i].exposed, (unsigned long long)nodes[i].transmitted,
          (unsigned long long)nodes[i].torn, (unsigned long long)nodes[i].dropped,
          (unsigned long long)nodes[i].overtaken, (unsigned long long)nodes[i].sensor.missed_edges);
  return 0;
}
