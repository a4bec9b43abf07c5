#include "tests/unit/firmware_iface/trigger/c_side.h"

size_t c_side_write_event(const TriggerEvent* event, uint8_t sequence, uint8_t* out) {
  uint8_t payload[trigger_event_payload_size];
  trigger_put_event(event, payload);
  return trigger_write_frame(trigger_event, sequence, payload, sizeof payload, out);
}

TriggerDecodeStatus c_side_decode(TriggerDecoder* decoder, uint8_t byte, TriggerFrame* frame) {
  return trigger_decode(decoder, byte, frame);
}
