#pragma once
/// Protocols of XSens sensors: frames (Xbus), data of both generations (MTData of the MTi-G,
/// MTData2 of the MTi-G-700/710), requests and settings, and the load on a serial link. Pure
/// functions over the caller's bytes, without I/O, clock or threads.
#include "firmware_iface/xbus/configuration.hpp"
#include "firmware_iface/xbus/frame.hpp"
#include "firmware_iface/xbus/line_budget.hpp"
#include "firmware_iface/xbus/mtdata.hpp"
#include "firmware_iface/xbus/mtdata2.hpp"
