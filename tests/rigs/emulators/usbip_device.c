#include "tests/rigs/emulators/usbip_device.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

#define VHCI "/sys/devices/platform/vhci_hcd.0/"
#define HEADER 48u
#define MOST_DATA (4u << 20)

enum { CMD_SUBMIT = 1, CMD_UNLINK = 2, RET_SUBMIT = 3, RET_UNLINK = 4 };

static uint32_t get32(const uint8_t* p) {
  return (uint32_t)p[0] << 24 | (uint32_t)p[1] << 16 | (uint32_t)p[2] << 8 | p[3];
}

static void put32(uint8_t* p, uint32_t v) {
  p[0] = (uint8_t)(v >> 24);
  p[1] = (uint8_t)(v >> 16);
  p[2] = (uint8_t)(v >> 8);
  p[3] = (uint8_t)v;
}

static bool send_all(struct usb_device* d, const uint8_t* head, const uint8_t* data, size_t bytes) {
  struct iovec parts[2] = {{(void*)head, HEADER}, {(void*)data, bytes}};
  struct msghdr m = {.msg_iov = parts, .msg_iovlen = bytes ? 2 : 1};
  size_t left = HEADER + bytes;

  while (left) {
    ssize_t n = sendmsg(d->fd, &m, MSG_NOSIGNAL);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    left -= (size_t)n;
    for (size_t i = 0, gone = (size_t)n; i < 2 && gone; i++) {
      size_t now = gone < parts[i].iov_len ? gone : parts[i].iov_len;
      parts[i].iov_base = (uint8_t*)parts[i].iov_base + now;
      parts[i].iov_len -= now;
      gone -= now;
    }
  }
  return true;
}

/* `actual` counts for OUT transfers, too, which carry no data back. */
static void complete(struct usb_device* d, uint32_t seqnum, int status, uint32_t actual,
                     const uint8_t* data, size_t bytes) {
  uint8_t head[HEADER] = {0};
  put32(head, RET_SUBMIT);
  put32(head + 4, seqnum);
  put32(head + 20, (uint32_t)status);
  put32(head + 24, actual);
  send_all(d, head, data, bytes);
}

static int free_port(void) {
  char hub[16], line[256];
  int port, status, found = -1;
  FILE* f = fopen(VHCI "status", "r");

  if (!f) return -1;
  while (found < 0 && fgets(line, sizeof line, f))
    if (sscanf(line, "%15s %d %d", hub, &port, &status) == 3 && status == 4 && !strcmp(hub, "hs"))
      found = port;
  fclose(f);
  return found;
}

static int write_file(const char* path, const char* text) {
  int fd = open(path, O_WRONLY);
  ssize_t n = fd < 0 ? -1 : write(fd, text, strlen(text));
  int error = errno;
  if (fd >= 0) close(fd);
  errno = error;
  return n == (ssize_t)strlen(text) ? 0 : -1;
}

int usb_plug(struct usb_device* d) {
  int pair[2], size = 4 << 20;
  char text[64];

  if (socketpair(AF_UNIX, SOCK_STREAM, 0, pair)) return perror("usbip: socketpair"), -1;
  setsockopt(pair[0], SOL_SOCKET, SO_SNDBUFFORCE, &size, sizeof size);
  for (int attempt = 0;; attempt++) {
    d->port = free_port();
    if (d->port >= 0) {
      snprintf(text, sizeof text, "%d %d %d %d", d->port, pair[1], 0x10000 + d->port + 2,
               (int)d->speed);
      if (!write_file(VHCI "attach", text)) break;
    }
    /* a port just left needs a moment, and another emulator may have been faster */
    if (attempt == 100 || (d->port >= 0 && errno != EBUSY)) {
      fprintf(stderr, "usbip: no port of vhci_hcd: %s\n",
              d->port < 0 ? "none is free" : strerror(errno));
      close(pair[0]);
      close(pair[1]);
      return -1;
    }
    usleep(20000);
  }
  close(pair[1]);
  d->fd = pair[0];
  d->filled = 0;
  d->configuration = 0;
  memset(d->waiting_count, 0, sizeof d->waiting_count);
  if (!d->input) {
    d->room = MOST_DATA;
    d->input = malloc(d->room);
  }
  return d->input ? 0 : -1;
}

void usb_unplug(struct usb_device* d) {
  if (d->fd < 0) return;
  shutdown(d->fd, SHUT_RDWR);
  close(d->fd);
  d->fd = -1;
}

