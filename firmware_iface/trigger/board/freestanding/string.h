#ifndef VERGENCE_FIRMWARE_IFACE_TRIGGER_BOARD_FREESTANDING_STRING_H
#define VERGENCE_FIRMWARE_IFACE_TRIGGER_BOARD_FREESTANDING_STRING_H
/* All of a C library that the image has: these two, in memory.c. */
#include <stddef.h>

void* memcpy(void* restrict to, const void* restrict from, size_t size);
void* memset(void* at, int value, size_t size);

#endif
