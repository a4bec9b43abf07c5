#pragma once
/// The IIDC 1.31/1.32 digital camera protocol (1394 TA 2003017, 2004006) as pure functions and
/// layouts: no I/O, no clock. The same registers are reached over IEEE 1394 and, on Point Grey's
/// cameras, over USB.
///
/// Quadlets are 32-bit values in the processor's order; a bus turns them (big-endian on 1394,
/// little-endian on USB). Bits are numbered as in C, bit 31 the most significant one; the documents
/// of IIDC number the other way.
#include "firmware_iface/iidc/bandwidth.hpp"
#include "firmware_iface/iidc/config_rom.hpp"
#include "firmware_iface/iidc/cycle_time.hpp"
#include "firmware_iface/iidc/features.hpp"
#include "firmware_iface/iidc/formats.hpp"
#include "firmware_iface/iidc/frame_info.hpp"
#include "firmware_iface/iidc/registers.hpp"
