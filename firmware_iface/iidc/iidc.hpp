#pragma once
/// IIDC 1.31/1.32 digital camera protocol (1394 TA 2003017, 2004006) as layouts and pure functions,
/// without I/O or clock. The same registers are accessed over IEEE 1394 and, on Point Grey's
/// cameras, over USB.
///
/// Quadlets are 32-bit values in host byte order; the bus swaps them (big-endian on 1394,
/// little-endian on USB). Bits are numbered as in C, with bit 31 the most significant; the IIDC
/// documents number in reverse.
#include "firmware_iface/iidc/bandwidth.hpp"
#include "firmware_iface/iidc/config_rom.hpp"
#include "firmware_iface/iidc/cycle_time.hpp"
#include "firmware_iface/iidc/features.hpp"
#include "firmware_iface/iidc/formats.hpp"
#include "firmware_iface/iidc/frame_info.hpp"
#include "firmware_iface/iidc/registers.hpp"
