/* The device side of USB/IP, for devices that are programs: plugs a device into the kernel's
 * virtual host controller (vhci_hcd) through a socket pair. No server, no network. One thread; the
 * caller polls usb.fd. */
#ifndef USBIP_DEVICE_H
#define USBIP_DEVICE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define USB_MAX_WAITING 512

enum usb_speed { USB_FULL = 2, USB_HIGH = 3 };

struct usb_setup {
  uint8_t type, request;
  uint16_t value, index, length;
};

struct usb_device {
  /* set by the emulator before usb_plug() */
  const uint8_t *device_descriptor, *config_descriptor;
  const char* strings[8]; /* 1 = manufacturer and so on */
  enum usb_speed speed;
  void* self;
  /* Requests that are not standard ones. `data` holds what came, or takes what goes. Returns bytes,
   * or -1 to stall. */
  int (*control)(void* self, const struct usb_setup* setup, uint8_t* data);
  void (*out)(void* self, unsigned endpoint, const uint8_t* data, size_t bytes);

  /* kept by usbip_device.c */
  int fd, port;
  uint8_t configuration;
  struct usb_waiting {
    uint32_t seqnum, length;
  } waiting[16][USB_MAX_WAITING];
  unsigned waiting_count[16];
  uint8_t* input;
  size_t filled, room;
};

/* Plugs into the first free port. 0, or -1 with a message on stderr. */
int usb_plug(struct usb_device* d);
void usb_unplug(struct usb_device* d);
/* Handles what the host sent; false when the host (or usb_unplug) has ended the connection. */
bool usb_service(struct usb_device* d);
/* Bytes the oldest waiting IN transfer of an endpoint takes; -1 if none waits. */
long usb_in_room(const struct usb_device* d, unsigned endpoint);
/* Completes that transfer with up to its length; returns what was taken. */
size_t usb_in(struct usb_device* d, unsigned endpoint, const uint8_t* data, size_t bytes);

#endif
