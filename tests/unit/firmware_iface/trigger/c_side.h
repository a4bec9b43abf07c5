#ifndef VERGENCE_TESTS_UNIT_FIRMWARE_IFACE_TRIGGER_C_SIDE_H
#define VERGENCE_TESTS_UNIT_FIRMWARE_IFACE_TRIGGER_C_SIDE_H
/* The header as the firmware's compiler sees it: built as C11, called from the C++ tests. */
#include "firmware_iface/trigger/trigger.h"

#ifdef __cplusplus
extern "C" {
#endif

size_t c_side_write_event(const TriggerEvent* event, uint8_t sequence, uint8_t* out);
TriggerDecodeStatus c_side_decode(TriggerDecoder* decoder, uint8_t byte, TriggerFrame* frame);

#ifdef __cplusplus
}
#endif
#endif
