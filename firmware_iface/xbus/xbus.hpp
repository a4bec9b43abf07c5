#pragma once
/// Protocols of XSens sensors: the frames (Xbus), the data of both generations
/// (MTData of the MTi-G, MTData2 of the MTi-G-700/710), what can be asked and set, and how much of
/// a line it takes. Pure functions over bytes the caller owns; no line, no clock, no thread.
#include "firmware_iface/xbus/configuration.hpp"
#include "firmware_iface/xbus/frame.hpp"
#include "firmware_iface/xbus/line_budget.hpp"
#include "firmware_iface/xbus/mtdata.hpp"
#include "firmware_iface/xbus/mtdata2.hpp"
