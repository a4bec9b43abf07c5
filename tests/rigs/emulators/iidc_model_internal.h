/* What the sources of the model share: iidc_model.c (ROM and modes), iidc_registers.c,
 * iidc_sensor.c. */
#ifndef IIDC_MODEL_INTERNAL_H
#define IIDC_MODEL_INTERNAL_H

#include "tests/rigs/emulators/iidc_model.h"

#define COMMAND 0xf00000u /* offset of the command registers from CSR */

/* IIDC numbers bits from the most significant one. */
static inline uint32_t bit(unsigned n) { return 0x80000000u >> n; }

/* What V_MODE_INQ of a format and V_RATE_INQ of a mode say. */
uint32_t iidc_modes_of(unsigned format);
uint32_t iidc_rates_of(bool beta, unsigned format, unsigned mode);
/* ErrorFlag_1 and 2 of format 7. */
uint32_t iidc_f7_errors(const struct iidc_camera* c);

#endif
