#pragma once
/// What XSens sensors say over a serial line: the frames (Xbus) and what stands in them (MTData2).
/// Pure functions over bytes the caller owns; no line, no clock, no thread.
#include "firmware_iface/xbus/frame.hpp"
#include "firmware_iface/xbus/mtdata2.hpp"