/* Descriptors and the other standard requests. -1 stalls. */
static int standard(struct usb_device* d, const struct usb_setup* s, uint8_t* data) {
  unsigned kind = s->value >> 8, which = s->value & 0xff;

  if (s->request == 6 && (s->type & 0x80)) { /* GET_DESCRIPTOR */
    if (kind == 1) {
      memcpy(data, d->device_descriptor, 18);
      return 18;
    }
    if (kind == 2 && which == 0) {
      int total = d->config_descriptor[2] | d->config_descriptor[3] << 8;
      memcpy(data, d->config_descriptor, (size_t)total);
      return total;
    }
    if (kind == 3 && which == 0) {
      memcpy(data, "\x04\x03\x09\x04", 4);
      return 4;
    }
    if (kind == 3 && which < 8 && d->strings[which]) {
      size_t n = strlen(d->strings[which]);
      data[0] = (uint8_t)(2 + 2 * n);
      data[1] = 3;
      for (size_t i = 0; i < n; i++) {
        data[2 + 2 * i] = (uint8_t)d->strings[which][i];
        data[3 + 2 * i] = 0;
      }
      return data[0];
    }
    return -1;
  }
  switch (s->request) {
    case 0: /* GET_STATUS */
      data[0] = data[1] = 0;
      return 2;
    case 1:  /* CLEAR_FEATURE */
    case 3:  /* SET_FEATURE */
    case 11: /* SET_INTERFACE */
      return 0;
    case 8:
      data[0] = d->configuration;
      return 1;
    case 9:
      d->configuration = (uint8_t)s->value;
      return 0;
    case 10:
      data[0] = 0;
      return 1;
    default:
      return -1;
  }
}

static void submit(struct usb_device* d, const uint8_t* head, const uint8_t* carried,
                   uint32_t length) {
  uint32_t seqnum = get32(head + 4);
  bool in = get32(head + 12) != 0;
  unsigned endpoint = get32(head + 16) & 15;

  if (endpoint == 0) {
    static uint8_t data[65536 + 64];
    const uint8_t* p = head + 40;
    struct usb_setup s = {p[0], p[1], (uint16_t)(p[2] | p[3] << 8), (uint16_t)(p[4] | p[5] << 8),
                          (uint16_t)(p[6] | p[7] << 8)};
    int n;

    memset(data, 0, 256);
    if (!in && length) memcpy(data, carried, length < 65536 ? length : 65536);
    n = (s.type & 0x60) == 0 ? standard(d, &s, data)
        : d->control         ? d->control(d->self, &s, data)
                             : -1;
    if (n < 0)
      complete(d, seqnum, -EPIPE, 0, NULL, 0);
    else if (in)
      complete(d, seqnum, 0, (uint32_t)n < length ? (uint32_t)n : length, data,
               (uint32_t)n < length ? (uint32_t)n : length);
    else
      complete(d, seqnum, 0, length, NULL, 0);
  } else if (in) {
    if (d->waiting_count[endpoint] == USB_MAX_WAITING) {
      complete(d, seqnum, -ENOMEM, 0, NULL, 0);
      return;
    }
    d->waiting[endpoint][d->waiting_count[endpoint]++] = (struct usb_waiting){seqnum, length};
  } else {
    if (d->out) d->out(d->self, endpoint, carried, length);
    complete(d, seqnum, 0, length, NULL, 0);
  }
}

static void forget(struct usb_device* d, unsigned endpoint, unsigned i) {
  d->waiting_count[endpoint]--;
  memmove(&d->waiting[endpoint][i], &d->waiting[endpoint][i + 1],
          (d->waiting_count[endpoint] - i) * sizeof d->waiting[0][0]);
}

static void unlink_transfer(struct usb_device* d, const uint8_t* head) {
  uint32_t which = get32(head + 20);
  uint8_t reply[HEADER] = {0};
  int status = 0;

  for (unsigned e = 0; e < 16; e++)
    for (unsigned i = 0; i < d->waiting_count[e]; i++)
      if (d->waiting[e][i].seqnum == which) {
        forget(d, e, i);
        status = -ECONNRESET;
      }
  put32(reply, RET_UNLINK);
  memcpy(reply + 4, head + 4, 4);
  put32(reply + 20, (uint32_t)status);
  send_all(d, reply, NULL, 0);
}

bool usb_service(struct usb_device* d) {
  size_t at = 0;
  ssize_t n;

  if (d->fd < 0) return false;
  n = recv(d->fd, d->input + d->filled, d->room - d->filled, MSG_DONTWAIT);
  if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) {
    close(d->fd);
    d->fd = -1;
    return false;
  }
  d->filled += n > 0 ? (size_t)n : 0;
  while (d->filled - at >= HEADER) {
    const uint8_t* head = d->input + at;
    uint32_t command = get32(head), length = 0, carried = 0;

    if (command == CMD_SUBMIT) {
      length = get32(head + 24);
      carried = get32(head + 12) ? 0 : length;
      if (length > MOST_DATA - HEADER) break;
      if (d->filled - at < HEADER + carried) break;
      submit(d, head, head + HEADER, length);
    } else {
      unlink_transfer(d, head);
    }
    at += HEADER + carried;
  }
  d->filled -= at;
  memmove(d->input, d->input + at, d->filled);
  return true;
}

long usb_in_room(const struct usb_device* d, unsigned endpoint) {
  return d->fd >= 0 && d->waiting_count[endpoint] ? (long)d->waiting[endpoint][0].length : -1;
}

size_t usb_in(struct usb_device* d, unsigned endpoint, const uint8_t* data, size_t bytes) {
  struct usb_waiting w;
  if (usb_in_room(d, endpoint) < 0) return 0;
  w = d->waiting[endpoint][0];
  forget(d, endpoint, 0);
  if (bytes > w.length) bytes = w.length;
  complete(d, w.seqnum, 0, (uint32_t)bytes, data, bytes);
  return bytes;
}
