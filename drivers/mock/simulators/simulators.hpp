#pragma once
/// Devices at byte level, behind lines in virtual or real time.
#include "drivers/mock/simulators/board_simulator.hpp"
#include "drivers/mock/simulators/device_model.hpp"
#include "drivers/mock/simulators/simulated_line.hpp"
#include "drivers/mock/simulators/xsens_simulator.hpp"
